"""From a request to create a channel to a virtual channel: the checks that NI-DAQmx makes, and its units."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nidaqmx.constants import (
    AccelSensitivityUnits,
    AccelUnits,
    ExcitationSource,
    ForceIEPESensorSensitivityUnits,
    ForceUnits,
    UsageTypeAI,
    VoltageUnits,
)

from simlab.daq_errors import Code, StatusError
from simlab.daq_modules import Module, SimulatedChassis

Message = Any  # protobuf messages carry no types

STANDARD_GRAVITY = 9.80665
POUND_FORCE = 4.4482216152605


@dataclass(frozen=True)
class MeasurementKind:
    """A kind of measurement.

    Attributes:
        measurement: NI's name.
        property: NI's name of the property that holds the unit.
        units: SI per unit, by NI's numbers.
        sensitivities: V per SI unit of one unit of sensitivity, by NI's numbers; of IEPE sensors only.
    """

    measurement: UsageTypeAI
    property: str
    units: Mapping[int, float]
    sensitivities: Mapping[int, float] | None = None


FORCE = MeasurementKind(
    UsageTypeAI.FORCE_IEPE_SENSOR,
    "AI.Force.Units",
    {ForceUnits.NEWTONS.value: 1.0, ForceUnits.POUNDS.value: POUND_FORCE},
    {
        ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_NEWTON.value: 1e-3,
        ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_POUND.value: 1e-3 / POUND_FORCE,
    },
)
ACCELERATION = MeasurementKind(
    UsageTypeAI.ACCELERATION_ACCELEROMETER_CURRENT_INPUT,
    "AI.Accel.Units",
    {AccelUnits.METERS_PER_SECOND_SQUARED.value: 1.0, AccelUnits.G.value: STANDARD_GRAVITY},
    {
        AccelSensitivityUnits.MILLIVOLTS_PER_G.value: 1e-3 / STANDARD_GRAVITY,
        AccelSensitivityUnits.VOLTS_PER_G.value: 1 / STANDARD_GRAVITY,
    },
)
VOLTAGE = MeasurementKind(UsageTypeAI.VOLTAGE, "AI.Voltage.Units", {VoltageUnits.VOLTS.value: 1.0})


@dataclass(frozen=True)
class VirtualChannel:
    """A channel of a task.

    Attributes:
        name: name in the task.
        physical: the physical channel.
        module: the module that it is on.
        measurement: NI's number of the kind of measurement.
        minimum, maximum: range that was asked for, in the unit of the channel.
        volts_per_unit: sensitivity that the client gave.
        excitation_source: NI's number.
        excitation_current: A; 0 without excitation.
    """

    name: str
    physical: str
    module: Module
    measurement: int
    minimum: float
    maximum: float
    volts_per_unit: float
    excitation_source: int
    excitation_current: float


def virtual_channel(kind: MeasurementKind, request: Message, chassis: SimulatedChassis) -> VirtualChannel:
    """The channel of `kind` that a request to create one asks for.

    Raises:
        StatusError: -200220 or -200170 for a device or channel that is not there, -200431 for an IEPE sensor on a
            module without excitation, -200082 for a range upside down, -200077 for a range, unit, sensitivity or
            current it cannot do.
    """
    volts_per_unit, source, current = 1.0, int(ExcitationSource.NONE.value), 0.0
    if kind.sensitivities is not None:
        volts_per_unit = _one_of("AI sensitivity units", request.sensitivity_units_raw, kind.sensitivities)
        if not request.sensitivity > 0:
            raise StatusError(Code.INVALID_ATTRIBUTE_VALUE, f"Sensitivity. Requested value: {request.sensitivity:g}.")
        volts_per_unit = float(request.sensitivity) * volts_per_unit
        source = int(request.current_excit_source_raw)
        current = float(request.current_excit_val) if source == ExcitationSource.INTERNAL.value else 0.0
    volts_per_unit *= _one_of(kind.property, request.units_raw, kind.units)
    module = chassis.module_of(request.physical_channel)
    if kind.sensitivities is not None and not module.excitations:
        raise StatusError(Code.PHYS_CHAN_MEAS_TYPE, f"Physical channel name: {request.physical_channel}.")
    if current and current not in module.excitations:
        raise _not_a_value("AI.Excit.Val", current, (0.0, *module.excitations))
    if not request.min_val < request.max_val:
        raise StatusError(Code.MIN_NOT_LESS_THAN_MAX, f"Minimum {request.min_val:g}, maximum {request.max_val:g}.")
    limit = module.volts / volts_per_unit
    for name, value in (("AI.Min", request.min_val), ("AI.Max", request.max_val)):
        if abs(value) > limit * (1 + 1e-9):
            raise _not_a_value(name, value, (-limit, limit))
    return VirtualChannel(
        name=request.name_to_assign_to_channel or request.physical_channel,
        physical=request.physical_channel,
        module=module,
        measurement=kind.measurement.value,
        minimum=request.min_val,
        maximum=request.max_val,
        volts_per_unit=volts_per_unit,
        excitation_source=source,
        excitation_current=current,
    )


def _one_of(name: str, number: int, values: Mapping[int, float]) -> float:
    if number not in values:
        raise _not_a_value(name, number, tuple(values))
    return values[number]


def _not_a_value(name: str, value: float, possible: tuple[float, ...]) -> StatusError:
    choice = ", ".join(f"{p:g}" for p in possible)
    return StatusError(
        Code.INVALID_ATTRIBUTE_VALUE, f"Property: {name}. Requested value: {value:g}. Possible values: {choice}."
    )
