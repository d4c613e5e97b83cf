"""One process at a time carries out a run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from store.catalogue import Catalogue
from store.errors import StoreError
from store.process_lock import HeldElsewhereError, held_alone
from store.runs import Run, list_run_events

SUFFIX = ".lock"


class RunBusyError(StoreError):
    """A living process carries out the run."""


@contextmanager
def holding(catalogue: Catalogue, run: Run) -> Iterator[None]:
    """Be the one process that carries out `run` while the context lasts; look at its state inside, not before.

    Raises:
        RunBusyError: another living process is; it is named.
        StoreError: the folder of waveforms cannot be written.
    """
    try:
        with held_alone(catalogue.waveforms.folder / (run.waveform_file + SUFFIX)):
            yield
    except HeldElsewhereError as error:
        raise RunBusyError(
            f"run {run.id} is being carried out by {_holder(catalogue, run)}; stop it there, or wait until it ends"
        ) from error


def discard_lock(catalogue: Catalogue, run: Run) -> None:
    """Remove the file of a run that is finished, which nobody needs to lock any more."""
    (catalogue.waveforms.folder / (run.waveform_file + SUFFIX)).unlink(missing_ok=True)


def _holder(catalogue: Catalogue, run: Run) -> str:
    with catalogue.reading() as session:
        named = [event.who for event in list_run_events(session, run.id) if event.who]
    return named[-1] if named else "another process"
