"""From a request to create a channel to a virtual channel: the checks that NI-DAQmx makes, and its units."""

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

# SI per unit, by NI's numbers
ACCELERATION_UNITS = {AccelUnits.METERS_PER_SECOND_SQUARED.value: 1.0, AccelUnits.G.value: STANDARD_GRAVITY}
FORCE_UNITS = {ForceUnits.NEWTONS.value: 1.0, ForceUnits.POUNDS.value: POUND_FORCE}
VOLTAGE_UNITS = {VoltageUnits.VOLTS.value: 1.0}
# V per SI unit of one unit of sensitivity
ACCELERATION_SENSITIVITIES = {
    AccelSensitivityUnits.MILLIVOLTS_PER_G.value: 1e-3 / STANDARD_GRAVITY,
    AccelSensitivityUnits.VOLTS_PER_G.value: 1 / STANDARD_GRAVITY,
}
FORCE_SENSITIVITIES = {
    ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_NEWTON.value: 1e-3,
    ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_POUND.value: 1e-3 / POUND_FORCE,
}


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


def force_channel(request: Message, chassis: SimulatedChassis) -> VirtualChannel:
    """The channel of a CreateAIForceIEPEChan request.

    Raises:
        StatusError: see `_channel`.
    """
    sensitivity = _iepe_sensitivity(request, FORCE_SENSITIVITIES)
    unit = _one_of("AI.Force.Units", request.units_raw, FORCE_UNITS)
    return _channel(request, chassis, UsageTypeAI.FORCE_IEPE_SENSOR, sensitivity * unit, *_excitation(request))


def accelerometer_channel(request: Message, chassis: SimulatedChassis) -> VirtualChannel:
    """The channel of a CreateAIAccelChan request.

    Raises:
        StatusError: see `_channel`.
    """
    sensitivity = _iepe_sensitivity(request, ACCELERATION_SENSITIVITIES)
    unit = _one_of("AI.Accel.Units", request.units_raw, ACCELERATION_UNITS)
    measurement = UsageTypeAI.ACCELERATION_ACCELEROMETER_CURRENT_INPUT
    return _channel(request, chassis, measurement, sensitivity * unit, *_excitation(request))


def voltage_channel(request: Message, chassis: SimulatedChassis) -> VirtualChannel:
    """The channel of a CreateAIVoltageChan request.

    Raises:
        StatusError: see `_channel`.
    """
    unit = _one_of("AI.Voltage.Units", request.units_raw, VOLTAGE_UNITS)
    return _channel(request, chassis, UsageTypeAI.VOLTAGE, unit, ExcitationSource.NONE.value, 0.0)


def _channel(
    request: Message,
    chassis: SimulatedChassis,
    measurement: UsageTypeAI,
    volts_per_unit: float,
    source: int,
    current: float,
) -> VirtualChannel:
    """A channel that the module can measure.

    Raises:
        StatusError: -200220 or -200170 for a device or channel that is not there, -200431 for an IEPE sensor on a
            module without excitation, -200082 for a range upside down, -200077 for a range, unit or current it
            cannot do.
    """
    module = chassis.module_of(request.physical_channel)
    if measurement is not UsageTypeAI.VOLTAGE and not module.excitations:
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
        measurement=measurement.value,
        minimum=request.min_val,
        maximum=request.max_val,
        volts_per_unit=volts_per_unit,
        excitation_source=source,
        excitation_current=current,
    )


def _iepe_sensitivity(request: Message, units: dict[int, float]) -> float:
    """V per SI unit."""
    factor = _one_of("AI sensitivity units", request.sensitivity_units_raw, units)
    if not request.sensitivity > 0:
        raise StatusError(Code.INVALID_ATTRIBUTE_VALUE, f"Sensitivity. Requested value: {request.sensitivity:g}.")
    return float(request.sensitivity) * factor


def _excitation(request: Message) -> tuple[int, float]:
    """NI's number of the source, and the current in A that the module supplies."""
    source = int(request.current_excit_source_raw)
    return source, float(request.current_excit_val) if source == ExcitationSource.INTERNAL.value else 0.0


def _one_of(name: str, number: int, values: dict[int, float]) -> float:
    if number not in values:
        raise _not_a_value(name, number, tuple(values))
    return values[number]


def _not_a_value(name: str, value: float, possible: tuple[float, ...]) -> StatusError:
    choice = ", ".join(f"{p:g}" for p in possible)
    return StatusError(
        Code.INVALID_ATTRIBUTE_VALUE, f"Property: {name}. Requested value: {value:g}. Possible values: {choice}."
    )
