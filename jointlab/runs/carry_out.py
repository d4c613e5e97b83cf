"""Runs of this process: carried out on the instruments, stored in the catalogue."""

from pathlib import Path

from jointlab.runs.ingest import Ingester, discard_if_not_begun
from jointlab.runs.orders import order_to_begin, plan_run
from rig.control import RunControl
from rig.events import Event, Observer, RunContinued, RunStarted, ignore_event
from rig.instruments import Instruments
from rig.operator import Operator
from rig.runs.records import RunOrder
from rig.runs.run import carry_out
from rig.runs.spool import spooling
from rig.sequences.sequence import Sequence
from store.catalogue import Catalogue
from store.errors import StoreError
from store.measurements.locks import discard_run_lock, run_lock
from store.measurements.runs import Run

PATIENCE = 10.0  # s that the end of a run waits for the database
BEGUN = 5.0  # s that the beginning of a run waits for it


def spool_folder(catalogue: Catalogue) -> Path:
    """Where runs of this process are written before they are stored: beside the waveforms."""
    folder = catalogue.waveforms.folder
    return folder.with_name(f"{folder.name}-spools")


def store_spools(catalogue: Catalogue) -> None:
    """Store what earlier processes have left to be stored. StoreError where that cannot be done now."""
    with Ingester(catalogue, spool_folder(catalogue)) as ingester:
        if not ingester.settle(PATIENCE):
            raise StoreError(f"the records in {ingester.folder} cannot be stored now: {ingester.problem}")


def run_sequence(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
    *,
    reset: bool = False,
    who: str | None = None,
) -> int:
    """Run every step of `sequence`; returns the number of the run that holds the measurements.

    Where a step exceeds a limit or an instrument is absent, nothing is stored. A run that fails or is stopped keeps
    what was measured and the reason, and can be resumed.

    Args:
        control: may pause and stop the run.
        reset: whether to reset the tester first, because the cause of its trip is removed; the audit log has it even if
            the run does not begin, the history of the run if it does.
        who: for the history of the run; by default the user of this process.

    Raises:
        RunStoppedError: `control` asked for it.
        RigError, DaqError: a step is impossible, or an instrument is absent, refuses or fails.
        StoreError: the measurement cannot be stored.
    """
    run = plan_run(sequence, instruments.limits, catalogue, who, rig=instruments.rig, provisional=True)
    order = order_to_begin(run, rig=instruments.rig, reset=reset, who=who, planned=False)
    with run_lock(catalogue, run):
        carry_out_order(order, run, instruments, catalogue, operator, observer, control)
    return run.id


def carry_out_order(
    order: RunOrder,
    run: Run,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
) -> None:
    """Carry out `order` into a spool that is stored meanwhile; returns when everything is stored.

    The caller holds the lock of `run`. Raises what `run_sequence` raises.
    """
    folder = spool_folder(catalogue)

    def observe(event: Event) -> None:
        if isinstance(event, RunStarted | RunContinued):
            ingester.settle(BEGUN)  # observers find the run running, unless the database is away
        observer(event)

    with Ingester(catalogue, folder) as ingester:
        try:
            with spooling(folder, order) as spool:
                carry_out(order, instruments, operator, spool, observe, control)
        except BaseException as error:
            if ingester.settle(PATIENCE):
                discard_if_not_begun(catalogue, order)  # where there was no room for a spool
            else:
                error.add_note(_not_stored(order, ingester))
            raise
        finally:
            discard_run_lock(catalogue, run)
        if not ingester.settle(PATIENCE):
            raise StoreError(_not_stored(order, ingester))


def _not_stored(order: RunOrder, ingester: Ingester) -> str:
    return (
        f"run {order.run_id} cannot be stored now: {ingester.problem}; its records are kept in {ingester.folder}, and "
        "stored by the next program that runs or resumes something there"
    )
