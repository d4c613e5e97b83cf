"""Ends of runs that the database could not take: written to a file beside the waveforms, and stored later."""

import json
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from store.catalogue import Catalogue
from store.errors import StoreError
from store.locks import RunBusyError, run_lock
from store.runs import Run, finish_run, get_run, list_runs
from store.states import RunState

SUFFIX = ".ended"


@dataclass(frozen=True)
class _DeferredEnd:
    state: str
    reason: str | None
    who: str
    at: str  # UTC, ISO 8601


def defer_run_end(catalogue: Catalogue, run: Run, state: RunState, reason: str | None, who: str) -> None:
    """Write to a file how `run` has ended just now, because the database does not take it.

    Raises StoreError if the folder of waveforms cannot be written either.
    """
    path = _path(catalogue, run)
    unfinished = path.with_name(path.name + ".part")
    end = _DeferredEnd(state.value, reason, who, datetime.now(UTC).isoformat())
    try:
        unfinished.write_text(json.dumps(asdict(end)), encoding="utf-8")
        unfinished.replace(path)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def store_deferred_end(catalogue: Catalogue, run: Run) -> None:
    """Store the deferred end of `run`, if there is one; the caller holds the run's lock.

    StoreError if the database does not answer yet; the file stays then.
    """
    path = _path(catalogue, run)
    if not path.is_file():
        return
    end = _DeferredEnd(**json.loads(path.read_text(encoding="utf-8")))
    with catalogue.writing() as session:
        now = get_run(session, run.id)
        if now.state is RunState.RUNNING:  # otherwise it was stored, and the file not yet removed
            at = datetime.fromisoformat(end.at)
            # `finish_run` reports a clock that was set back during the run
            finish_run(session, run.id, RunState(end.state), end.reason, at if at >= now.started_at else None, end.who)
    path.unlink()


def store_deferred_ends(catalogue: Catalogue) -> None:
    """Store the deferred ends of all runs that no process carries out; errors as for `store_deferred_end`."""
    with catalogue.reading() as session:
        cut_off = list_runs(session, state=RunState.RUNNING)
    for run in cut_off:
        if _path(catalogue, run).is_file():
            try:
                with run_lock(catalogue, run):
                    store_deferred_end(catalogue, run)
            except RunBusyError:
                continue  # the process that resumes it stores its end first


def _path(catalogue: Catalogue, run: Run) -> Path:
    return catalogue.waveforms.folder / (run.waveform_file + SUFFIX)
