"""Comparing the blows of one point: with three or more, a blow at another point shows as inconsistent."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from analysis.frequency_response import Real
from analysis.modal.blow_check import BlowReason, check_point

LOWEST_COMPARED = 20.0  # Hz; below, a record of two seconds holds more drift than response


def inconsistent_blows(
    force: Real, acceleration: Real, sample_rate: float, highest: float
) -> tuple[BlowReason | None, ...]:
    """For each blow of a point the reason why it is inconsistent with the others, or None.

    Args:
        force: (blows, samples) in N.
        acceleration: (blows, samples) in m/s^2.
        sample_rate: in Hz.
        highest: frequency in Hz up to which they are compared.
    """
    if (highest - LOWEST_COMPARED) * force.shape[1] < sample_rate:  # no spectral line may lie between them
        return (None,) * len(force)
    return check_point(force, acceleration, sample_rate, (LOWEST_COMPARED, highest))


@dataclass
class PointBlows:
    """Blows of one point that are good by themselves, and whether the others agree with each of them.

    Attributes:
        highest: frequency in Hz up to which they are compared.
    """

    highest: float
    _force: list[Real] = field(default_factory=list)
    _acceleration: list[Real] = field(default_factory=list)
    _numbers: list[int] = field(default_factory=list)
    _inconsistent: dict[int, BlowReason] = field(default_factory=dict)
    _refused: set[int] = field(default_factory=set)

    @classmethod
    def of(cls, highest: float, blows: Iterable[tuple[int, Real, Real]], sample_rate: float) -> Self:
        """Blows that were accepted when they were struck, compared with each other again.

        Args:
            highest: see above.
            blows: number, force (samples,) in N and acceleration (samples,) in m/s^2 of each, one or more.
            sample_rate: in Hz.
        """
        numbers, force, acceleration = map(list, zip(*blows, strict=True))
        found = cls(highest, force, acceleration, numbers)
        found._inconsistent = found._judged(sample_rate)
        return found

    @property
    def accepted(self) -> int:
        """Number of blows that count."""
        return sum(number not in self._inconsistent and number not in self._refused for number in self._numbers)

    def add(self, number: int, force: Real, acceleration: Real, sample_rate: float) -> dict[int, BlowReason]:
        """Take blow `number`: force (samples,) in N, acceleration (samples,) in m/s^2, `sample_rate` in Hz.

        Returns:
            The blows that are inconsistent since then, and the reasons. One of them may be `number` itself; it is then
            refused for good, whatever later blows say.
        """
        self._force.append(force)
        self._acceleration.append(acceleration)
        self._numbers.append(number)
        before = self._inconsistent
        self._inconsistent = self._judged(sample_rate)
        if number in self._inconsistent:
            self._refused.add(number)
        return {
            blow: reason
            for blow, reason in self._inconsistent.items()
            if blow == number or (blow not in before and blow not in self._refused)
        }

    def _judged(self, sample_rate: float) -> dict[int, BlowReason]:
        reasons = inconsistent_blows(np.array(self._force), np.array(self._acceleration), sample_rate, self.highest)
        return {number: reason for number, reason in zip(self._numbers, reasons, strict=True) if reason is not None}
