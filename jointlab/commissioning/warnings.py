"""Warnings before a run: the age and result of the rig's last examination, and what has changed since."""

from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import Any

from daq.channels import Channel
from jointlab.commissioning.examination import identity
from jointlab.commissioning.wording import TITLES
from rig.checks.check import Place
from rig.instruments import stored_channel
from store.catalogue import Catalogue
from store.instrument import Instrument
from store.service.commissioning import CommissioningRecord, list_commissioning_records
from store.states import Verdict

DOCTOR = "jointlab doctor examines it"


def latest_examination(catalogue: Catalogue, rig: str) -> CommissioningRecord | None:
    """The newest examination of a rig on its bench; None where there is none."""
    found = catalogue.read(list_commissioning_records, rig=rig, place=Place.BENCH, limit=1)
    return found[0] if found else None


def warnings_of(
    record: CommissioningRecord | None, channels: Iterable[Channel], valid_days: float, now: datetime | None = None
) -> list[str]:
    """Why the rig should be examined before a run; empty where nothing speaks for it.

    Args:
        record: the newest one.
        channels: the channel table of the run.
        valid_days: for which an examination holds.
        now: UTC; None: the present.
    """
    channels, now = tuple(channels), now or datetime.now(UTC)
    said = [
        f"the calibration of {channel.name} {channel.serial} was valid until {channel.due_on}; have it calibrated"
        for channel in channels
        if channel.due_on is not None and now.date() > channel.due_on
    ]
    if record is None:
        return [*said, f"this rig was never examined; {DOCTOR}"]
    age = now - record.created_at
    if age > timedelta(days=valid_days):
        said.append(f"the rig was examined {age.days} days ago, which holds for {valid_days:g} days; {DOCTOR}")
    if record.verdict is Verdict.FAILED:
        wrong = ", ".join(
            f"{each['subject']}, {TITLES[each['id']]}" for each in record.checks if each["state"] == "failed"
        )
        said.append(f"examination {record.id} found faults: {wrong}; correct them, then examine the rig again")
    return said + changes(record, (stored_channel(channel).instrument for channel in channels))


def changes(record: CommissioningRecord, instruments: Iterable[Instrument]) -> list[str]:
    """Which of `instruments` the examination was not made with, in words."""
    known: list[dict[str, Any]] = list(record.instruments)
    named = (f"{each.model} {each.serial}".strip() for each in instruments if identity(each) not in known)
    return [f"the rig was not examined with {name} as it is now; {DOCTOR}" for name in named]
