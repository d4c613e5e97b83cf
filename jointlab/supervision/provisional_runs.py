"""Runs that are stored to be begun at once, and removed where they did not begin."""

from collections.abc import Callable

from sqlalchemy.orm import Session

from jointlab.drive.phase import Phase
from jointlab.drive.protocol import Snapshot
from store.catalogue import Catalogue
from store.errors import StoreError
from store.measurements.runs import discard_run, list_provisional_runs


def discard_failed(catalogue: Catalogue, rig: str, run_id: int, because: Exception) -> None:
    """Remove a run that did not begin `because` of an error, which stays the error to be raised."""
    try:
        with catalogue.writing() as session:
            _discard(session, rig, {run_id})
    except StoreError as error:
        because.add_note(f"run {run_id} was stored, did not begin and cannot be removed now: {error}")


def discard_abandoned(
    catalogue: Catalogue, rig: str, settled: Callable[[], bool], snapshot: Callable[[], Snapshot]
) -> None:
    """Remove the runs whose program was killed before they began.

    They are read first: where nobody drives after that, nobody is about to begin one of them.

    Args:
        settled: whether all that was measured is stored.
        snapshot: asks the drive process.

    Raises:
        StoreError: the store does not answer.
        NoDriveError: the drive process does not answer.
    """
    with catalogue.reading() as session:
        found = {run.id for run in list_provisional_runs(session, rig)}
    if not found or not settled():
        return
    now = snapshot()
    if now.holder is None and now.state.phase is Phase.IDLE:
        with catalogue.writing() as session:
            _discard(session, rig, found)


def _discard(session: Session, rig: str, unwanted: set[int]) -> None:
    for run in list_provisional_runs(session, rig):
        if run.id in unwanted:
            discard_run(session, run.id)
