"""A deferred end of a run is stored once, when the database answers again."""

from datetime import UTC, datetime, timedelta

import pytest

from store.catalogue import Catalogue
from store.deferred_run_end import defer_run_end, store_deferred_end, store_deferred_ends
from store.errors import StoreError
from store.locks import run_lock
from store.runs import Run, get_run, list_run_events, reopen_run, start_run
from store.states import RunState


def begun(catalogue: Catalogue, started_at: datetime | None = None) -> Run:
    catalogue.waveforms.folder.mkdir(exist_ok=True)
    with catalogue.writing() as session:
        return start_run(session, kind="sweep", title="t", article="beam 3", setup={}, started_at=started_at)


def history(catalogue: Catalogue, run: Run) -> list[tuple[str, str | None, str | None]]:
    with catalogue.reading() as session:
        return [(event.state.value, event.reason, event.who) for event in list_run_events(session, run.id)]


def test_an_end_that_was_kept_is_stored_with_its_time_reason_and_who(catalogue: Catalogue) -> None:
    run, other = begun(catalogue), begun(catalogue)
    before = datetime.now(UTC)
    defer_run_end(catalogue, run, RunState.FAILED, "the database is locked", "test")
    after = datetime.now(UTC)
    store_deferred_ends(catalogue)
    assert history(catalogue, run)[1:] == [("failed", "the database is locked", "test")]
    assert history(catalogue, other)[1:] == []
    with catalogue.reading() as session:
        ended = get_run(session, run.id)
    assert (ended.state, ended.reason) == (RunState.FAILED, "the database is locked")
    assert ended.finished_at is not None
    assert before <= ended.finished_at <= after


def test_an_end_is_stored_once_and_not_again_for_a_run_that_was_resumed(catalogue: Catalogue) -> None:
    run = begun(catalogue)
    defer_run_end(catalogue, run, RunState.STOPPED, "stopped by hand", "test")
    store_deferred_end(catalogue, run)
    with catalogue.writing() as session:
        reopen_run(session, run.id, "resumed")
    store_deferred_ends(catalogue)
    assert [state for state, _, _ in history(catalogue, run)] == ["running", "stopped", "running"]


def test_an_end_that_was_stored_before_its_file_was_removed_is_not_stored_twice(catalogue: Catalogue) -> None:
    run = begun(catalogue)
    for _ in range(2):  # the second file is what a power cut leaves
        defer_run_end(catalogue, run, RunState.STOPPED, "stopped by hand", "test")
        store_deferred_end(catalogue, run)
    assert [state for state, _, _ in history(catalogue, run)] == ["running", "stopped"]


def test_an_end_before_its_start_is_stored_and_says_that_the_clock_was_set_back(catalogue: Catalogue) -> None:
    run = begun(catalogue, datetime.now(UTC) + timedelta(hours=1))
    defer_run_end(catalogue, run, RunState.FAILED, "the disk is full", "test")
    store_deferred_ends(catalogue)
    (_, (state, reason, _)) = history(catalogue, run)
    assert state == "failed"
    assert str(reason).startswith("the disk is full; the computer's clock was set back")


def test_the_end_of_a_locked_run_is_left_to_the_process_that_holds_it(catalogue: Catalogue) -> None:
    run = begun(catalogue)
    defer_run_end(catalogue, run, RunState.FAILED, "the database is locked", "test")
    with run_lock(catalogue, run):
        store_deferred_ends(catalogue)
        assert history(catalogue, run)[1:] == []
    store_deferred_ends(catalogue)
    assert [state for state, _, _ in history(catalogue, run)] == ["running", "failed"]


def test_an_end_that_cannot_be_kept_is_an_error(catalogue: Catalogue) -> None:
    run = begun(catalogue)
    catalogue.waveforms.folder.rmdir()
    with pytest.raises(StoreError, match=r"\.waveforms\.ended cannot be written: No such file"):
        defer_run_end(catalogue, run, RunState.FAILED, "the database is locked", "test")
