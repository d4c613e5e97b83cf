"""`jointlab run` and `jointlab resume` as a person uses them: Ctrl-C, on again, and the results are there."""

import json
import signal
from pathlib import Path

import pytest
import yaml

from analysis.dof import Dof
from jointlab.identification.load import measurement_of_run
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.sequences.sequence import Sequence, sequence_from
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from tests.api.commands.keyboard import press
from tests.api.conftest import Command, Query, Write

BAD_INPUT, INSTRUMENT, INTERRUPTED = 3, 4, 130
DOCUMENT = Path(__file__).resolve().parents[3] / "docs" / "sequences.md"


def test_ctrl_c_however_often_stops_a_run_that_resume_finishes_whole(
    jointlab: Command,
    sequence: Write,
    query: Query,
    laboratory: Laboratory,
    operator: SimulatedOperator,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    plain_strike, plain_mount = operator.strike, operator.mount
    blows = iter(range(1, 100))

    def strike(point: Dof, blow: int) -> None:
        if next(blows) == 6:
            press(signal.SIGINT, 3)
        plain_strike(point, blow)

    monkeypatch.setattr(operator, "strike", strike)
    stopped = jointlab("run", sequence())
    assert stopped.returncode == INTERRUPTED
    assert "stopping: bringing an actuator that the run drives to rest" in stopped.stderr
    assert "run 1 stopped; jointlab resume 1 goes on with it" in stopped.stderr
    assert "Traceback" not in stopped.stderr
    ((state, reason, accepted),) = query("SELECT state, reason, blows_accepted FROM v_runs")
    assert (state, reason) == ("stopped", "stopped by hand")
    assert accepted in (5, 6)  # the sixth was struck while the stop was on its way

    def mount(specimen: str, configuration: str) -> None:
        if configuration == "shear":
            press(signal.SIGINT, 3)
        plain_mount(specimen, configuration)

    monkeypatch.setattr(operator, "mount", mount)
    again = jointlab("resume", 1)
    assert again.returncode == INTERRUPTED
    assert f"run 1 goes on after {accepted} blows and 0 sine points" in again.stderr
    assert query("SELECT blows_accepted, sine_records FROM v_runs") == [(8, 2)]
    assert laboratory.tester.actuator.steady_pp() == 0.0

    monkeypatch.setattr(operator, "mount", plain_mount)
    done = jointlab("resume", 1)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "run 1 finished; jointlab identify 1 evaluates it\n"
    assert query("SELECT run_id, state, blows_accepted, sine_records FROM v_runs") == [(1, "finished", 8, 6)]
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        measurement = measurement_of_run(catalogue, 1)
    (struck,) = measurement.sets
    assert [str(point) for point in struck.inputs] == ["1y", "3y", "5y", "1x"]
    assert struck.averages == 2
    assert [point.order_number for point in measurement.points] == [1, 2, 3, 4, 5, 6]
    assert all(point.result.stiffness > 0 for point in measurement.points)


@pytest.mark.usefixtures("drive", "operator")
def test_a_run_that_cannot_be_resumed_is_bad_input_in_one_line(jointlab: Command, sequence: Write) -> None:
    assert jointlab("run", sequence()).returncode == 0
    for number, words in ((1, "run 1 is finished; there is nothing to resume"), (7, "there is no run 7")):
        refused = jointlab("resume", number)
        assert refused.returncode == BAD_INPUT
        assert refused.stderr.splitlines()[-1].startswith(f"jointlab: {words}")
        assert "Traceback" not in refused.stderr


@pytest.mark.usefixtures("drive")
def test_a_tripped_tester_is_reset_by_resume_only_with_reset(
    jointlab: Command, sequence: Write, query: Query, laboratory: Laboratory, operator: SimulatedOperator,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    plain = operator.mount

    def trip(specimen: str, configuration: str) -> None:
        plain(specimen, configuration)
        if configuration == "shear":
            laboratory.tester.emergency_stop()
            laboratory.tester.release_emergency_stop()

    monkeypatch.setattr(operator, "mount", trip)
    failed = jointlab("run", sequence())
    assert failed.returncode == INSTRUMENT
    assert "the tester has stopped the actuator: emergency stop\n" in failed.stderr
    assert "run 1 failed; jointlab resume 1 goes on with it" in failed.stderr
    monkeypatch.setattr(operator, "mount", plain)
    assert jointlab("resume", 1).returncode == INSTRUMENT
    again = jointlab("resume", 1, "--reset")
    assert again.returncode == 0
    assert "the tester was reset after emergency stop\n" in again.stderr
    reasons = [reason for (reason,) in query("SELECT reason FROM run_events ORDER BY id")]
    assert "tester reset after emergency stop" in reasons[2]
    assert reasons[1] == "the tester was stopped by emergency stop; remove the cause, then reset"


def test_the_schema_is_printed_and_is_that_of_every_sequence(jointlab: Command) -> None:
    answer = jointlab("run", "--schema")
    assert answer.returncode == 0
    assert json.loads(answer.stdout) == Sequence.model_json_schema()
    assert {"HammerStep", "SweepStep", "WaitStep", "SoakStep", "Order"} <= set(json.loads(answer.stdout)["$defs"])


def test_a_dry_run_shows_the_shuffling_and_the_waiting_times(jointlab: Command, sequence: Write) -> None:
    file = sequence(sweep={"order": "all", "seed": 12})
    document = yaml.safe_load(file.read_text("utf-8"))
    soak = {"step": "soak", "seconds": 600, "celsius": 23, "band_celsius": 1, "limit_seconds": 7200}
    document["steps"] += [{"step": "wait", "seconds": 30}, soak]
    file.write_text(yaml.safe_dump(document), encoding="utf-8")
    answer = jointlab("run", file, "--dry-run")
    assert answer.returncode == 0, answer.stderr
    assert "shuffled: all, seed 12" in answer.stdout
    assert "3. wait: 30 s\n4. soak: 600 s within 1 K about 23 C, at most 7200 s\n" in answer.stdout
    answer = jointlab("run", sequence(sweep={"order": "amplitudes"}), "--dry-run")
    assert "shuffled: amplitudes, seed drawn at the start" in answer.stdout


def test_the_documented_sequence_is_one() -> None:
    blocks = DOCUMENT.read_text("utf-8").split("```yaml\n")[1:]
    example = blocks[0].split("```")[0]
    sequence = sequence_from(yaml.safe_load(example))
    assert {step.step for step in sequence.steps} == {"hammer", "sweep", "wait", "soak", "blank", "prompt"}


def test_every_field_of_a_step_is_documented() -> None:
    text = DOCUMENT.read_text("utf-8")
    for name in ("HammerStep", "SweepStep", "WaitStep", "SoakStep", "PromptStep", "Frequencies", "StepDetectors"):
        for key in Sequence.model_json_schema()["$defs"][name]["properties"]:
            assert f"`{key}`" in text, f"{name}.{key}"
