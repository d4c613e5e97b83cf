"""Attributes of the simulated NI-DAQmx: system, device, task, channel, read and timing attributes."""

from collections.abc import Callable, Mapping
from typing import Any

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import AcquisitionType, ChannelType, Coupling, ProductCategory

from simlab.daq_errors import Code, StatusError
from simlab.daq_modules import DataSheet, Input, Module, SimulatedChassis
from simlab.daq_tasks import Task

VERSION = (26, 5, 0)
DEFAULT_NUMBER_OF_SAMPLES_TO_READ = 0x31E8  # asked by clients of driver 24.5 on, without a name in the stubs

Value = Any  # str, int, float, bool or a list of floats, as the attribute has it
Attributes = Mapping[int, Callable[[], Value]]


def lookup(attributes: Attributes, number: int) -> Value:
    """Value of attribute `number`.

    Raises:
        StatusError: -200197, this simulation has no such attribute.
    """
    if number not in attributes:
        raise StatusError(Code.ATTR_NOT_SUPPORTED, f"Attribute: {number:#x}, not simulated.")
    return attributes[number]()


def system_attributes(chassis: SimulatedChassis) -> Attributes:
    """Of the whole driver."""
    return {
        pb.SYSTEM_ATTRIBUTE_NIDAQ_MAJOR_VERSION: lambda: VERSION[0],
        pb.SYSTEM_ATTRIBUTE_NIDAQ_MINOR_VERSION: lambda: VERSION[1],
        pb.SYSTEM_ATTRIBUTE_NIDAQ_UPDATE_VERSION: lambda: VERSION[2],
        pb.SYSTEM_ATTRIBUTE_DEV_NAMES: lambda: ", ".join((chassis.name, *(m.name for m in chassis.modules))),
    }


def device_attributes(chassis: SimulatedChassis, name: str) -> Attributes:
    """Of the chassis or one of its modules.

    Raises:
        StatusError: -200220, no such device.
    """
    if name == chassis.name:
        return {
            pb.DEVICE_ATTRIBUTE_PRODUCT_TYPE: lambda: chassis.product_type,
            pb.DEVICE_ATTRIBUTE_SERIAL_NUM: lambda: chassis.serial,
            pb.DEVICE_ATTRIBUTE_PRODUCT_CATEGORY: lambda: ProductCategory.COMPACT_DAQ_CHASSIS.value,
            pb.DEVICE_ATTRIBUTE_IS_SIMULATED: lambda: True,
            pb.DEVICE_ATTRIBUTE_AI_PHYSICAL_CHANS: lambda: "",
            pb.DEVICE_ATTRIBUTE_CHASSIS_MODULE_DEV_NAMES: lambda: ", ".join(m.name for m in chassis.modules if m.slot),
        }
    module = next((m for m in chassis.modules if m.name == name), None)
    if module is None:
        raise StatusError(Code.INVALID_DEVICE_ID, f"Device specified: {name}.")
    attributes: dict[int, Callable[[], Value]] = {
        pb.DEVICE_ATTRIBUTE_PRODUCT_TYPE: lambda: module.product_type,
        pb.DEVICE_ATTRIBUTE_SERIAL_NUM: lambda: module.serial,
        pb.DEVICE_ATTRIBUTE_PRODUCT_CATEGORY: lambda: (
            (ProductCategory.C_SERIES_MODULE if module.slot else ProductCategory.DYNAMIC_SIGNAL_ACQUISITION).value
        ),
        pb.DEVICE_ATTRIBUTE_IS_SIMULATED: lambda: True,
        pb.DEVICE_ATTRIBUTE_AI_PHYSICAL_CHANS: lambda: ", ".join(module.physical_channels),
        pb.DEVICE_ATTRIBUTE_AI_MAX_SINGLE_CHAN_RATE: lambda: module.fastest,
        pb.DEVICE_ATTRIBUTE_AI_MAX_MULTI_CHAN_RATE: lambda: module.fastest,
        pb.DEVICE_ATTRIBUTE_AI_BRIDGE_RNGS: lambda: _ranges(module, Input.BRIDGE),
        pb.DEVICE_ATTRIBUTE_AI_CHARGE_RNGS: lambda: _ranges(module, Input.CHARGE),
    }
    slot = {
        pb.DEVICE_ATTRIBUTE_COMPACT_DAQ_CHASSIS_DEV_NAME: lambda: chassis.name,
        pb.DEVICE_ATTRIBUTE_COMPACT_DAQ_SLOT_NUM: lambda: module.slot,
    }
    return attributes | slot if module.slot else attributes


def _ranges(module: Module, measured: Input) -> list[float]:
    return [-module.largest, module.largest] if measured in module.measures else []


def sensor_attributes(sheet: DataSheet) -> Attributes:
    """Of a physical channel with a sensor that has this data sheet."""
    return {
        pb.PHYSICALCHANNEL_ATTRIBUTE_PHYSICAL_CHAN_TEDS_MFG_ID: lambda: sheet.manufacturer,
        pb.PHYSICALCHANNEL_ATTRIBUTE_PHYSICAL_CHAN_TEDS_MODEL_NUM: lambda: sheet.model,
        pb.PHYSICALCHANNEL_ATTRIBUTE_PHYSICAL_CHAN_TEDS_SERIAL_NUM: lambda: sheet.serial,
    }


