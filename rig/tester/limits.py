"""The rig's own limits for the tester, on commands and on measured values; the instrument has its own, too."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass

from rig.errors import RequestError, RigError
from rig.registers import COMMAND, IDENTITY, STATUS, Interlock, name_of
from rig.tester.status import TesterStatus

BEYOND_COMMAND = 1.05
"""Largest measured amplitude over the largest that may be commanded; points are accepted with a deviation of 5 %."""

_PRESETS, _FREQUENCIES = COMMAND.range_of("preset"), COMMAND.range_of("frequency")
HARD_CAPS: Mapping[str, tuple[float, float]] = {
    "amplitude_pp": COMMAND.range_of("amplitude"),
    "lowest_frequency": _FREQUENCIES,
    "highest_frequency": _FREQUENCIES,
    "lowest_preset": _PRESETS,
    "highest_preset": _PRESETS,
    "velocity": (0.0, IDENTITY.range_of("velocity_limit")[1]),
    "acceleration": (0.0, IDENTITY.range_of("acceleration_limit")[1]),
    "force": (0.0, STATUS.range_of("force_mean")[1]),
}
"""Lowest and highest value that each of the rig's limits may ever have, in its unit: the ranges of the
tester's register map (version 2), beyond which no command has a meaning and no reading is believed. No key and no
setting widens them."""


class LimitExceededError(RequestError):
    """A command for the actuator is beyond a limit of the rig; nothing was sent."""


class MeasuredBeyondLimitError(RigError):
    """A measured value is beyond a limit of the rig; the actuator has to be stopped."""


@dataclass(frozen=True)
class TesterLimits:
    """Limits on commands to the actuator and on its measured values; SI units.

    Attributes:
        amplitude_pp: largest peak-to-peak amplitude, m.
        lowest_frequency: Hz.
        highest_frequency: Hz.
        lowest_preset: m.
        highest_preset: m.
        velocity: highest peak velocity of a cycle, m/s.
        acceleration: highest peak acceleration of a cycle, m/s^2.
        force: largest absolute force, N.

    Raises:
        LimitExceededError: one is beyond its hard cap, or not a number; or the lowest of a range is above its highest.
    """

    amplitude_pp: float = 3e-4
    lowest_frequency: float = 1.0
    highest_frequency: float = 250.0
    lowest_preset: float = 0.0
    highest_preset: float = 1e-3
    velocity: float = 0.15
    acceleration: float = 150.0
    force: float = 4e3

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            lowest, highest = HARD_CAPS[name]
            if not lowest <= value <= highest:
                raise LimitExceededError(
                    f"limit {name.replace('_', ' ')} {value:g} is outside {lowest:g} to {highest:g}, the range of "
                    "testers with this register map; give one inside"
                )
        _check_range("frequency", self.lowest_frequency, self.highest_frequency, "Hz")
        _check_range("preset", self.lowest_preset, self.highest_preset, "mm")

    def check_preset(self, preset: float) -> None:
        """Check a preset in m. Raises LimitExceededError where it is beyond a limit, or not a number."""
        _check("preset", preset, self.lowest_preset, self.highest_preset, "mm")

    def check_cycle(self, amplitude_pp: float, frequency: float) -> None:
        """Check a cycle of `amplitude_pp` m peak to peak at `frequency` Hz.

        Raises LimitExceededError where it is beyond a limit, or not a number.
        """
        _check("peak-to-peak amplitude", amplitude_pp, 0.0, self.amplitude_pp, "mm")
        _check("frequency", frequency, self.lowest_frequency, self.highest_frequency, "Hz")
        omega, amplitude = 2 * math.pi * frequency, amplitude_pp / 2
        _check("peak velocity", omega * amplitude, 0.0, self.velocity, "m/s")
        _check("peak acceleration", omega**2 * amplitude, 0.0, self.acceleration, "m/s^2")

    def check_detector(self, interlock: Interlock, limit: float) -> None:
        """Check that a detector of the tester fires no later than the rig's own limit on the same quantity.

        Args:
            interlock: whose detector; the rig has no limit of its own on overshoot and underpeak.
            limit: in the unit of the quantity that it watches.

        Raises:
            LimitExceededError: the rig's own limit is tighter.
        """
        what = f"detector {name_of(interlock)}"
        if interlock is Interlock.FORCE:
            _check(what, limit, 0.0, self.force, "N")
        elif interlock in (Interlock.UPPER_DISPLACEMENT, Interlock.LOWER_DISPLACEMENT):
            _check(what, limit, *self._reach, "mm")

    @property
    def _reach(self) -> tuple[float, float]:
        """Lowest and highest position that may be measured, m."""
        return self.lowest_preset - self.amplitude_pp, self.highest_preset + self.amplitude_pp

    def check_measured(self, status: TesterStatus) -> None:
        """Check the measured amplitude, the extreme positions that mean and amplitude give together, and the force.

        Raises MeasuredBeyondLimitError where it is beyond a limit, or not a number.
        """
        amplitude_pp = max(status.displacement_pp[:1], default=0.0)
        if not amplitude_pp <= BEYOND_COMMAND * self.amplitude_pp:
            raise MeasuredBeyondLimitError(
                f"the actuator moves by {1e3 * amplitude_pp:.3g} mm peak to peak, beyond the rig's limit of "
                f"{1e3 * self.amplitude_pp:g} mm; check the tester and the specimen"
            )
        lowest, highest = self._reach
        position = status.displacement_mean
        if not lowest <= position - amplitude_pp / 2 <= position + amplitude_pp / 2 <= highest:
            raise MeasuredBeyondLimitError(
                f"the actuator is at {1e3 * position:.3g} mm with {1e3 * amplitude_pp:.3g} mm peak to peak, outside "
                f"the rig's limits of {1e3 * lowest:g} to {1e3 * highest:g} mm; check the tester and the specimen"
            )
        force = abs(status.force_mean) + status.force_pp / 2
        if not force <= self.force:
            raise MeasuredBeyondLimitError(
                f"the force is {force:.4g} N, beyond the rig's limit of {self.force:g} N; check the tester and the "
                "specimen"
            )

    def largest_amplitude_pp(self, frequency: float) -> float:
        """The largest peak-to-peak amplitude in m that `check_cycle` lets pass at `frequency` Hz."""
        omega = 2 * math.pi * frequency
        by_motion = 2 * min(self.velocity / omega, self.acceleration / omega**2)
        return min(self.amplitude_pp, by_motion * (1 - 1e-9))


def _check_range(what: str, lowest: float, highest: float, unit: str) -> None:
    """Check that a range in SI units has something in it; `unit` as for `_check`."""
    if lowest > highest:
        scale = _scale(unit)
        raise LimitExceededError(
            f"limit lowest {what} {scale * lowest:g} {unit} is above the highest, {scale * highest:g} {unit}; exchange "
            "them, or give another range"
        )


def _check(what: str, value: float, lowest: float, highest: float, unit: str) -> None:
    """Check a value in SI units; `unit` is the one in which sequences and pages have it."""
    # written so that a value that is not a number does not pass
    if not lowest <= value <= highest:
        scale = _scale(unit)
        raise LimitExceededError(
            f"{what} {scale * value:g} {unit} is outside the rig's limits of {scale * lowest:g} to "
            f"{scale * highest:g} {unit}; nothing was sent"
        )


def _scale(unit: str) -> float:
    """A value in a unit that people see, over its value in SI units."""
    return 1e3 if unit == "mm" else 1.0
