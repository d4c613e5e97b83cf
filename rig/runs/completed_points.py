"""The points that a run has completed, which are not measured again when it goes on."""

from dataclasses import dataclass

import numpy as np
from pydantic import Base64Bytes

from analysis.dof import Dof
from analysis.frequency_response import Real
from rig.errors import RequestError
from rig.hammer.blow_comparison import PointBlows
from rig.hammer.session import PointProgress
from rig.sequences.sequence import HammerStep, Sequence, SineStep, Step


class ResumeError(RequestError):
    """The run cannot be resumed with this sequence or these instruments; nothing moved."""


@dataclass(frozen=True)
class RecordedBlow:
    """An accepted blow of a point that needs more: force in N and acceleration in m/s^2 as float64, little-endian."""

    number: int
    sample_rate: float
    force: Base64Bytes
    acceleration: Base64Bytes

    @classmethod
    def of(cls, number: int, sample_rate: float, force: Real, acceleration: Real) -> "RecordedBlow":
        """The blow with its record: force (samples,) in N, acceleration (samples,) in m/s^2."""
        return cls(number, sample_rate, force.astype("<f8").tobytes(), acceleration.astype("<f8").tobytes())


@dataclass(frozen=True)
class CompletedPoint:
    """The blows that are stored at one point of a set.

    Attributes:
        point: such as 3y.
        accepted, refused: number of blows.
        last_blow: number of the last one.
        compared: the records among which the next ones are judged, where the point needs more.
    """

    set_number: int
    point: str
    accepted: int
    refused: int
    last_blow: int
    compared: tuple[RecordedBlow, ...] = ()

    def progress(self, highest_frequency: float) -> PointProgress:
        """The progress for a session that compares blows up to `highest_frequency` in Hz."""
        return PointProgress(
            self.accepted, self.refused, self.last_blow, compared_blows(self.compared, highest_frequency)
        )


def compared_blows(blows: tuple[RecordedBlow, ...], highest_frequency: float) -> PointBlows | None:
    """Accepted blows, compared with each other up to `highest_frequency` in Hz; None where there are none."""

    def values(row: bytes) -> Real:
        return np.frombuffer(row, "<f8")

    struck = [(each.number, values(each.force), values(each.acceleration)) for each in blows]
    return PointBlows.of(highest_frequency, struck, blows[0].sample_rate) if blows else None


@dataclass(frozen=True)
class CompletedPoints:
    """The stored measurements of a run.

    Attributes:
        points: with one blow or more.
        sines: order numbers of the sine points.
        elapsed: s from the start of the run to the latest sine point.
    """

    points: tuple[CompletedPoint, ...] = ()
    sines: frozenset[int] = frozenset()
    elapsed: float = 0.0

    @property
    def blows(self) -> int:
        """Number of accepted blows."""
        return sum(point.accepted for point in self.points)

    def points_of(self, set_number: int, step: HammerStep) -> dict[Dof, PointProgress]:
        """Progress of the points of a set, which `step` measures."""
        return {
            Dof.parse(each.point): each.progress(step.highest_frequency)
            for each in self.points
            if each.set_number == set_number
        }

    def remaining_steps(self, sequence: Sequence) -> tuple[tuple[Step, int], ...]:
        """The steps that are not complete, each with a number.

        That is the set number of a hammer step, the order number of the first point of a sine step, and 0 of others.

        A wait, a soak or a prompt serves the step after it, and is repeated where that is not complete.
        """
        accepted = {(each.set_number, each.point): each.accepted for each in self.points}
        remaining = list[tuple[Step, int]]()
        set_number = len(sequence.hammer_steps) + 1
        sine_steps = list(sequence.sine_steps)
        needed = True  # whether the next step is incomplete; at the end of a sequence a wait is always carried out
        for step in reversed(sequence.steps):
            number = 0
            if isinstance(step, HammerStep):
                number = set_number = set_number - 1
                needed = any(accepted.get((number, point), 0) < step.blows for point in step.points)
            elif isinstance(step, SineStep):
                _, number = sine_steps.pop()
                needed = not self.sines.issuperset(range(number, number + step.points))
            if needed:
                remaining.append((step, number))
        return tuple(reversed(remaining))


NOTHING_COMPLETED = CompletedPoints()
"""The completed points of a run that begins."""
