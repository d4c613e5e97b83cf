"""Another program writes to the database for longer than a run waits: the run goes on, and is stored afterwards."""

import time
from pathlib import Path

from jointlab.drive.phase import Phase
from jointlab.supervision.manager import RunManager
from rig.registers import State
from rig.sequence import sequence_from
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from store.check import check
from store.runs import get_run, list_run_events
from store.sine_records import list_sine_records
from store.states import RunState
from tests.api.conftest import paper
from tests.store.another_process import another_process
from tests.waiting import LONG, until

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


def test_a_run_goes_on_while_its_database_is_locked_and_nothing_is_lost(
    impatient: None, rig: RunManager, laboratory: Laboratory, catalogue: Catalogue, tmp_path: Path
) -> None:
    run = rig.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
    rig.start(run, "test", automatic=True)
    while rig.state.sines < 3:
        assert rig.state.ended_as is None, rig.state.reason
        time.sleep(0.01)
    with another_process(HOLD.format(str(tmp_path / "jointlab.db"))):
        until(lambda: rig.state.phase is Phase.IDLE)
        assert (rig.state.ended_as, rig.state.reason, rig.state.sines) == (RunState.FINISHED, None, POINTS)
        assert laboratory.tester.device.status()["state"] is State.HYDRAULICS_OFF
        with catalogue.reading() as session:
            assert get_run(session, run).state is RunState.RUNNING
    assert rig.wait(LONG)
    with catalogue.reading() as session:
        records = list_sine_records(session, run)
        assert [(event.state, event.reason) for event in list_run_events(session, run)] == [
            (RunState.CREATED, None), (RunState.RUNNING, None), (RunState.FINISHED, None),
        ]  # fmt: skip
    assert [record.order_number for record in records] == list(range(1, POINTS + 1))
    assert [finding for finding in check(catalogue) if finding.damage] == []
