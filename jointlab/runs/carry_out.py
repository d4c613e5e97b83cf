"""Runs of this process: carried out on the instruments, stored in the catalogue.

A run that was stopped, failed or lost its process can be resumed with the rest of its sequence: every completed
measurement is in the store, and the store tells the rest.
"""

from collections.abc import Callable
from dataclasses import dataclass

from jointlab.runs.orders import order_to_begin, order_to_resume, plan_run
from jointlab.runs.rows import add_record
from rig.control import RunControl
from rig.events import Observer, ignore_event
from rig.instruments import Instruments
from rig.operator import Operator
from rig.records import BeginRecord, EndRecord, Record, RunOrder
from rig.run import carry_out
from rig.sequence import Sequence
from store.catalogue import Catalogue
from store.deferred_run_end import defer_run_end, store_deferred_end
from store.errors import StoreError
from store.locks import discard_run_lock, run_lock
from store.runs import Run, discard_run, get_run
from store.states import RunState
from store.waveform import Waveform

CarryOut = Callable[[Instruments, Catalogue, Operator, Observer, RunControl], object]
"""`run_sequence` or `resume_run`, when it is known which run to carry out."""


def run_sequence(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
    *,
    planned: int | None = None,
    reset: bool = False,
    who: str | None = None,
) -> int:
    """Run every step of `sequence`; returns the number of the run that holds the measurements.

    Where a step exceeds a limit or an instrument is absent, nothing is stored. A run that fails or is stopped keeps
    what was measured and the reason, and can be resumed.

    Args:
        sequence: the steps.
        instruments: of the rig.
        catalogue: stores the run.
        operator: strikes and mounts.
        observer: gets events.
        control: may pause and stop the run.
        planned: number of the run that `plan_run` stored for this sequence; None for a new one.
        reset: whether to reset the tester first, because the cause of its trip is removed; the audit log has it even if
            the run does not begin, the history of the run if it does.
        who: for the history of the run; by default the user of this process.

    Raises:
        RunStoppedError: `control` asked for it.
        RigError, DaqError: a step is impossible, or an instrument is absent, refuses or fails.
        StoreError: the measurement cannot be stored.
    """
    if planned is None:
        run = plan_run(sequence, instruments.limits, catalogue, who, provisional=True)
    else:
        with catalogue.reading() as session:
            run = get_run(session, planned)
    order = order_to_begin(run, reset=reset, who=who, planned=planned is not None)
    with run_lock(catalogue, run):
        _carry_out(order, run, instruments, catalogue, operator, observer, control)
    return run.id


def resume_run(
    run_id: int,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
    *,
    reset: bool = False,
    who: str | None = None,
) -> None:
    """Continue a run that was stopped, failed or lost its process, at the first point that is not measured.

    Blow and order numbers continue, and so does the time. The history of the run gets an entry.

    Args:
        run_id: number of the run.
        instruments: the same that the run began with.
        catalogue, operator, observer, control, reset, who: as for `run_sequence`; specimens are mounted again.

    Raises:
        RunBusyError: another living process carries out the run.
        ResumeError: the run is finished or was not measured here, or other instruments are connected; nothing moved.
        RunStoppedError: `control` asked for it.
        RigError, DaqError: an instrument is absent, refuses or fails.
        StoreError: there is no such run, or the measurement cannot be stored.
    """
    with catalogue.reading() as session:
        run = get_run(session, run_id)
    with run_lock(catalogue, run):
        store_deferred_end(catalogue, run)
        order = order_to_resume(catalogue, run_id, instruments.limits, reset=reset, who=who)
        _carry_out(order, run, instruments, catalogue, operator, observer, control)


def _carry_out(
    order: RunOrder,
    run: Run,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer,
    control: RunControl | None,
) -> None:
    records = CatalogueRecords(catalogue, run, order)
    try:
        carry_out(order, instruments, operator, records, observer, control)
    finally:
        records.close()


@dataclass
class CatalogueRecords:
    """Writes the records of a run to the catalogue."""

    catalogue: Catalogue
    run: Run
    order: RunOrder
    begun: bool = False

    def write(self, record: Record, waveform: Waveform | None = None) -> None:
        """See `RunRecords`; an end that the database does not take is kept beside the waveforms."""
        file = self.run.waveform_file
        reference = None if waveform is None else self.catalogue.waveforms.append(file, waveform)
        try:
            with self.catalogue.writing() as session:
                add_record(session, self.order, record, reference)
        except StoreError as error:
            if isinstance(record, EndRecord):
                try:
                    defer_run_end(self.catalogue, self.run, record.state, record.reason, record.who)
                except StoreError as other:
                    raise StoreError(f"{error}; nor kept: {other}") from error
            raise
        self.begun = self.begun or isinstance(record, BeginRecord)
        if isinstance(record, EndRecord) and record.state is RunState.FINISHED:
            discard_run_lock(self.catalogue, self.run)

    def close(self) -> None:
        """Close the waveform file, and remove a run that was made for this order and did not begin."""
        self.catalogue.waveforms.finish(self.run.waveform_file)
        if not (self.begun or self.order.planned):
            with self.catalogue.writing() as session:
                discard_run(session, self.run.id)
            discard_run_lock(self.catalogue, self.run)
