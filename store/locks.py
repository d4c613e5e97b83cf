"""Locks between processes: one process drives a rig, one carries out a run.

The file of a lock is beside the waveforms, which every program of one store can write to.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from store.catalogue import Catalogue
from store.errors import StoreError
from store.file_lock import LockHeldError, exclusive_lock
from store.provenance import who_is_here
from store.runs import Run, list_run_events

_ENDING = ".lock"


class RigBusyError(StoreError):
    """Another living process drives the rig."""


class RunBusyError(StoreError):
    """Another living process carries out the run."""


@contextmanager
def rig_lock(catalogue: Catalogue, rig: str) -> Iterator[None]:
    """Be the only process of this store that drives `rig` while the context lasts.

    Raises:
        RigBusyError: another living process does; the message names it.
        StoreError: the folder beside the waveforms cannot be written.
    """
    folder = catalogue.waveforms.folder
    path = folder.with_name(f"{folder.name}-{rig}{_ENDING}")
    holder = path.with_suffix(".holder")
    try:
        with exclusive_lock(path):
            try:
                holder.write_text(who_is_here(), encoding="utf-8")
            except OSError as error:
                raise StoreError(f"{holder} cannot be written: {error.strerror or error}") from error
            yield
    except LockHeldError as error:
        named = holder.read_text(encoding="utf-8") if holder.is_file() else "another process"
        raise RigBusyError(
            f"{rig!r} is driven by {named}; work there, or end it first (a second rig on this store needs a name of "
            "its own: rig in the configuration)"
        ) from error


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
