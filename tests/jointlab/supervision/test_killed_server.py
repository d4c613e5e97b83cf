"""kill -9 of the service in the middle of a run: the tester stops by itself, the run goes on, nothing is lost."""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from jointlab.client import Client, Driver, ProblemError
from jointlab.trials.simulated_laboratory import as_toml
from rig import tester
from rig.registers import Interlock, State
from simlab.laboratory import LaboratoryProcess
from simlab.tester_device import DeviceLimits
from store.catalogue import Catalogue
from store.check import check
from store.states import RunState
from tests.api.commands.test_service import serving_process
from tests.api.conftest import paper

POINTS = 12
SWEEP = {
    "step": "sweep",
    "specimens": ["I"],
    "configurations": ["shear"],
    "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 130, "step": 10},
}


@pytest.fixture
def laboratory(tmp_path: Path) -> Iterator[LaboratoryProcess]:
    with LaboratoryProcess(1, 20.0) as laboratory:
        (tmp_path / "jointlab.toml").write_text(as_toml(laboratory.addresses), encoding="utf-8")
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


def test_the_tester_stops_by_itself_and_the_run_goes_on_with_nothing_lost(
    laboratory: LaboratoryProcess, tmp_path: Path
) -> None:
    with serving_process(tmp_path) as (address, process), Client(address) as lab:
        run = lab.create_run(paper() | {"steps": [SWEEP]})
        with pytest.raises(ProblemError, match="no service answers"):
            measure_until_killed(lab, laboratory, run.id, process.kill)
    acknowledged = stored(tmp_path)
    assert 3 <= len(acknowledged) < POINTS

    time.sleep(2 * DeviceLimits().watchdog_time)  # a client that connects keeps the watchdog from acting
    with tester.connect(laboratory.addresses.tester) as found:
        assert found.status().state is State.TRIPPED
        assert found.status().interlocks == Interlock.WATCHDOG

    with serving_process(tmp_path) as (address, _), Client(address) as lab:
        assert lab.run(run.id).state is RunState.RUNNING  # no process was left to change it
        with lab.driving("test") as driver:
            assert driver.acknowledge_interlock(run.id, "the service was killed") == ["watchdog"]
            driver.resume(run.id)
            mount(lab, driver, laboratory, run.id)
            assert lab.wait_for_run(run.id).state is RunState.FINISHED
    everything = stored(tmp_path)
    assert everything[: len(acknowledged)] == acknowledged
    assert [order for _, order, _ in everything] == list(range(1, POINTS + 1))
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        assert [finding for finding in check(catalogue) if finding.damage] == []