def task_attributes(task: Task) -> Attributes:
    """Of a task."""
    return {
        pb.TASK_ATTRIBUTE_NAME: lambda: task.name,
        pb.TASK_ATTRIBUTE_CHANNELS: lambda: _names(task),
        pb.TASK_ATTRIBUTE_NUM_CHANS: lambda: len(task.channels),
        pb.TASK_ATTRIBUTE_DEVICES: lambda: ", ".join(task.modules),
        pb.TASK_ATTRIBUTE_NUM_DEVICES: lambda: len(task.modules),
    }


def channel_attributes(task: Task, name: str) -> Attributes:
    """Of channel `name` of a task; of several, of the first.

    Raises:
        StatusError: -200428, no such channel.
    """
    channel = task.channel(name)
    module: Module = channel.module
    attributes: dict[int, Callable[[], Value]] = {
        pb.CHANNEL_ATTRIBUTE_PHYSICAL_CHAN_NAME: lambda: channel.physical,
        pb.CHANNEL_ATTRIBUTE_CHAN_TYPE: lambda: ChannelType.ANALOG_INPUT.value,
        pb.CHANNEL_ATTRIBUTE_AI_MEAS_TYPE: lambda: channel.measurement,
        pb.CHANNEL_ATTRIBUTE_AI_MIN: lambda: channel.minimum,
        pb.CHANNEL_ATTRIBUTE_AI_MAX: lambda: channel.maximum,
        pb.CHANNEL_ATTRIBUTE_AI_RNG_LOW: lambda: -module.largest,
        pb.CHANNEL_ATTRIBUTE_AI_RNG_HIGH: lambda: module.largest,
        pb.CHANNEL_ATTRIBUTE_AI_RESOLUTION: lambda: 24.0,
        pb.CHANNEL_ATTRIBUTE_AI_DEV_SCALING_COEFF: lambda: [0.0, module.per_count],
        pb.CHANNEL_ATTRIBUTE_AI_EXCIT_SRC: lambda: channel.excitation_source,
        pb.CHANNEL_ATTRIBUTE_AI_EXCIT_VAL: lambda: channel.excitation,
        pb.CHANNEL_ATTRIBUTE_AI_COUPLING: lambda: (
            Coupling.AC.value if channel.excitation and not channel.bridge else Coupling.DC.value
        ),
    }
    bridge = {
        pb.CHANNEL_ATTRIBUTE_AI_BRIDGE_CFG: lambda: channel.bridge,
        pb.CHANNEL_ATTRIBUTE_AI_BRIDGE_NOM_RESISTANCE: lambda: channel.resistance,
    }
    return attributes | bridge if channel.bridge else attributes


def read_attributes(task: Task) -> Attributes:
    """Of what a task has to read. Asking whether there are overloads clears them, as NI-DAQmx does."""

    def overloads_exist() -> bool:
        task.reported_overloads, task.new_overloads = task.new_overloads, frozenset()
        return bool(task.reported_overloads)

    def samples_to_read() -> int:
        return task.samples - task.position if task.finite else task.available

    return {
        pb.READ_ATTRIBUTE_CHANNELS_TO_READ: lambda: _names(task),
        pb.READ_ATTRIBUTE_NUM_CHANS: lambda: len(task.channels),
        pb.READ_ATTRIBUTE_AVAIL_SAMP_PER_CHAN: lambda: task.available,
        pb.READ_ATTRIBUTE_TOTAL_SAMP_PER_CHAN_ACQUIRED: lambda: task.total_acquired,
        pb.READ_ATTRIBUTE_OVERLOADED_CHANS_EXIST: overloads_exist,
        pb.READ_ATTRIBUTE_OVERLOADED_CHANS: lambda: ", ".join(
            c.name for c in task.channels if c.name in task.reported_overloads
        ),
        pb.READ_ATTRIBUTE_RELATIVE_TO: lambda: task.relative_to,
        DEFAULT_NUMBER_OF_SAMPLES_TO_READ: samples_to_read,
    }


def trigger_attributes(task: Task) -> Attributes:
    """Of the analog edge reference trigger of a task; none where it has no such trigger."""
    trigger = task.trigger
    if trigger is None:
        return {}
    return {
        pb.TRIGGER_ATTRIBUTE_ANLG_EDGE_REF_TRIG_SRC: lambda: trigger.channel.name,
        pb.TRIGGER_ATTRIBUTE_ANLG_EDGE_REF_TRIG_LVL: lambda: trigger.level,
        pb.TRIGGER_ATTRIBUTE_REF_TRIG_PRETRIG_SAMPLES: lambda: trigger.pretrigger,
    }


def timing_attributes(task: Task) -> Attributes:
    """Of the sample clock of a task."""
    modes = {True: AcquisitionType.FINITE.value, False: AcquisitionType.CONTINUOUS.value}
    return {
        pb.TIMING_ATTRIBUTE_SAMP_CLK_RATE: lambda: task.rate,
        pb.TIMING_ATTRIBUTE_SAMP_QUANT_SAMP_MODE: lambda: modes[task.finite],
        pb.TIMING_ATTRIBUTE_SAMP_QUANT_SAMP_PER_CHAN: lambda: task.samples,
    }


def _names(task: Task) -> str:
    return ", ".join(channel.name for channel in task.channels)
