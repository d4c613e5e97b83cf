"""The history of a run, and that one process at a time carries it out."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
from alembic import command
from sqlalchemy import text

from store.catalogue import Catalogue
from store.errors import NotFoundError, StoreError
from store.measurements.locks import RunBusyError, discard_run_lock, run_lock
from store.measurements.runs import Run, finish_run, get_run, list_run_events, reopen_run, start_run
from store.migrate import configuration
from store.states import RunState
from tests.store.another_process import another_process


@pytest.fixture
def run(catalogue: Catalogue) -> Run:
    with catalogue.writing() as session:
        return start_run(session, kind="sequence", title="t", article="a", setup={}, who="ann@rig, process 7")


def test_a_run_that_is_resumed_keeps_every_reason_why_it_ended(catalogue: Catalogue, run: Run) -> None:
    with catalogue.writing() as session:
        finish_run(session, run.id, RunState.FAILED, "the tester tripped")
        again = reopen_run(session, run.id, "resumed", who="bob@rig, process 9")
        assert (again.state, again.reason, again.finished_at) == (RunState.RUNNING, None, None)
        assert again.started_at == run.started_at
        finish_run(session, run.id, RunState.STOPPED, "stopped by hand")
        reopen_run(session, run.id, "resumed")
        finish_run(session, run.id, RunState.FINISHED)
    with catalogue.reading() as session:
        events = list_run_events(session, run.id)
    assert [(event.state.value, event.reason, event.who) for event in events] == [
        ("running", None, "ann@rig, process 7"),
        ("failed", "the tester tripped", None),
        ("running", "resumed", "bob@rig, process 9"),
        ("stopped", "stopped by hand", None),
        ("running", "resumed", None),
        ("finished", None, None),
    ]
    assert events[0].happened_at == run.started_at
    assert all(event.happened_at <= datetime.now(UTC) for event in events)


def test_a_finished_run_is_not_opened_again(catalogue: Catalogue, run: Run) -> None:
    with catalogue.writing() as session:
        finish_run(session, run.id, RunState.FINISHED)
    with pytest.raises(StoreError, match=f"run {run.id} is finished"), catalogue.writing() as session:
        reopen_run(session, run.id, "resumed")
    with pytest.raises(NotFoundError), catalogue.writing() as session:
        reopen_run(session, 999, "resumed")
    with pytest.raises(NotFoundError), catalogue.reading() as session:
        list_run_events(session, 999)


@pytest.mark.parametrize("statement", ["UPDATE run_events SET reason = 'never was'", "DELETE FROM run_events"])
def test_history_is_never_changed(catalogue: Catalogue, run: Run, statement: str) -> None:
    with pytest.raises(StoreError, match="never changed or deleted"), catalogue.writing() as session:
        session.execute(text(statement))
    with catalogue.reading() as session:
        assert len(list_run_events(session, run.id)) == 1


def test_a_run_of_an_older_database_has_its_start_and_end_for_history(catalogue: Catalogue, filled: int) -> None:
    for migrate, revision in ((command.downgrade, "0003"), (command.upgrade, "head")):
        with catalogue.writing() as session:
            migrate(configuration(session.connection()), revision)
    with catalogue.reading() as session:
        before = get_run(session, filled)
        first, last = list_run_events(session, filled)
    assert (first.state, first.happened_at) == (RunState.RUNNING, before.started_at)
    assert (last.state, last.reason) == (before.state, before.reason)


def test_one_process_at_a_time_carries_out_a_run_and_is_named(catalogue: Catalogue, run: Run) -> None:
    refused = pytest.raises(RunBusyError, match="carried out by ann@rig, process 7")
    with run_lock(catalogue, run), refused, run_lock(catalogue, run):
        pass
    with run_lock(catalogue, run):
        pass
    discard_run_lock(catalogue, run)
    assert list(catalogue.waveforms.folder.glob("*.lock")) == []


def test_a_lock_ends_with_the_process_that_held_it(catalogue: Catalogue, run: Run) -> None:
    path = catalogue.waveforms.folder / f"{run.waveform_file}.lock"
    path.parent.mkdir(exist_ok=True)
    script = (
        "import sqlite3, sys\n"
        f"held = sqlite3.connect({str(path)!r}, isolation_level=None)\n"
        "held.execute('BEGIN EXCLUSIVE'); print('held', flush=True); sys.stdin.read()"
    )
    with another_process(script) as holder:
        with pytest.raises(RunBusyError), run_lock(catalogue, run):
            pass
        holder.kill()
        holder.wait()
        with run_lock(catalogue, run):
            pass


def test_a_folder_that_cannot_be_written_is_named(catalogue: Catalogue, run: Run) -> None:
    (catalogue.waveforms.folder / f"{run.waveform_file}.lock").mkdir(parents=True)
    with pytest.raises(StoreError, match=r"\.lock cannot be"), run_lock(catalogue, run):
        pass


def test_each_run_has_its_own_lock(catalogue: Catalogue, run: Run) -> None:
    with catalogue.writing() as session:
        other = start_run(session, kind="sequence", title="t", article="a", setup={})
    with run_lock(catalogue, run), run_lock(catalogue, other):
        held = sorted(Path(path).name for path in catalogue.waveforms.folder.glob("*.lock"))
    assert held == sorted(f"{each.waveform_file}.lock" for each in (run, other))
