"""Warnings before a run: the age and result of the rig's last examination, and what has changed since."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from typing import Any

from daq.channels import Channel
from jointlab.commissioning.examination import identity
from rig.checks.check import Place
from rig.instruments import stored_channel
from store.catalogue import Catalogue
from store.instrument import Instrument
from store.service.commissioning import CommissioningRecord, list_commissioning_records
from store.states import Verdict


class WarningKind(StrEnum):
    """Why the rig should be examined, or a sensor calibrated, before a run."""

    CALIBRATION_OVER = "calibration_over"
    NEVER_EXAMINED = "never_examined"
    EXAMINED_LONG_AGO = "examined_long_ago"
    FAULTS_FOUND = "faults_found"
    INSTRUMENT_CHANGED = "instrument_changed"


@dataclass(frozen=True)
class RigWarning:
    """A warning before a run.

    Attributes:
        kind: which one.
        values: its figures and names, by the names that `wording.WARNINGS` has for them.
    """

    kind: WarningKind
    values: Mapping[str, object] = field(default_factory=dict)


def latest_examination(catalogue: Catalogue, rig: str) -> CommissioningRecord | None:
    """The newest examination of a rig on its bench; None where there is none."""
    found = catalogue.read(list_commissioning_records, rig=rig, place=Place.BENCH, limit=1)
    return found[0] if found else None


def warnings_of(
    record: CommissioningRecord | None, channels: Iterable[Channel], valid_days: float, now: datetime | None = None
) -> list[RigWarning]:
    """Why the rig should be examined before a run; empty where nothing speaks for it.

    Args:
        record: the newest one.
        channels: the channel table of the run.
        valid_days: for which an examination holds.
        now: UTC; None: the present.
    """
    channels, now = tuple(channels), now or datetime.now(UTC)
    found = [
        RigWarning(
            WarningKind.CALIBRATION_OVER,
            {"name": channel.name, "serial": channel.serial, "due_on": channel.due_on},
        )
        for channel in channels
        if channel.due_on is not None and now.date() > channel.due_on
    ]
    if record is None:
        return [*found, RigWarning(WarningKind.NEVER_EXAMINED)]
    age = now - record.created_at
    if age > timedelta(days=valid_days):
        found.append(RigWarning(WarningKind.EXAMINED_LONG_AGO, {"days": age.days, "valid_days": valid_days}))
    if record.verdict is Verdict.FAILED:
        wrong = [(each["subject"], each["id"]) for each in record.checks if each["state"] == "failed"]
        found.append(RigWarning(WarningKind.FAULTS_FOUND, {"examination": record.id, "checks": wrong}))
    return found + changes(record, (stored_channel(channel).instrument for channel in channels))


def changes(record: CommissioningRecord, instruments: Iterable[Instrument]) -> list[RigWarning]:
    """Which of `instruments` the examination was not made with."""
    known: list[dict[str, Any]] = list(record.instruments)
    named = (f"{each.model} {each.serial}".strip() for each in instruments if identity(each) not in known)
    return [RigWarning(WarningKind.INSTRUMENT_CHANGED, {"instrument": name}) for name in named]
