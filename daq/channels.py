"""The channel table: sensors, their inputs and their sensitivities."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from enum import StrEnum

from daq.errors import ChannelError


class ChannelKind(StrEnum):
    """Conditioning of a channel: a constant current for IEPE sensors, a supply for bridges, none for voltages."""

    FORCE_IEPE = "force_iepe"
    ACCELERATION_IEPE = "acceleration_iepe"
    FORCE_BRIDGE = "force_bridge"
    FORCE_CHARGE = "force_charge"
    ACCELERATION_CHARGE = "acceleration_charge"
    VOLTAGE = "voltage"

    @property
    def input_unit(self) -> str:
        """Unit of what is measured at the input: V, V/V of a bridge, C of a sensor with charge output."""
        if self is ChannelKind.FORCE_BRIDGE:
            return "V/V"
        return "C" if self in (ChannelKind.FORCE_CHARGE, ChannelKind.ACCELERATION_CHARGE) else "V"


UNITS: dict[ChannelKind, str] = {
    kind: "N" if kind.startswith("force") else "m/s^2" for kind in ChannelKind if kind is not ChannelKind.VOLTAGE
}
"""SI unit of what sensors of a kind measure; a voltage may stand for anything."""
ACCELEROMETERS = frozenset({ChannelKind.ACCELERATION_IEPE, ChannelKind.ACCELERATION_CHARGE})
HAMMERS = frozenset({ChannelKind.FORCE_IEPE, ChannelKind.FORCE_CHARGE})
LARGEST_INPUT = {"V": 425.0, "V/V": 0.5, "C": 1e-6}
"""By unit the peak that an input takes at most: an NI 9225, a half bridge at an NI 9219, a large charge amplifier."""


class BridgeConfiguration(StrEnum):
    """How many arms of a Wheatstone bridge are in the sensor: four, two, or one; the module has the others."""

    FULL = "full"
    HALF = "half"
    QUARTER = "quarter"


@dataclass(frozen=True)
class Bridge:
    """A Wheatstone bridge of strain gauges, fed by the module.

    Attributes:
        excitation: supply, V.
        configuration: arms in the sensor.
        resistance: of an arm, nominal, ohm.

    Raises:
        ChannelError: a value is not positive.
    """

    excitation: float
    configuration: BridgeConfiguration = BridgeConfiguration.FULL
    resistance: float = 350.0

    def __post_init__(self) -> None:
        for name, value, unit in (("excitation", self.excitation, "V"), ("resistance", self.resistance, "ohm")):
            if not (math.isfinite(value) and value > 0):
                raise ChannelError(f"bridge: {name} {value} {unit} must be positive; see the data sheet of its sensor")


@dataclass(frozen=True)
class Channel:
    """One sensor on one input.

    Attributes:
        name: such as "hammer"; unique in a table.
        physical: NI-DAQmx physical channel ("cDAQ1Mod1/ai0").
        kind: conditioning.
        sensitivity: volts per `unit`; V/V of a bridge, C of a sensor with charge output (`ChannelKind.input_unit`).
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
        bridge: how the bridge is connected and fed; of a channel of that kind alone.

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
    bridge: Bridge | None = None

    def __post_init__(self) -> None:
        if not self.name or "," in self.name:
            raise ChannelError(f"channel name {self.name!r}: give a name without commas")
        at_input = self.kind.input_unit
        if not (math.isfinite(self.sensitivity) and self.sensitivity > 0):
            raise ChannelError(
                f"channel {self.name!r}: sensitivity {self.sensitivity} {at_input} per {self.unit} must be positive"
            )
        if self.unit != UNITS.get(self.kind, self.unit):
            raise ChannelError(
                f"channel {self.name!r}: a {self.kind} sensor measures {UNITS[self.kind]}, not {self.unit}; correct "
                "kind or unit"
            )
        if self.polarity not in (1, -1):
            raise ChannelError(f"channel {self.name!r}: polarity {self.polarity} is neither 1 nor -1")
        if not self.minimum < self.maximum:
            raise ChannelError(f"channel {self.name!r}: range {self.minimum} to {self.maximum} {self.unit} is empty")
        if (peak := self.sensitivity * max(abs(self.minimum), abs(self.maximum))) > LARGEST_INPUT[at_input]:
            raise ChannelError(
                f"channel {self.name!r}: {self.sensitivity:g} {at_input} per {self.unit} and {self.minimum:g} to "
                f"{self.maximum:g} {self.unit} are {peak:g} {at_input} at its input, more than any module takes; is "
                f"the sensitivity in {at_input} per {self.unit}?"
            )
        if not self.excitation_current >= 0:
            raise ChannelError(f"channel {self.name!r}: excitation current {self.excitation_current} A is negative")
        if self.excitation_current and not self.kind.endswith("iepe"):
            raise ChannelError(f"channel {self.name!r}: a {self.kind} channel takes no excitation current; set it to 0")
        if self.kind is ChannelKind.FORCE_BRIDGE and self.bridge is None:
            raise ChannelError(f"channel {self.name!r}: say how its bridge is fed, as in bridge = {{ excitation = 5 }}")
        if self.bridge is not None and self.kind is not ChannelKind.FORCE_BRIDGE:
            raise ChannelError(f"channel {self.name!r}: a {self.kind} channel has no bridge; remove it or correct kind")

    @property
    def sensitivity_unit(self) -> str:
        """Unit of `sensitivity`, such as V/(m/s^2)."""
        return f"{self.kind.input_unit}/({self.unit})"


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
