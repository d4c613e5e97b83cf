"""Alarms that programs raise when they are asked to."""

from collections.abc import Sequence
from hashlib import sha256
from uuid import uuid4

from rig.runs.records import EndRecord, RunOrder
from store.service.alarms import NewAlarm
from store.states import AlarmKind


def new_test(rig: str, who: str) -> NewAlarm:
    """An alarm with which somebody tries whether alarms arrive."""
    return NewAlarm(AlarmKind.TEST, rig, f"this is a test, asked for by {who}; nothing has happened", f"test {uuid4()}")


def ended_run(order: RunOrder, rig: str, record: EndRecord) -> NewAlarm:
    """The alarm about a run that has ended by itself: the same for all who read this record of its spool."""
    text = f"run {order.run_id} ({order.sequence.title}) on {rig} has {record.state}: {record.reason}"
    cause = f"run {order.run_id}, {order.waveform_file}, ended at {record.at.isoformat()}"
    return NewAlarm(
        AlarmKind.RUN_ENDED, rig, text, cause, order.run_id, record.at, sha256(cause.encode()).hexdigest()[:32]
    )


def refused_record(order: RunOrder, rig: str, spool: str, why: str) -> NewAlarm:
    """The alarm about a spool that is kept because one of its records contradicts the store; one for each spool."""
    text = f"{why}; it and what was measured after it are kept in {spool}"
    return NewAlarm(AlarmKind.RECORD_REFUSED, rig, text, f"refused record of {spool}", order.run_id)


def damaged_audit_log(rig: str, faults: Sequence[str]) -> NewAlarm:
    """The alarm about faults of the audit log; the same faults raise it once."""
    found = "\n".join(faults)
    text = f"the audit log has {len(faults)} faults, the first: {faults[0]}"
    return NewAlarm(AlarmKind.AUDIT_DAMAGED, rig, text, f"audit log {sha256(found.encode()).hexdigest()}")
