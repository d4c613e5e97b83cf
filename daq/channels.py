"""The channel table: sensors, their inputs and their sensitivities."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from enum import StrEnum

from daq.errors import ChannelError


class ChannelKind(StrEnum):
    """Conditioning of a channel: IEPE sensors need a constant current, a voltage is measured directly."""

    FORCE_IEPE = "force_iepe"
    ACCELERATION_IEPE = "acceleration_iepe"
    VOLTAGE = "voltage"


LARGEST_VOLTAGE = 425.0
"""Peak voltage in V that an input of a module takes at most (NI 9225)."""


@dataclass(frozen=True)
class Channel:
    """One sensor on one input.

    Attributes:
        name: such as "hammer"; unique in a table.
        physical: NI-DAQmx physical channel ("cDAQ1Mod1/ai0").
        kind: conditioning.
        sensitivity: volts per `unit`.
        unit: SI unit of the quantity measured ("N", "m/s^2", "m").
        minimum, maximum: requested range, in `unit`.
        excitation_current: IEPE current in A; 0 where the sensor has another supply or needs none.
        serial: serial number of the sensor.
        calibrated_on: date of the calibration that `sensitivity` comes from.
        certificate: number of its certificate.
        uncertainty: of the sensitivity, relative, expanded (k = 2); None where it is not known.
        due_on: day until which the calibration is valid.
        polarity: 1, or -1 where the sensor gives a negative voltage for a positive quantity.
        noise: rms noise at rest by the data sheets of sensor and input, in `unit`; None where it is not known.

    Raises:
        ChannelError: a value is impossible, such as a sensitivity of zero, an empty range or kilovolts.
    """

    name: str
    physical: str
    kind: ChannelKind
    sensitivity: float
    unit: str
    minimum: float
    maximum: float
    excitation_current: float = 0.0
    serial: str = ""
    calibrated_on: date | None = None
    certificate: str = ""
    uncertainty: float | None = None
    due_on: date | None = None
    polarity: int = 1
    noise: float | None = None

    def __post_init__(self) -> None:
        if not self.name or "," in self.name:
            raise ChannelError(f"channel name {self.name!r}: give a name without commas")
        if not (math.isfinite(self.sensitivity) and self.sensitivity > 0):
            raise ChannelError(
                f"channel {self.name!r}: sensitivity {self.sensitivity} V per {self.unit} must be positive"
            )
        if self.polarity not in (1, -1):
            raise ChannelError(f"channel {self.name!r}: polarity {self.polarity} is neither 1 nor -1")
        if not self.minimum < self.maximum:
            raise ChannelError(f"channel {self.name!r}: range {self.minimum} to {self.maximum} {self.unit} is empty")
        if (volts := self.sensitivity * max(abs(self.minimum), abs(self.maximum))) > LARGEST_VOLTAGE:
            raise ChannelError(
                f"channel {self.name!r}: {self.sensitivity:g} V per {self.unit} and {self.minimum:g} to "
                f"{self.maximum:g} {self.unit} are {volts:g} V at its input, more than any module takes; is the "
                f"sensitivity in V per {self.unit}?"
            )
        if not self.excitation_current >= 0:
            raise ChannelError(f"channel {self.name!r}: excitation current {self.excitation_current} A is negative")
        if self.kind is ChannelKind.VOLTAGE and self.excitation_current:
            raise ChannelError(f"channel {self.name!r}: a voltage channel takes no excitation current; set it to 0")


def checked_table(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """The channels as a table that one task can hold.

    Raises:
        ChannelError: no channel at all, or two that share a name or a physical channel.
    """
    if not channels:
        raise ChannelError("the channel table is empty; name at least one channel")
    for what, values in (("name", [c.name for c in channels]), ("physical channel", [c.physical for c in channels])):
        twice = sorted({value for value in values if values.count(value) > 1})
        if twice:
            raise ChannelError(f"channel table: {what} {', '.join(twice)} occurs twice; use each once")
    return tuple(channels)
