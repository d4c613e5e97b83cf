"""`jointlab doctor` examines the rig, says what to do, and signs it; `jointlab run` warns of what is old or changed."""

from pathlib import Path

import pytest
import yaml

from jointlab.trials.simulated_laboratory import as_toml
from simlab.beside_the_beam import SUSPENDED_MASS
from simlab.laboratory import Laboratory
from tests.api.conftest import Command, Query, paper

RECORDS = "SELECT place, verdict FROM commissioning_records ORDER BY id"


@pytest.fixture
def strikes(laboratory: Laboratory, tmp_path: Path) -> None:
    """The simulated bench mounts its accelerometer by itself."""
    path = tmp_path / "jointlab.toml"
    text = as_toml(laboratory.addresses, strikes=True)
    path.write_text(f'{text}\n[drive]\nfolder = "{tmp_path / "drive"}"\nstop_port = 0\n', encoding="utf-8")


def test_every_place_of_a_healthy_rig_is_examined_and_signed(jointlab: Command, strikes: None, query: Query) -> None:
    done = jointlab("doctor", "--trip", "--calibrator", "--mass", SUSPENDED_MASS, "--who", "Ann")
    assert done.returncode == 0, done.stdout + done.stderr
    assert query(RECORDS) == [("bench", "passed"), ("calibrator", "passed"), ("mass", "passed")]
    assert "record 1 signed by Ann" in done.stdout
    ((sensitivity, uncertainty),) = query("SELECT sensitivity, uncertainty FROM calibrations")
    assert sensitivity == pytest.approx(10.2e-3, rel=0.01)
    assert uncertainty == pytest.approx(0.03, rel=0.05)


@pytest.mark.usefixtures("drive")
def test_a_fault_is_said_with_what_to_do_and_the_code_of_an_instrument(
    jointlab: Command, laboratory: Laboratory, query: Query
) -> None:
    laboratory.daq.faults.set("cable_open", "cDAQ1Mod1/ai1")
    done = jointlab("doctor")
    assert done.returncode == 4
    assert "accelerometer, largest value" in done.stdout
    assert "open cable" in done.stdout
    assert query(RECORDS) == [("bench", "failed")]


@pytest.mark.usefixtures("drive")
def test_a_database_that_cannot_be_written_is_a_failed_check(
    jointlab: Command, laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("JOINTLAB_DATABASE_URL", "sqlite:////nowhere/lab.db")
    done = jointlab("doctor")
    assert done.returncode == 4
    assert "FAILED    database" in done.stdout
    assert "passed    hammer, noise at rest" in done.stdout


@pytest.mark.usefixtures("drive")
def test_a_run_warns_where_the_rig_was_not_examined(jointlab: Command, laboratory: Laboratory, tmp_path: Path) -> None:
    document = paper() | {"steps": [{"step": "wait", "seconds": 0.01}]}
    (tmp_path / "sequence.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    done = jointlab("run", "sequence.yaml")
    assert done.returncode == 0
    assert "warning: this rig was never examined; jointlab doctor examines it" in done.stderr
