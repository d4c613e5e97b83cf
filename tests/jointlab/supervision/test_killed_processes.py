"""kill -9 in the middle of a run: of the service, which the run outlives, and of the drive process of either way in."""

import os
import signal
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import yaml

from jointlab.client import Client, Driver, ProblemError
from jointlab.errors import INSTRUMENT
from simlab.laboratory import LaboratoryProcess
from store.backup.check import check
from store.catalogue import Catalogue
from store.states import RunState
from tests.api.commands.test_interrupts import Terminal
from tests.api.commands.test_service import serving_process
from tests.api.conftest import configuration, paper
from tests.drive_holder import drive_process
from tests.waiting import LONG, until

POINTS = 111  # so many take 8 s: a run of 12 was over before a busy computer had seen its third point
SWEEP = {
    "step": "sweep",
    "specimens": ["I"],
    "configurations": ["shear"],
    "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 130, "step": 1},
}


@pytest.fixture
def laboratory(tmp_path: Path) -> Iterator[LaboratoryProcess]:
    with LaboratoryProcess(1, 20.0) as laboratory:
        (tmp_path / "jointlab.toml").write_text(configuration(laboratory.addresses, tmp_path), encoding="utf-8")
        yield laboratory


def mount(lab: Client, driver: Driver, laboratory: LaboratoryProcess, run: int) -> None:
    """Be the technician who is asked to mount."""
    while (prompt := lab.rig().prompt) is None:
        time.sleep(0.05)
    assert prompt.kind == "mount"
    laboratory.operator.do("mount", specimen="I", configuration="shear")
    driver.answer(run, prompt.number)


def stored(folder: Path) -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(folder / "jointlab.db")) as connection:
        return connection.execute("SELECT id, order_number, frequency FROM sine_records ORDER BY id").fetchall()


def measure_until_killed(lab: Client, laboratory: LaboratoryProcess, run: int, kill: Callable[[], None]) -> None:
    """Drive a run until three sine points are measured, then let the service die.

    Raises:
        ProblemError: when the lease would be given back, there is no service any more.
    """
    with lab.driving("test") as driver:
        driver.start(run)
        mount(lab, driver, laboratory, run)
        while lab.rig().sines < 3:
            time.sleep(0.02)
        kill()


def undamaged(folder: Path) -> bool:
    with Catalogue.open(f"sqlite:///{folder / 'jointlab.db'}") as catalogue:
        return [finding for finding in check(catalogue) if finding.damage] == []


def test_a_run_outlives_the_service_and_the_next_one_stores_it(laboratory: LaboratoryProcess, tmp_path: Path) -> None:
    with serving_process(tmp_path) as (address, process), Client(address) as lab:
        run = lab.create_run(paper() | {"steps": [SWEEP]})
        with pytest.raises(ProblemError, match="no service answers"):
            measure_until_killed(lab, laboratory, run.id, process.kill)
    assert len(stored(tmp_path)) < POINTS
    with serving_process(tmp_path) as (address, _), Client(address) as lab:
        # it was not cut off, so nothing else went on with it
        assert lab.wait_for_run(run.id).state is RunState.FINISHED
        assert lab.rig().driven_by is None
        assert [order for _, order, _ in stored(tmp_path)] == list(range(1, POINTS + 1))
        driving = drive_process(tmp_path)  # another one where this service came long after the run
    assert undamaged(tmp_path)
    os.kill(driving, signal.SIGTERM)


def test_where_the_drive_process_is_killed_the_tester_stops_and_the_run_goes_on_with_nothing_lost(
    laboratory: LaboratoryProcess, tmp_path: Path
) -> None:
    with serving_process(tmp_path) as (address, _), Client(address) as lab:
        run = lab.create_run(paper() | {"steps": [SWEEP]})
        first = drive_process(tmp_path)
        measure_until_killed(lab, laboratory, run.id, lambda: os.kill(first, signal.SIGKILL))
        until(lambda: lab.rig().interlocks == ["watchdog"])  # told by the process that came after it
        assert lab.run(run.id).state is RunState.RUNNING  # no process was left to change it
        acknowledged = stored(tmp_path)
        assert 3 <= len(acknowledged) < POINTS
        with lab.driving("test") as driver:
            assert driver.acknowledge_interlock(run.id, "the drive process was killed") == ["watchdog"]
            driver.resume(run.id)
            mount(lab, driver, laboratory, run.id)
            assert lab.wait_for_run(run.id).state is RunState.FINISHED
    everything = stored(tmp_path)
    assert everything[: len(acknowledged)] == acknowledged
    assert [order for _, order, _ in everything] == list(range(1, POINTS + 1))
    assert undamaged(tmp_path)


def test_jointlab_run_ends_with_an_error_where_its_drive_process_is_killed(
    laboratory: LaboratoryProcess, tmp_path: Path
) -> None:
    file = tmp_path / "sequence.yaml"
    file.write_text(yaml.safe_dump(paper() | {"steps": [{"step": "wait", "seconds": 600}]}), encoding="utf-8")
    with closing(Terminal(tmp_path, "run", str(file))) as terminal:
        terminal.wait_for("waiting for 600 s")
        os.kill(drive_process(tmp_path), signal.SIGKILL)
        terminal.wait_for("run 1 was cut off")
        assert terminal.process.wait(LONG) == INSTRUMENT
