"""An instrument with its calibration, and the channel that it is connected to: values, without a database."""

from dataclasses import dataclass, field
from datetime import date
from typing import Any


@dataclass(frozen=True)
class Instrument:
    """An instrument with a serial number, and the calibration that was valid.

    Attributes:
        kind: accelerometer, hammer, tester, thermometer, chassis, ...
        calibrated_on: None for an instrument that is not calibrated, or was imported without a date.
        sensitivity: as the certificate gives it, in `sensitivity_unit`.
        details: further identification, such as the firmware or the version of the register map.
        uncertainty: of the sensitivity, relative, expanded (k = 2).
        certificate: its number.
        due_on: day until which the calibration is valid.
    """

    kind: str
    model: str
    serial: str
    calibrated_on: date | None = None
    sensitivity: float | None = None
    sensitivity_unit: str | None = None
    details: dict[str, Any] = field(default_factory=dict)
    uncertainty: float | None = field(default=None, compare=False)
    certificate: str | None = field(default=None, compare=False)
    due_on: date | None = field(default=None, compare=False)


@dataclass(frozen=True)
class StoredChannel:
    """Settings of one input during a run.

    Attributes:
        physical: the terminal, such as cDAQ1Mod1/ai0.
        kind: force, acceleration, voltage, ...
        unit: physical unit of minimum and maximum.
        sensitivity: volts per physical unit; V/V of a bridge, C of a charge.
        excitation_current: A, or None without IEPE.
        instrument: the connected sensor.
        polarity: 1, or -1 where the sensor gives a negative voltage for a positive quantity; None in runs of versions
            that did not store it.
    """

    name: str
    physical: str
    kind: str
    unit: str
    sensitivity: float
    minimum: float
    maximum: float
    excitation_current: float | None
    instrument: Instrument
    polarity: int | None = None
