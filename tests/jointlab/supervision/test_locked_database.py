"""Another program writes to the database for longer than a run waits: the run ends in words, at rest, and goes on."""

import re
import time
from pathlib import Path

import pytest

from jointlab.drive.phase import Phase
from jointlab.supervision.manager import RunManager
from rig.registers import State
from rig.sequence import sequence_from
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from store.check import check
from store.errors import StoreError
from store.runs import list_run_events
from store.sine_records import SineRecord, list_sine_records
from store.states import RunState
from tests.api.conftest import paper
from tests.store.another_process import another_process

SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 130, "step": 10},
}  # fmt: skip
POINTS = 12
HOLD = """
import sqlite3, sys
other = sqlite3.connect({!r}, isolation_level=None)
other.execute("BEGIN IMMEDIATE")
print("held", flush=True)
sys.stdin.read()
"""


def stored(catalogue: Catalogue, run: int) -> list[SineRecord]:
    with catalogue.reading() as session:
        return list_sine_records(session, run)


def test_a_run_whose_database_is_locked_ends_in_words_at_rest_and_goes_on_with_nothing_lost(
    impatient: None, rig: RunManager, laboratory: Laboratory, catalogue: Catalogue, tmp_path: Path
) -> None:
    run = rig.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
    rig.start(run, "test", automatic=True)
    while rig.state.sines < 3:
        assert rig.state.ended_as is None, rig.state.reason
        time.sleep(0.01)
    with another_process(HOLD.format(str(tmp_path / "jointlab.db"))):
        assert rig.wait(60)
        assert (rig.state.phase, rig.state.ended_as) == (Phase.IDLE, "failed")
        assert "could not be stored" in str(rig.state.reason)
        assert "database is locked; another program is writing" in str(rig.state.reason)
        assert laboratory.tester.device.status()["state"] is State.HYDRAULICS_OFF
        assert laboratory.tester.actuator.steady_pp() == 0.0
        acknowledged, (reason,) = rig.state.sines, re.findall(r"ended as failed \((.*)\), which", str(rig.state.reason))
        with pytest.raises(StoreError, match="another program is writing"):
            rig.resume(run, "test", automatic=True)

    before = stored(catalogue, run)
    assert [record.order_number for record in before] == list(range(1, acknowledged + 1))
    rig.resume(run, "test", automatic=True)
    assert rig.wait(60)
    everything = stored(catalogue, run)
    assert everything[:acknowledged] == before
    assert [record.order_number for record in everything] == list(range(1, POINTS + 1))
    with catalogue.reading() as session:
        assert [(event.state, event.reason) for event in list_run_events(session, run)] == [
            (RunState.CREATED, None), (RunState.RUNNING, None), (RunState.FAILED, reason),
            (RunState.RUNNING, "resumed after it was failed"), (RunState.FINISHED, None),
        ]  # fmt: skip
    assert [finding for finding in check(catalogue) if finding.damage] == []
