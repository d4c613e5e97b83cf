"""The records of a run as rows of the catalogue."""

from sqlalchemy.orm import Session

from jointlab.alarms.new import ended_run
from rig.runs.records import BeginRecord, BlowRecord, EndRecord, Record, ResetRecord, RunOrder, SinePointRecord
from store.dof import StoredDof
from store.measurements.blows import Point, add_blow, add_point, list_points
from store.measurements.runs import begin_run, finish_run, get_run, reopen_run
from store.measurements.sine_records import SineRecord, add_sine_record
from store.service.alarms import add_alarm
from store.service.audit import add_audit_entry
from store.waveforms.waveform import WaveformReference


def add_record(session: Session, order: RunOrder, record: Record, waveform: WaveformReference | None = None) -> None:
    """Store a record of the run of `order`, with the reference to its waveform. Raises StoreError."""
    match record:
        case ResetRecord():
            add_audit_entry(
                session,
                who=record.who,
                action="acknowledge interlock",
                target=f"run {order.run_id}" if order.planned else "new run",
                outcome=record.outcome,
                details={"interlocks": list(record.interlocks)},
            )
        case BeginRecord():
            _begin(session, order, record)
        case BlowRecord():
            add_blow(
                session,
                _point(session, order.run_id, StoredDof.parse(record.point), record.set_number),
                record.number,
                accepted=record.accepted,
                reason=record.reason,
                waveform=waveform,
                peak_force=record.peak_force,
                temperature_c=record.temperature_c,
                struck_at=record.struck_at,
            )
        case SinePointRecord():
            add_sine_record(session, order.run_id, _sine_record(record, waveform))
        case EndRecord():
            _end(session, order, record)


def _begin(session: Session, order: RunOrder, record: BeginRecord) -> None:
    if order.begun_with is not None:
        assert record.reason is not None, "a run that goes on has a reason"
        reopen_run(session, order.run_id, record.reason, record.who, record.at)
        return
    begin_run(
        session,
        order.run_id,
        sequence=order.sequence.model_dump(mode="json"),
        channels=record.channels,
        instruments=record.instruments,
        started_at=record.at,
        who=record.who,
        reason=record.reason,
    )


def _point(session: Session, run_id: int, dof: StoredDof, set_number: int) -> Point:
    known = [each for each in list_points(session, run_id) if (each.dof, each.set_number) == (dof, set_number)]
    return known[0] if known else add_point(session, run_id, dof, set_number)


def _sine_record(record: SinePointRecord, waveform: WaveformReference | None) -> SineRecord:
    values = {name: value for name, value in vars(record).items() if name != "kind"}
    return SineRecord(**values, waveform=waveform)


def _end(session: Session, order: RunOrder, record: EndRecord) -> None:
    """Store the end of a run; where it has ended by itself, the alarm is in the same transaction."""
    started_at = get_run(session, order.run_id).started_at
    # without a time `finish_run` reports a clock that was set back during the run
    at = record.at if record.at >= started_at else None
    run = finish_run(session, order.run_id, record.state, record.reason, at, record.who)
    if record.by_itself:
        add_alarm(session, ended_run(order, run.rig or "", record))
