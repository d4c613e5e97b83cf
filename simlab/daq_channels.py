"""From a request to create a channel to a virtual channel: the checks that NI-DAQmx makes, and its units."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nidaqmx.constants import (
    AccelChargeSensitivityUnits,
    AccelSensitivityUnits,
    AccelUnits,
    BridgeConfiguration,
    BridgeElectricalUnits,
    BridgePhysicalUnits,
    ChargeUnits,
    ExcitationSource,
    ForceIEPESensorSensitivityUnits,
    ForceUnits,
    UsageTypeAI,
    VoltageUnits,
)

from simlab.daq_errors import Code, StatusError
from simlab.daq_modules import Input, Module, SimulatedChassis

Message = Any  # protobuf messages carry no types

STANDARD_GRAVITY = 9.80665
POUND_FORCE = 4.4482216152605


@dataclass(frozen=True)
class MeasurementKind:
    """A kind of measurement.

    Attributes:
        measurement: NI's name.
        input: what an input has to measure.
        property: NI's name of the property that holds the unit.
        units: SI per unit, by NI's numbers.
        sensitivities: V or C per SI unit of one unit of sensitivity, by NI's numbers; where a request has one.
    """

    measurement: UsageTypeAI
    input: Input
    property: str
    units: Mapping[int, float]
    sensitivities: Mapping[int, float] | None = None


FORCES = {ForceUnits.NEWTONS.value: 1.0, ForceUnits.POUNDS.value: POUND_FORCE}
ACCELERATIONS = {AccelUnits.METERS_PER_SECOND_SQUARED.value: 1.0, AccelUnits.G.value: STANDARD_GRAVITY}
FORCE = MeasurementKind(
    UsageTypeAI.FORCE_IEPE_SENSOR,
    Input.IEPE,
    "AI.Force.Units",
    FORCES,
    {
        ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_NEWTON.value: 1e-3,
        ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_POUND.value: 1e-3 / POUND_FORCE,
    },
)
ACCELERATION = MeasurementKind(
    UsageTypeAI.ACCELERATION_ACCELEROMETER_CURRENT_INPUT,
    Input.IEPE,
    "AI.Accel.Units",
    ACCELERATIONS,
    {
        AccelSensitivityUnits.MILLIVOLTS_PER_G.value: 1e-3 / STANDARD_GRAVITY,
        AccelSensitivityUnits.VOLTS_PER_G.value: 1 / STANDARD_GRAVITY,
    },
)
VOLTAGE = MeasurementKind(UsageTypeAI.VOLTAGE, Input.VOLTAGE, "AI.Voltage.Units", {VoltageUnits.VOLTS.value: 1.0})
FORCE_BRIDGE = MeasurementKind(UsageTypeAI.FORCE_BRIDGE, Input.BRIDGE, "AI.Force.Units", FORCES)
ACCELERATION_CHARGE = MeasurementKind(
    UsageTypeAI.ACCELERATION_CHARGE,
    Input.CHARGE,
    "AI.Accel.Units",
    ACCELERATIONS,
    {
        AccelChargeSensitivityUnits.PICO_COULOMBS_PER_G.value: 1e-12 / STANDARD_GRAVITY,
        AccelChargeSensitivityUnits.PICO_COULOMBS_PER_METERS_PER_SECOND_SQUARED.value: 1e-12,
    },
)
CHARGE = MeasurementKind(
    UsageTypeAI.CHARGE,
    Input.CHARGE,
    "AI.Charge.Units",
    {ChargeUnits.COULOMBS.value: 1.0, ChargeUnits.PICO_COULOMBS.value: 1e-12},
)
BRIDGES = {
    BridgeConfiguration.FULL_BRIDGE.value: 1.0,
    BridgeConfiguration.HALF_BRIDGE.value: 0.5,
    BridgeConfiguration.QUARTER_BRIDGE.value: 0.25,
}
"""Share of a full bridge's signal by NI's number of the configuration; all four arms of the load cell are active."""
RATIOS = {BridgeElectricalUnits.VOLTS_PER_VOLT.value: 1.0, BridgeElectricalUnits.MILLIVOLTS_PER_VOLT.value: 1e-3}
LOADS = {BridgePhysicalUnits.NEWTONS.value: 1.0, BridgePhysicalUnits.POUNDS.value: POUND_FORCE}


@dataclass(frozen=True)
class VirtualChannel:
    """A channel of a task.

    Attributes:
        name: name in the task.
        physical: the physical channel.
        module: the module that it is on.
        measurement: NI's number of the kind of measurement.
        minimum, maximum: range that was asked for, in the unit of the channel.
        per_unit: sensitivity that the client gave, V, V/V or C per unit of the channel.
        excitation_source: NI's number.
        excitation: A, or V of a bridge; 0 without excitation.
        bridge: NI's number of its configuration; 0 where it is none.
        resistance: of the bridge, ohm.
    """

    name: str
    physical: str
    module: Module
    measurement: int
    minimum: float
    maximum: float
    per_unit: float
    excitation_source: int
    excitation: float
    bridge: int = 0
    resistance: float = 0.0


def virtual_channel(kind: MeasurementKind, request: Message, chassis: SimulatedChassis) -> VirtualChannel:
    """The channel of `kind` that a request to create one asks for.

    Raises:
        StatusError: -200220 or -200170 for a device or channel that is not there, -200431 for a sensor that the module
            does not measure, -200082 for a range upside down, -201334 for a bridge of one point, -200077 for a range,
            unit, sensitivity, bridge or excitation it cannot do.
    """
    per_unit = _per_si_unit(kind, request) * _one_of(kind.property, request.units_raw, kind.units)
    module = chassis.module_of(request.physical_channel)
    if kind.input not in module.measures:
        raise StatusError(Code.PHYS_CHAN_MEAS_TYPE, f"Physical channel name: {request.physical_channel}.")
    source, excitation = _excitation(kind, request, module)
    if not request.min_val < request.max_val:
        raise StatusError(Code.MIN_NOT_LESS_THAN_MAX, f"Minimum {request.min_val:g}, maximum {request.max_val:g}.")
    limit = module.largest / per_unit
    for name, value in (("AI.Min", request.min_val), ("AI.Max", request.max_val)):
        if abs(value) > limit * (1 + 1e-9):
            raise _not_a_value(name, value, (-limit, limit))
    is_bridge = kind.input is Input.BRIDGE
    return VirtualChannel(
        name=request.name_to_assign_to_channel or request.physical_channel,
        physical=request.physical_channel,
        module=module,
        measurement=kind.measurement.value,
        minimum=request.min_val,
        maximum=request.max_val,
        per_unit=per_unit,
        excitation_source=source,
        excitation=excitation,
        bridge=request.bridge_config_raw if is_bridge else 0,
        resistance=request.nominal_bridge_resistance if is_bridge else 0.0,
    )


def _per_si_unit(kind: MeasurementKind, request: Message) -> float:
    """V, V/V or C per SI unit by the sensitivity of a request, or by the two points of its bridge."""
    if kind.input is Input.BRIDGE:
        return _slope(request)
    if kind.sensitivities is None:
        return 1.0
    unit = _one_of("AI sensitivity units", request.sensitivity_units_raw, kind.sensitivities)
    if not request.sensitivity > 0:
        raise StatusError(Code.INVALID_ATTRIBUTE_VALUE, f"Sensitivity. Requested value: {request.sensitivity:g}.")
    return float(request.sensitivity) * unit


def _slope(request: Message) -> float:
    _one_of("AI.Bridge.Cfg", request.bridge_config_raw, BRIDGES)
    if not request.nominal_bridge_resistance > 0:
        raise StatusError(Code.INVALID_ATTRIBUTE_VALUE, f"Bridge of {request.nominal_bridge_resistance:g} ohm.")
    ratio = _one_of("AI.Bridge.Electrical.Units", request.electrical_units_raw, RATIOS)
    load = _one_of("AI.Bridge.Physical.Units", request.physical_units_raw, LOADS)
    electrical = ratio * (request.second_electrical_val - request.first_electrical_val)
    physical = load * (request.second_physical_val - request.first_physical_val)
    if electrical == 0 or physical == 0:
        raise StatusError(Code.LINEAR_REQUIRES_UNIQUE_POINTS)
    if request.first_electrical_val != 0 or request.first_physical_val != 0 or electrical / physical < 0:
        raise StatusError(Code.ATTR_NOT_SUPPORTED, "A line that does not rise from zero is not simulated.")
    return float(electrical / physical)


def _excitation(kind: MeasurementKind, request: Message, module: Module) -> tuple[int, float]:
    """NI's number of the source, and A or V of what the module supplies itself."""
    match kind.input:
        case Input.IEPE:
            source, asked, possible = request.current_excit_source_raw, request.current_excit_val, [0.0]
        case Input.BRIDGE:
            source, asked, possible = request.voltage_excit_source_raw, request.voltage_excit_val, []
        case _:
            return int(ExcitationSource.NONE.value), 0.0
    if source != ExcitationSource.INTERNAL.value:
        return int(source), 0.0
    if asked not in (*possible, *module.excitations):
        raise _not_a_value("AI.Excit.Val", asked, (*possible, *module.excitations))
    return int(source), float(asked)


def _one_of(name: str, number: int, values: Mapping[int, float]) -> float:
    if number not in values:
        raise _not_a_value(name, number, tuple(values))
    return values[number]


def _not_a_value(name: str, value: float, possible: tuple[float, ...]) -> StatusError:
    choice = ", ".join(f"{p:g}" for p in possible)
    return StatusError(
        Code.INVALID_ATTRIBUTE_VALUE, f"Property: {name}. Requested value: {value:g}. Possible values: {choice}."
    )
