"""`jointlab gap investigate` refuses wrong answers before it diagnoses, and moves nothing without consent."""

import io
from pathlib import Path

import pytest

from analysis.gap.evidence.verdict import Status
from analysis.gap.experiments.catalogue import Experiment
from analysis.gap.experiments.missing_condition import MissingCondition
from analysis.gap.experiments.next_experiment import NextExperiment
from analysis.gap.experiments.requested_data import Missing
from api.commands.gap_investigate import OnRig, answer_of, show
from jointlab.diagnosis.investigation import Asked, Budget, Data, Investigation, Readings, Refused, Step
from jointlab.diagnosis.investigation_folder import save, stored
from jointlab.errors import JointlabError
from jointlab.settings import Settings
from rig.sequences.sequence import Sequence
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case
from store.catalogue import Catalogue
from tests.api.conftest import Command


def test_options_give_one_answer() -> None:
    assert answer_of(None, [], None) is None
    assert answer_of("12", [], None) == Data("12")
    assert answer_of(None, ["joint_mass.m=0.12", "density.relative = -1e-3"], None) == Readings(
        {"joint_mass.m": 0.12, "density.relative": -1e-3}
    )
    assert answer_of(None, [], "no scales") == Refused("no scales")
    with pytest.raises(JointlabError, match="one answer"):
        answer_of("12", ["joint_mass.m=0.1"], None)
    with pytest.raises(JointlabError, match="NAME=VALUE"):
        answer_of(None, ["joint_mass.m"], None)


def test_an_answer_that_nothing_asked_for_and_the_rig_for_a_bundle_are_refused(
    jointlab: Command, tmp_path: Path
) -> None:
    answer = jointlab("gap", "investigate", "bundle", "--folder", tmp_path / "none", "--refuse", "no")
    assert answer.returncode != 0
    assert "holds no investigation that waits for an answer" in answer.stderr
    answer = jointlab("gap", "investigate", "bundle", "--folder", tmp_path / "none", "--rig")
    assert answer.returncode != 0
    assert "--rig needs a run" in answer.stderr
    assert not (tmp_path / "none").exists()


WAITING = Step(
    1,
    Status.EXPLAINED,
    ("channel_delay",),
    0.7,
    Asked(NextExperiment(Experiment.STRIKE_KNOWN_MASS, information=1.0, doubt=1.0), "", {"channel_delay.tau": "s"}),
)


def test_an_answer_to_an_investigation_of_other_data_is_refused_and_not_stored(
    jointlab: Command, tmp_path: Path
) -> None:
    state = Investigation("first", Budget(), (WAITING,))
    save(tmp_path / "folder", state)
    reading = "--reading", "channel_delay.tau=25e-6"
    answer = jointlab("gap", "investigate", "other", "--folder", tmp_path / "folder", *reading)
    assert answer.returncode != 0
    assert "holds an investigation of first, not of other" in answer.stderr
    assert stored(tmp_path / "folder") == state


def test_a_limit_that_is_not_given_stays_as_it_was(jointlab: Command, tmp_path: Path) -> None:
    """Of an investigation that waits, so that nothing is diagnosed."""
    save(tmp_path / "folder", Investigation("first", Budget(600.0, 8, 0.99), (WAITING,)))
    for option, budget in (
        (("--minutes", "500"), Budget(500.0, 8, 0.99)),
        (("--experiments", "9"), Budget(500.0, 9, 0.99)),
    ):
        done = jointlab("gap", "investigate", "first", "--folder", tmp_path / "folder", *option)
        assert done.returncode == 0, done.stderr
        found = stored(tmp_path / "folder")
        assert found is not None
        assert found.budget == budget


def test_what_is_missing_is_shown_below_the_steps(capsys: pytest.CaptureFixture[str]) -> None:
    asked = Asked(NextExperiment(Experiment.HALF_FORCE, information=1.0, doubt=1.0, minutes=14.0), "strike softer")
    step = Step(1, Status.UNKNOWN, (), 0.5, asked, Data("7"), missing=(Missing(MissingCondition.FORCE, 50.0, 68.0),))
    show(Investigation("1", Budget(), (step,)))
    said = " ".join(capsys.readouterr().out.split())
    assert "measured without: a peak force of about 50 N (nearest measured: 68 N)" in said


def test_nothing_moves_where_nobody_can_consent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin.isatty", lambda: False)
    asked = Asked(NextExperiment(Experiment.HALF_FORCE, information=1.0, doubt=1.0, minutes=14.0), "strike softer")
    assert OnRig(1).carry_out(asked) is None


def test_the_sequence_is_shown_and_runs_with_consent_only(
    jointlab: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_case(draw_case(5, CaseKind.NONE), tmp_path / "bundle")
    assert jointlab("import", "bundle").returncode == 0
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    asked = Asked(NextExperiment(Experiment.HALF_FORCE, information=1.0, doubt=1.0, minutes=14.0), "strike softer")
    consents = iter((False, True))
    monkeypatch.setattr("typer.confirm", lambda _text: next(consents))
    run = list[Sequence]()

    def carried_out(_settings: Settings, _catalogue: Catalogue, sequence: Sequence, _begin: object) -> int:
        run.append(sequence)
        return 7

    monkeypatch.setattr("api.commands.gap_investigate.carry_out", carried_out)
    assert OnRig(1).carry_out(asked) == Refused("the operator did not consent")
    assert run == []
    assert "blows of about 50 N" in capsys.readouterr().out
    assert OnRig(1).carry_out(asked) == Data("7")
    assert [step.peak_force for step in run[0].hammer_steps] == [50.0]


def test_a_person_types_readings_and_leaves_out_what_was_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = {"accelerometer_mass.m": "kg", "joint_mass.m": "kg"}
    asked = Asked(NextExperiment(Experiment.WEIGH_PARTS, information=1.0, doubt=1.0), "weigh", wanted)
    monkeypatch.setattr("sys.stdin", Keyboard("0.012\n \n\n\n"))
    assert OnRig(1).carry_out(asked) == Readings({"accelerometer_mass.m": 0.012})
    assert OnRig(1).carry_out(asked) == Refused("not read")


class Keyboard(io.StringIO):
    """What a person types at a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_reading_that_is_no_number_is_asked_for_again_and_the_others_stay(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ended the command, and what was typed before it was lost."""
    wanted = {"accelerometer_mass.m": "kg", "joint_mass.m": "kg"}
    asked = Asked(NextExperiment(Experiment.WEIGH_PARTS, information=1.0, doubt=1.0), "weigh", wanted)
    monkeypatch.setattr("sys.stdin", Keyboard("0.012\n0,03\nnan\n0.03\n"))
    assert OnRig(1).carry_out(asked) == Readings({"accelerometer_mass.m": 0.012, "joint_mass.m": 0.03})
    said = capsys.readouterr().out
    assert "'0,03' is no number" in said
    assert "nan is no number to weigh" in said
