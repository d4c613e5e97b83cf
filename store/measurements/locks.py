"""Locks between processes: one process carries out a run.

The file of a lock is beside the waveforms, which every program of one store can write to.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from store.catalogue import Catalogue
from store.database.file_lock import LockHeldError, exclusive_lock
from store.errors import StoreError
from store.measurements.runs import Run, list_run_events

_ENDING = ".lock"


class RunBusyError(StoreError):
    """Another living process carries out the run."""


@contextmanager
def run_lock(catalogue: Catalogue, run: Run) -> Iterator[None]:
    """Be the only process that carries out `run` while the context lasts; read its state inside, not before.

    Raises:
        RunBusyError: another living process does; the message names it.
        StoreError: the folder of waveforms cannot be written.
    """
    try:
        with exclusive_lock(_lock_file(catalogue, run)):
            yield
    except LockHeldError as error:
        with catalogue.reading() as session:
            named = [event.who for event in list_run_events(session, run.id) if event.who]
        holder = named[-1] if named else "another process"
        raise RunBusyError(
            f"run {run.id} is being carried out by {holder}; stop it there, or wait until it ends"
        ) from error


def discard_run_lock(catalogue: Catalogue, run: Run) -> None:
    """Remove the lock file of a run that is finished."""
    _lock_file(catalogue, run).unlink(missing_ok=True)


def _lock_file(catalogue: Catalogue, run: Run) -> Path:
    return catalogue.waveforms.folder / (run.waveform_file + _ENDING)
