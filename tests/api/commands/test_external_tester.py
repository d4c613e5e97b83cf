"""A whole run on a tester that its own software drives, from the terminal."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from jointlab.drive.process import driving
from jointlab.settings import DriveSettings
from jointlab.trials.simulated_laboratory import SimulatedOperator, simulated_settings
from rig.instruments import EXTERNAL
from simlab.laboratory import Laboratory
from tests.api.conftest import Command, Query, Write


@pytest.fixture
def external(laboratory: Laboratory, tmp_path: Path) -> Iterator[None]:
    """The simulated laboratory with nothing that drives its tester, and its drive process."""
    config = tmp_path / "jointlab.toml"
    written = config.read_text(encoding="utf-8")
    assert laboratory.addresses.tester in written
    config.write_text(written.replace(laboratory.addresses.tester, EXTERNAL), encoding="utf-8")
    drive = DriveSettings(folder=tmp_path / "drive", stop_port=0)
    with driving(simulated_settings(laboratory.addresses, drive=drive).model_copy(update={"tester_url": EXTERNAL})):
        yield


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
