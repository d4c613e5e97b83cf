"""How runs ended whose database did not answer: kept in a file beside their waveforms, and stored once it does."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from store.catalogue import Catalogue
from store.errors import StoreError
from store.run_lock import RunBusyError, holding
from store.runs import Run, finish_run, get_run, list_runs
from store.states import RunState

SUFFIX = ".ended"


@dataclass(frozen=True)
class _KeptEnd:
    state: str
    reason: str | None
    who: str
    at: str  # UTC, ISO 8601


def defer_run_end(catalogue: Catalogue, run: Run, state: RunState, reason: str | None, who: str) -> None:
    """Keep how `run` has ended just now, where the database does not take it.

    Raises:
        StoreError: the folder of waveforms cannot be written either.
    """
    path = _path(catalogue, run)
    unfinished = path.with_name(path.name + ".part")
    end = _KeptEnd(state.value, reason, who, datetime.now(UTC).isoformat())
    try:
        unfinished.write_text(json.dumps(asdict(end)), encoding="utf-8")
        unfinished.replace(path)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def store_kept_end(catalogue: Catalogue, run: Run) -> None:
    """Store how `run` ended, if that was kept; for whoever holds it alone.

    Raises:
        StoreError: the database does not answer yet; the end stays kept.
    """
    path = _path(catalogue, run)
    if not path.is_file():
        return
    end = _KeptEnd(**json.loads(path.read_text(encoding="utf-8")))
    with catalogue.writing() as session:
        now = get_run(session, run.id)
        if now.state is RunState.RUNNING:  # else it was stored, and the file not yet removed
            at = datetime.fromisoformat(end.at)
            # a clock that was set back during the run is for `finish_run` to tell
            finish_run(session, run.id, RunState(end.state), end.reason, at if at >= now.started_at else None, end.who)
    path.unlink()


def store_kept_ends(catalogue: Catalogue) -> None:
    """Store how runs ended that nobody goes on with.

    Raises:
        StoreError: the database does not answer yet; the ends stay kept.
    """
    with catalogue.reading() as session:
        cut_off = list_runs(session, state=RunState.RUNNING)
    for run in cut_off:
        if _path(catalogue, run).is_file():
            try:
                with holding(catalogue, run):
                    store_kept_end(catalogue, run)
            except RunBusyError:
                continue  # whoever resumes it stores its end first


def _path(catalogue: Catalogue, run: Run) -> Path:
    return catalogue.waveforms.folder / (run.waveform_file + SUFFIX)
