"""Another program writes to the database for longer than a run waits: the run goes on, and is stored afterwards."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from jointlab.drive.phase import Phase
from jointlab.errors import ConflictError
from jointlab.supervision import manager as run_manager
from jointlab.supervision.manager import RunManager
from rig.registers import State
from rig.sequences.sequence import sequence_from
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.backup.check import check
from store.catalogue import Catalogue
from store.database.time_limits import TimeLimits
from store.measurements.runs import get_run, list_run_events
from store.measurements.sine_records import list_sine_records
from store.states import RunState
from tests.api.conftest import paper
from tests.store.another_process import another_process, holding_script
from tests.waiting import LONG, until

SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 130, "step": 10},
}  # fmt: skip
POINTS = 12


@pytest.fixture
def catalogue(database_url: str, tmp_path: Path) -> Iterator[Catalogue]:
    """Writers wait for each other for 0.05 s instead of ten."""
    with Catalogue.open(database_url, tmp_path / "waveforms", TimeLimits(lock=0.05)) as opened:
        yield opened


def test_a_run_goes_on_while_its_database_is_locked_and_nothing_is_lost(
    rig: RunManager, laboratory: Laboratory, catalogue: Catalogue, database_url: str
) -> None:
    run = rig.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
    rig.start(run, "test")
    until(lambda: rig.prompt is not None)
    prompt = rig.prompt
    assert prompt is not None
    with another_process(holding_script(database_url)):
        with closing(OperatorClient(laboratory.addresses.operator)) as operator:
            operator.do("mount", specimen="I", configuration="shear")
        rig.answer(run, prompt.number)
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


def test_a_run_is_not_resumed_while_its_records_wait_and_no_point_is_measured_twice(
    rig: RunManager, laboratory: Laboratory, database_url: str, catalogue: Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    with closing(OperatorClient(laboratory.addresses.operator)) as operator:
        operator.do("mount", specimen="I", configuration="shear")
    long = SWEEP | {"frequencies": {"first": 20, "last": 200, "step": 0.2}}
    run = rig.plan(sequence_from(paper() | {"steps": [long]}), "test")
    rig.start(run, "test")
    confirm(rig, run)
    with another_process(holding_script(database_url)):
        until(lambda: rig.state.sines > 2)
        rig.end_run(run)
        until(lambda: not rig.state.phase.is_of_a_run)
        monkeypatch.setattr(run_manager, "SETTLED", 0.3)
        with pytest.raises(ConflictError, match=f"records of run {run} wait to be stored"):
            rig.resume(run, "test", automatic=False)
        assert rig.prompt is None
    monkeypatch.setattr(run_manager, "SETTLED", LONG)
    measured = rig.state.sines
    rig.resume(run, "test", automatic=False)
    confirm(rig, run)
    until(lambda: rig.state.sines > measured)
    rig.end_run(run)
    assert rig.wait(LONG)
    with catalogue.reading() as session:
        records = list_sine_records(session, run)
    assert len(records) > measured
    assert [record.order_number for record in records] == list(range(1, len(records) + 1))


def confirm(rig: RunManager, run: int) -> None:
    """Say that what the run asks for is done."""
    until(lambda: rig.prompt is not None)
    prompt = rig.prompt
    assert prompt is not None
    rig.answer(run, prompt.number)
