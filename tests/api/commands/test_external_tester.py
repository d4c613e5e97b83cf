"""A whole run on a tester that its own software drives, from the terminal."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from api.page.steering import prompt_text
from jointlab.drive.process import driving
from jointlab.drive.state import RigState
from jointlab.settings import DriveSettings
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.instruments import EXTERNAL
from simlab.external_program import ProgramFault
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from store.measurements.runs import get_run
from tests.api.conftest import Command, Query, Write
from tests.waiting import LONG

QUICK = ("--elements", 2, "--joint-law", "constant")


@pytest.fixture
def external(request: pytest.FixtureRequest, laboratory: Laboratory, tmp_path: Path) -> Iterator[None]:
    """The simulated laboratory with nothing that drives its tester, and its drive process of a patience in s."""
    config = tmp_path / "jointlab.toml"
    written = config.read_text(encoding="utf-8")
    assert laboratory.addresses.tester in written
    config.write_text(written.replace(laboratory.addresses.tester, EXTERNAL), encoding="utf-8")
    drive = DriveSettings(folder=tmp_path / "drive", stop_port=0)
    changed = {"tester_url": EXTERNAL, "external_patience": getattr(request, "param", LONG)}
    with driving(simulated_settings(laboratory.addresses, drive=drive).model_copy(update=changed)):
        yield
    laboratory.program.faults.clear()


@pytest.mark.usefixtures("external")
def test_a_sequence_is_measured_as_on_any_tester(
    jointlab: Command, sequence: Write, operator: SimulatedOperator, query: Query, laboratory: Laboratory
) -> None:
    before = len(laboratory.tester.device.applied)
    done = jointlab("run", sequence(sweep={"configurations": ["compression", "shear"]}))
    assert done.returncode == 0, done.stderr
    points = query("SELECT order_number, configuration, frequency FROM sine_records ORDER BY order_number")
    assert points == [
        (1, "compression", 40.0), (2, "compression", 120.0), (3, "shear", 40.0), (4, "shear", 120.0)
    ]  # fmt: skip
    assert query("SELECT model, serial FROM instruments WHERE kind = 'tester'") == [
        ("driven by its own software", "external")
    ]
    assert len(laboratory.tester.device.applied) == before  # no command


@pytest.mark.usefixtures("external", "operator")
def test_joints_are_identified_and_reported_as_those_of_any_tester(
    jointlab: Command, sequence: Write, query: Query, tmp_path: Path
) -> None:
    points = ["1y", "3y", "5y", "7y", "9y", "11y", "1x", "11x"]
    file = sequence({"points": points, "blows": 4, "block_seconds": 2.0}, {"specimens": ["I", "II"]})
    assert jointlab("run", file).returncode == 0
    identified = jointlab("identify", 1, *QUICK)
    assert identified.returncode == 0, identified.stderr
    assert query("SELECT count(*), sum(flags <> '[]') FROM v_dynamic_stiffness WHERE latest") == [(12, 0)]
    assert query("SELECT count(*) FROM v_comparison WHERE run_id = 1 AND verdict IN ('agree', 'differ')")[0][0] > 0
    reported = jointlab("report", 1, *QUICK)
    assert reported.returncode == 0, reported.stderr
    assert "driven by its own software" in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("external", "operator")
@pytest.mark.parametrize("external", [0.5], indirect=True)
def test_points_that_were_left_out_are_told_by_the_run_that_is_finished_without_them(
    jointlab: Command, sequence: Write, query: Query, laboratory: Laboratory, tmp_path: Path
) -> None:
    laboratory.program.faults.set(ProgramFault.WRONG_AMPLITUDE)  # the operator, asked after a while, ends the mounting
    file = sequence(sweep={"configurations": ["shear"]})
    document = yaml.safe_load(file.read_text("utf-8"))
    file.write_text(yaml.safe_dump(document | {"steps": document["steps"][1:]}), encoding="utf-8")
    done = jointlab("run", file)
    left_out = (
        "left out, as the operator ended the mounting: 2 of 2 sine points with the cylinders of joint I in shear, "
        "about a mean of 0.5 mm, 0.1 mm peak to peak at 40, 120 Hz"
    )
    assert done.returncode == 0, done.stderr
    assert left_out in " ".join(done.stdout.split())
    assert query("SELECT state, reason FROM v_runs") == [("finished", left_out)]
    assert query("SELECT state, reason FROM run_events ORDER BY id DESC LIMIT 1") == [("finished", left_out)]
    assert f"reason: {left_out}" in " ".join(jointlab("show", 1).stdout.split())
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.reading() as session:
        run = get_run(session, 1)
    assert prompt_text(RigState(), None, run) == f"Run 1 is finished: {left_out}."


@pytest.mark.usefixtures("external")
def test_a_dry_run_says_what_it_cannot_check_and_refuses_what_cannot_be_done(
    jointlab: Command, sequence: Write
) -> None:
    said = jointlab("run", sequence(), "--dry-run")
    assert said.returncode == 0, said.stderr
    assert "this machine is not driven from here: its state, limits and interlocks are not checked" in said.stdout
    refused = jointlab("run", sequence(sweep={"detectors": {"force": {"limit": 500, "action": "stop"}}}), "--dry-run")
    assert refused.returncode != 0
    assert (
        "not ready: detectors are tightened in the sequence, and this machine is not driven from here" in refused.stdout
    )
