"""The hammer session: blow after blow at each point until enough of them count."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from analysis.dof import Dof
from analysis.modal.blow_check import BlowLimits, BlowReason, BlowVerdict, check_blow
from daq.block import Block
from daq.channels import ACCELEROMETERS, Channel
from daq.errors import TriggerTimeoutError
from daq.instrument import DaqInstrument, EdgeTrigger, Triggered
from rig.control import RunControl
from rig.errors import RequestError, RigError
from rig.events import (
    BlowAccepted,
    BlowInconsistent,
    BlowMissed,
    BlowRefused,
    Observer,
    PointFinished,
    PointStarted,
    RateCoerced,
    ignore_event,
)
from rig.hammer.blow_comparison import PointBlows
from rig.operator import Operator
from rig.sequences.sequence import HammerStep

BLOW_TIMEOUT = 60.0  # s within which the operator has to strike after the trigger is armed
REFUSALS_IN_A_ROW = 10  # refused or missing blows one after the other, after which a point is given up


class HammerError(RequestError):
    """The hammer session cannot begin as it was asked for."""


class PointGivenUpError(RigError):
    """Too many blows in a row did not count at one point; what was accepted before is kept."""


class BlowSink(Protocol):
    """Destination of blows, accepted or refused."""

    def add_blow(self, point: Dof, number: int, block: Block, verdict: BlowVerdict) -> None:
        """Take blow `number` (from 1, refused ones counted) at `point`, as it was recorded and judged."""

    def withdrawn(self, point: Dof) -> int:  # noqa: ARG002 - by default none is withdrawn
        """Number of accepted blows at `point` that were withdrawn since the session began."""
        return 0


@dataclass(frozen=True)
class PointProgress:
    """The blows that a point has already, for example from an interrupted session.

    Attributes:
        accepted: number of accepted blows.
        refused: number of refused blows.
        last_blow: number of the last one; the next gets the number after it.
        compared: the blows among which the next ones are judged; None where there are no records.
        withdrawn: accepted blows that were withdrawn since the session began; earlier ones are not counted at all.
    """

    accepted: int = 0
    refused: int = 0
    last_blow: int = 0
    compared: PointBlows | None = None
    withdrawn: int = 0


def run_hammer_session(
    chassis: DaqInstrument,
    channels: Sequence[Channel],
    step: HammerStep,
    operator: Operator,
    sink: BlowSink,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
    progress: Mapping[Dof, PointProgress] | None = None,
    *,
    blow_timeout: float = BLOW_TIMEOUT,
    refusals_in_a_row: int = REFUSALS_IN_A_ROW,
) -> None:
    """Take blows at every point of `step` until each has its accepted blows.

    Args:
        chassis: the instrument.
        channels: the hammer, and the accelerometers.
        step: what to measure.
        sink: gets every blow, accepted or refused, before the next is armed.
        control: may pause, resume and stop the session; None: nothing may.
        progress: what points have already; only the rest is measured.
        blow_timeout: see BLOW_TIMEOUT.
        refusals_in_a_row: see REFUSALS_IN_A_ROW.

    Raises:
        RunStoppedError: `control` asked for it; every blow before is in the sink.
        HammerError: the channel table lacks the hammer or an accelerometer.
        PointGivenUpError: too many blows in a row did not count.
        DaqError: the instrument fails.
    """
    accelerometers = _accelerometers(channels, step.hammer)
    chassis.verify(channels)
    trigger = EdgeTrigger(step.hammer, step.trigger_level, step.pretrigger_seconds)
    points = [Dof.parse(point) for point in step.points]
    with chassis.triggered(channels, step.sample_rate, step.block_seconds, trigger) as task:
        if task.rate_note is not None:
            observer(RateCoerced(task.requested_rate, task.sample_rate))
        session = _Session(
            task,
            accelerometers,
            step,
            operator,
            sink,
            observer,
            control or RunControl(),
            blow_timeout,
            refusals_in_a_row,
        )
        done = {point: (progress or {}).get(point, PointProgress()) for point in points}
        while lacking := [point for point in points if session.lacks(point, done[point].accepted)]:
            for point in lacking:  # again where a blow was withdrawn after the operator had left its point
                observer(PointStarted(point, points.index(point) + 1, len(points)))
                session.control.carry_out(partial(operator.go_to, point), observer)
                done[point] = session.measure(point, done[point])
        operator.end_striking()


def _accelerometers(channels: Sequence[Channel], hammer: str) -> tuple[str, ...]:
    """Names of the accelerometers in the table."""
    named = ", ".join(f"{channel.name} ({channel.kind})" for channel in channels)
    if not any(channel.name == hammer for channel in channels):
        raise HammerError(f"hammer session: no channel {hammer!r} among {named}")
    accelerometers = tuple(c.name for c in channels if c.kind in ACCELEROMETERS)
    if not accelerometers:
        raise HammerError(f"hammer session: no accelerometer among {named}")
    return accelerometers


@dataclass(frozen=True)
class _Session:
    """A hammer session whose task is open; arguments as those of `run_hammer_session`."""

    task: Triggered
    accelerometers: tuple[str, ...]
    step: HammerStep
    operator: Operator
    sink: BlowSink
    observer: Observer
    control: RunControl
    blow_timeout: float
    refusals_in_a_row: int

    def lacks(self, point: Dof, accepted: int) -> bool:
        """Whether a point with `accepted` blows, withdrawn ones included, needs more."""
        return accepted - self.sink.withdrawn(point) < self.step.blows

    def measure(self, point: Dof, before: PointProgress) -> PointProgress:
        """Take blows at `point` until it has enough accepted ones; its progress then, withdrawn blows included.

        Raises PointGivenUpError where too many in a row were refused.
        """
        accepted, refused, blow = before.accepted, before.refused, before.last_blow
        compared, withdrawn = before.compared or self._no_blows(), before.withdrawn
        others = accepted - compared.accepted
        in_a_row = 0
        while self.lacks(point, accepted):
            if (now := self.sink.withdrawn(point)) != withdrawn:  # withdrawn blows say nothing about the next ones
                compared, withdrawn = self._no_blows(), now
                accepted = others = max(accepted, withdrawn)  # one that was inconsistent did not count before
            blow += 1
            reason = self._refusal(point, blow, accepted - withdrawn, compared)
            accepted = others + compared.accepted
            if reason is None:
                in_a_row = 0
                continue
            refused, in_a_row = refused + 1, in_a_row + 1
            if in_a_row == self.refusals_in_a_row:
                raise PointGivenUpError(
                    f"point {point}: given up after {in_a_row} blows in a row that did not count, with "
                    f"{accepted - withdrawn} of "
                    f"{self.step.blows} accepted; the last: {reason}"
                )
        self.observer(PointFinished(point, accepted, refused))
        return PointProgress(accepted, refused, blow, compared, withdrawn)

    def _no_blows(self) -> PointBlows:
        return PointBlows(self.step.highest_frequency)

    def _refusal(self, point: Dof, blow: int, accepted: int, compared: PointBlows) -> str | None:
        """Take one blow; the reason why it is refused, or None."""
        try:
            block = self.control.carry_out(lambda: self._take(point, blow), self.observer)
        except TriggerTimeoutError:
            self.observer(BlowMissed(point, blow, self.blow_timeout))
            return f"nobody struck within {self.blow_timeout:g} s"
        verdict = self._judge(block)
        inconsistent: dict[int, BlowReason] = {}
        if verdict.accepted:
            force, acceleration = block.value(self.step.hammer), block.value(self.accelerometers[0])
            inconsistent = compared.add(blow, force, acceleration, block.sample_rate)
            verdict = replace(verdict, reasons=tuple(inconsistent[number] for number in inconsistent if number == blow))
        self.sink.add_blow(point, blow, block, verdict)
        for number, why in inconsistent.items():
            if number != blow:
                self.observer(BlowInconsistent(point, number, str(why)))
        if verdict.accepted:
            self.observer(BlowAccepted(point, blow, accepted + 1, self.step.blows, verdict.peak_force))
            return None
        reason = "; ".join(str(r) for r in verdict.reasons)
        self.observer(BlowRefused(point, blow, reason, verdict.peak_force, tuple(map(str, verdict.faults))))
        return reason

    def _take(self, point: Dof, blow: int) -> Block:
        self.task.arm()
        self.operator.strike(point, blow)
        return self.task.wait(self.blow_timeout, self.control.is_interrupted)

    def _judge(self, block: Block) -> BlowVerdict:
        assert block.trigger_index is not None, "blocks of a triggered task have one"
        return check_blow(
            block.value(self.step.hammer),
            np.stack([block.value(name) for name in self.accelerometers]),
            block.sample_rate,
            block.trigger_index,
            BlowLimits(lowest_peak_force=self.step.weakest_peak, highest_frequency=self.step.highest_frequency),
            overloaded=bool(block.overloaded),
        )
