"""The hammer session: blow after blow at each point until enough of them count."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from analysis.dof import Direction, Dof
from analysis.modal.blow_check import BlowLimits, BlowReason, BlowVerdict, check_blow
from daq.block import Block
from daq.channels import Channel, ChannelKind
from daq.device import Chassis
from daq.errors import TriggerTimeoutError
from daq.task import EdgeTrigger, TriggeredTask
from rig.control import RunControl
from rig.errors import RequestError, RigError
from rig.events import (
    BlowAccepted,
    BlowMissed,
    BlowRefused,
    BlowSuspected,
    Observer,
    PointFinished,
    PointStarted,
    RateCoerced,
    ignore_event,
)
from rig.operator import Operator
from rig.point_blows import PointBlows

PAPER_POINTS = (
    *(Dof(node, Direction.Y) for node in (1, 3, 4, 5, 6, 7, 8, 9, 11)),
    *(Dof(node, Direction.X) for node in (1, 11)),
)
BLOW_LIMITS = BlowLimits(lowest_peak_force=30.0, highest_frequency=1024.0)


class HammerError(RequestError):
    """The hammer session cannot begin as it was asked for."""


class PointGivenUpError(RigError):
    """Too many blows in a row did not count at one point; what was accepted before is kept."""


class BlowSink(Protocol):
    """Where blows go, accepted or refused."""

    def add_blow(self, point: Dof, number: int, block: Block, verdict: BlowVerdict) -> None:
        """Take blow `number` (from 1, refused ones counted) at `point`, as it was recorded and judged."""

    def withdrawn(self, point: Dof) -> int:  # noqa: ARG002 - a sink that nobody takes blows back from has none
        """How many accepted blows at `point` somebody has taken back since the session began."""
        return 0


@dataclass(frozen=True)
class PointProgress:
    """What a point has already, from a session that was interrupted.

    Attributes:
        accepted: blows that count.
        refused: blows that do not.
        last_blow: number of the last one; the next gets the number after it.
        together: the blows side by side, among which the next ones are judged; None where there are no records.
        taken_back: accepted blows that somebody took back since the session began; the ones before it are not there.
    """

    accepted: int = 0
    refused: int = 0
    last_blow: int = 0
    together: PointBlows | None = None
    taken_back: int = 0


@dataclass(frozen=True)
class HammerSettings:
    """How a session is run.

    Attributes:
        points: where to strike, in this order; the paper's by default (Section 3).
        blows: accepted blows a point.
        block_duration: s, pre-trigger included.
        sample_rate: Hz.
        pre_trigger: s.
        trigger_level: N.
        limits: what a blow has to keep to count.
        blow_timeout: s that the operator has to strike once the trigger is armed.
        refusals_in_a_row: so many refused or missing blows one after the other give a point up.
        hammer: name of the channel that triggers.
    """

    points: tuple[Dof, ...] = PAPER_POINTS
    blows: int = 10
    block_duration: float = 2.0
    sample_rate: float = 5120.0
    pre_trigger: float = 0.05
    trigger_level: float = 5.0
    limits: BlowLimits = BLOW_LIMITS
    blow_timeout: float = 60.0
    refusals_in_a_row: int = 10
    hammer: str = "hammer"

    def __post_init__(self) -> None:
        if not self.points or len(set(self.points)) < len(self.points):
            raise HammerError("hammer session: name at least one point, and each only once")
        if self.blows < 1 or self.refusals_in_a_row < 1:
            raise HammerError("hammer session: blows a point and refusals in a row must be at least 1")
        if not 0 < self.pre_trigger < self.block_duration:
            raise HammerError(
                f"hammer session: a pre-trigger of {self.pre_trigger:g} s does not fit a block of "
                f"{self.block_duration:g} s"
            )


def run_hammer_session(
    chassis: Chassis,
    channels: Sequence[Channel],
    settings: HammerSettings,
    operator: Operator,
    sink: BlowSink,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
    so_far: Mapping[Dof, PointProgress] | None = None,
) -> None:
    """Strike every point of the settings until each has its accepted blows.

    Args:
        chassis: the instrument.
        channels: the hammer, and the accelerometers.
        settings: what to do.
        operator: who strikes.
        sink: where every blow goes, accepted or refused, before the next is armed.
        observer: who is told.
        control: who may pause, resume and stop the session; None for nobody.
        so_far: what points have already, of which only the rest is struck; None for nothing.

    Raises:
        RunStoppedError: `control` asked for it; every blow before is in the sink.
        HammerError: the channel table lacks the hammer or an accelerometer.
        PointGivenUpError: too many blows in a row did not count.
        DaqError: the instrument fails.
    """
    accelerometers = _accelerometers(channels, settings.hammer)
    chassis.verify(channels)
    trigger = EdgeTrigger(settings.hammer, settings.trigger_level, settings.pre_trigger)
    with chassis.triggered(channels, settings.sample_rate, settings.block_duration, trigger) as task:
        if task.rate_note is not None:
            observer(RateCoerced(task.requested_rate, task.sample_rate))
        session = _Session(task, accelerometers, settings, operator, sink, observer, control or RunControl())
        points = {point: (so_far or {}).get(point, PointProgress()) for point in settings.points}
        while lacking := [point for point, already in points.items() if session.lacks(point, already.accepted)]:
            for point in lacking:  # again where a blow was taken back after its point was left
                observer(PointStarted(point, settings.points.index(point) + 1, len(settings.points)))
                session.control.carry_out(partial(operator.go_to, point), observer)
                points[point] = session.measure(point, points[point])


def _accelerometers(channels: Sequence[Channel], hammer: str) -> tuple[str, ...]:
    """Names of the accelerometers in the table."""
    named = ", ".join(f"{channel.name} ({channel.kind})" for channel in channels)
    if not any(channel.name == hammer for channel in channels):
        raise HammerError(f"hammer session: no channel {hammer!r} among {named}")
    accelerometers = tuple(c.name for c in channels if c.kind is ChannelKind.ACCELERATION_IEPE)
    if not accelerometers:
        raise HammerError(f"hammer session: no accelerometer among {named}")
    return accelerometers


@dataclass(frozen=True)
class _Session:
    task: TriggeredTask
    accelerometers: tuple[str, ...]
    settings: HammerSettings
    operator: Operator
    sink: BlowSink
    observer: Observer
    control: RunControl

    def lacks(self, point: Dof, accepted: int) -> bool:
        """Whether a point with so many accepted blows, taken back or not, needs more."""
        return accepted - self.sink.withdrawn(point) < self.settings.blows

    def measure(self, point: Dof, already: PointProgress) -> PointProgress:
        """Take blows at `point` until enough count; what it has then, those taken back included.

        Raises:
            PointGivenUpError: too many in a row did not.
        """
        accepted, refused, blow = already.accepted, already.refused, already.last_blow
        together, taken_back = already.together or self._together(), already.taken_back
        others = accepted - together.accepted
        in_a_row = 0
        while self.lacks(point, accepted):
            if (now := self.sink.withdrawn(point)) != taken_back:  # what was taken back is no measure of what comes
                together, taken_back = self._together(), now
                accepted = others = max(accepted, taken_back)  # a suspect that is taken back did not count before
            blow += 1
            reason = self._refusal(point, blow, accepted - taken_back, together)
            accepted = others + together.accepted
            if reason is None:
                in_a_row = 0
                continue
            refused, in_a_row = refused + 1, in_a_row + 1
            if in_a_row == self.settings.refusals_in_a_row:
                raise PointGivenUpError(
                    f"point {point}: given up after {in_a_row} blows in a row that did not count, with "
                    f"{accepted - taken_back} of "
                    f"{self.settings.blows} accepted; the last: {reason}"
                )
        self.observer(PointFinished(point, accepted, refused))
        return PointProgress(accepted, refused, blow, together, taken_back)

    def _together(self) -> PointBlows:
        return PointBlows(self.settings.limits.highest_frequency or self.task.sample_rate / 2)

    def _refusal(self, point: Dof, blow: int, accepted: int, together: PointBlows) -> str | None:
        """Take one blow; the reason why it does not count, None where it does."""
        try:
            block = self.control.carry_out(lambda: self._take(point, blow), self.observer)
        except TriggerTimeoutError:
            self.observer(BlowMissed(point, blow, self.settings.blow_timeout))
            return f"nobody struck within {self.settings.blow_timeout:g} s"
        verdict = self._judge(block)
        suspects: dict[int, BlowReason] = {}
        if verdict.accepted:
            force, acceleration = block.value(self.settings.hammer), block.value(self.accelerometers[0])
            suspects = together.add(blow, force, acceleration, block.sample_rate)
            verdict = replace(verdict, reasons=tuple(suspects[number] for number in suspects if number == blow))
        self.sink.add_blow(point, blow, block, verdict)
        for number, suspicion in suspects.items():
            if number != blow:
                self.observer(BlowSuspected(point, number, str(suspicion)))
        if verdict.accepted:
            self.observer(BlowAccepted(point, blow, accepted + 1, self.settings.blows, verdict.peak_force))
            return None
        reason = "; ".join(str(r) for r in verdict.reasons)
        self.observer(BlowRefused(point, blow, reason, verdict.peak_force, tuple(map(str, verdict.faults))))
        return reason

    def _take(self, point: Dof, blow: int) -> Block:
        self.task.arm()
        self.operator.strike(point, blow)
        return self.task.wait(self.settings.blow_timeout, self.control.is_interrupted)

    def _judge(self, block: Block) -> BlowVerdict:
        assert block.trigger_index is not None, "blocks of a triggered task have one"
        return check_blow(
            block.value(self.settings.hammer),
            np.stack([block.value(name) for name in self.accelerometers]),
            block.sample_rate,
            block.trigger_index,
            self.settings.limits,
            overloaded=bool(block.overloaded),
        )
