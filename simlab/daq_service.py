"""The gRPC face of the simulated NI-DAQmx: the methods of NI's service that a reader of analog inputs needs.

Every method is named as in NI's service, takes a request and gives a response (None: one without
fields) or raises `StatusError`; `daq_server` puts them on the wire.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import grpc
import numpy as np
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import AcquisitionType, FillMode, Slope, TaskMode

from simlab.daq_attributes import (
    Attributes,
    channel_attributes,
    device_attributes,
    lookup,
    read_attributes,
    sensor_attributes,
    system_attributes,
    task_attributes,
    timing_attributes,
    trigger_attributes,
)
from simlab.daq_channels import (
    ACCELERATION,
    ACCELERATION_CHARGE,
    CHARGE,
    FORCE,
    FORCE_BRIDGE,
    VOLTAGE,
    MeasurementKind,
    virtual_channel,
)
from simlab.daq_errors import Code, DaqFaults, StatusError, meaning
from simlab.daq_modules import Counts, DataSheet, SimulatedChassis
from simlab.daq_tasks import AcquisitionBench, Task, Trigger

GIVEN = 16  # records
EXCHANGED = 7777  # serial number of a sensor that was put in the place of another

Message = Any  # protobuf messages carry no types
Method = Callable[["NiDaqmx", Message, grpc.ServicerContext], Message]


def _attribute_method(owner: str, name: str) -> Method:
    """The method called `name`, which gives an attribute of `owner`."""
    response = getattr(pb, f"{name}Response")
    field = "value_raw" if "value_raw" in response.DESCRIPTOR.fields_by_name else "value"

    def get(service: NiDaqmx, request: Message, _: grpc.ServicerContext) -> Message:
        return response(**{field: lookup(service._attributes(owner, request), request.attribute_raw)})

    return get


def _channel_method(kind: MeasurementKind) -> Callable[[NiDaqmx, Message, grpc.ServicerContext], None]:
    """The method that adds a channel of `kind` to a task."""

    def create(service: NiDaqmx, request: Message, _: grpc.ServicerContext) -> None:
        service._faults.check_device()
        service._task(request).add(virtual_channel(kind, request, service._chassis))

    return create


class NiDaqmx:
    """NI-DAQmx on one chassis in front of a bench; methods may be called from any thread.

    Attributes:
        given: the latest records, counts (channels, samples) as they left the converters, for tests that compare.
    """

    def __init__(self, chassis: SimulatedChassis, bench: AcquisitionBench, faults: DaqFaults) -> None:
        self._chassis = chassis
        self._bench = bench
        self._faults = faults
        self.given: deque[Counts] = deque(maxlen=GIVEN)
        self._tasks: dict[str, Task] = {}
        self._lock = threading.RLock()
        self._unnamed = 0

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks that were made and not cleared."""
        return tuple(self._tasks)

    def _attributes(self, owner: str, request: Message) -> Attributes:
        if owner in ("Device", "Read"):
            self._faults.check_device()
        match owner:
            case "SystemInfo":
                return system_attributes(self._chassis)
            case "Device":
                return device_attributes(self._chassis, request.device_name)
            case "PhysicalChan":
                return sensor_attributes(self._data_sheet(request.physical_channel))
            case "Chan":
                return channel_attributes(self._task(request), request.channel)
            case _:
                return TASK_ATTRIBUTES[owner](self._task(request))

    CreateAIForceIEPEChan = _channel_method(FORCE)
    CreateAIAccelChan = _channel_method(ACCELERATION)
    CreateAIVoltageChan = _channel_method(VOLTAGE)
    CreateAIForceBridgeTwoPointLinChan = _channel_method(FORCE_BRIDGE)
    CreateAIAccelChargeChan = _channel_method(ACCELERATION_CHARGE)
    CreateAIChargeChan = _channel_method(CHARGE)

    def ConfigureTEDS(self, request: Message, _: grpc.ServicerContext) -> None:
        """Look for the data sheet of a sensor; those of files are not simulated."""
        if request.file_path:
            raise StatusError(Code.TEDS_NOT_SUPPORTED, f"File: {request.file_path}, not simulated.")
        self._data_sheet(request.physical_channel)

    def _data_sheet(self, physical: str) -> DataSheet:
        self._faults.check_device()
        sheet = self._chassis.data_sheet(physical)
        if self._faults.present("cable_open", physical):
            raise StatusError(Code.TEDS_SENSOR_NOT_DETECTED, f"Physical channel name: {physical}.")
        return replace(sheet, serial=EXCHANGED) if self._faults.present("exchanged", physical) else sheet

    def GetErrorString(self, request: Message, _: grpc.ServicerContext) -> Message:
        """What a status code says."""
        return pb.GetErrorStringResponse(error_string=meaning(request.error_code))

    # -- tasks and channels

    def CreateTask(self, request: Message, _: grpc.ServicerContext) -> Message:
        """Make a task, or attach to the one of that name."""
        with self._lock:
            name = request.session_name
            if not name:
                name, self._unnamed = f"_unnamedTask<{self._unnamed:X}>", self._unnamed + 1
            new = name not in self._tasks
            if not new and request.initialization_behavior == 1:  # a new one was insisted on
                raise StatusError(Code.DUPLICATE_TASK, f"Task: {name}.")
            if new and request.initialization_behavior == 2:  # an old one was insisted on
                raise StatusError(Code.INVALID_TASK, f"Task: {name}.")
            if new:
                self._tasks[name] = Task(name, self._chassis, self._bench, self._faults)
        response = pb.CreateTaskResponse(new_session_initialized=new)
        response.task.name = name
        return response

    def ClearTask(self, request: Message, _: grpc.ServicerContext) -> None:
        """Stop a task and forget it."""
        with self._lock:
            self._task(request)
            task = self._tasks.pop(request.task.name)
        task.stop()

    def _task(self, request: Message) -> Task:
        try:
            return self._tasks[request.task.name]
        except KeyError:
            raise StatusError(Code.INVALID_TASK, f"Task: {request.task.name}.") from None

    # -- timing and triggers

    def CfgSampClkTiming(self, request: Message, _: grpc.ServicerContext) -> None:
        """Set rate, mode and number of samples."""
        if request.sample_mode_raw not in (AcquisitionType.FINITE.value, AcquisitionType.CONTINUOUS.value):
            raise StatusError(Code.INVALID_ATTRIBUTE_VALUE, f"SampQuant.SampMode: {request.sample_mode_raw}.")
        finite = request.sample_mode_raw == AcquisitionType.FINITE.value
        self._task(request).set_timing(request.rate, finite, request.samps_per_chan)

    def SetTimingAttributeUInt64(self, request: Message, _: grpc.ServicerContext) -> None:
        """Change the number of samples of a task whose clock is set."""
        if request.attribute_raw != pb.TIMING_ATTRIBUTE_SAMP_QUANT_SAMP_PER_CHAN:
            raise StatusError(Code.ATTR_NOT_SUPPORTED, f"Attribute: {request.attribute_raw:#x}, not simulated.")
        task = self._task(request)
        task.set_timing(task.rate, task.finite, request.value)

    def SetReadAttributeInt32(self, request: Message, _: grpc.ServicerContext) -> None:
        """Say from where reading counts."""
        if request.attribute_raw != pb.READ_ATTRIBUTE_RELATIVE_TO:
            raise StatusError(Code.ATTR_NOT_SUPPORTED, f"Attribute: {request.attribute_raw:#x}, not simulated.")
        self._task(request).read_relative_to(request.value_raw)

    def CfgAnlgEdgeRefTrig(self, request: Message, _: grpc.ServicerContext) -> None:
        """Keep samples from before an analog edge, and the rest from after it."""
        self._task(request).set_trigger(self._edge(request))

    def DisableRefTrig(self, request: Message, _: grpc.ServicerContext) -> None:
        """Acquire without a trigger."""
        self._task(request).set_trigger(None)

    def _edge(self, request: Message) -> Trigger:
        """The trigger that a request describes; the bench knows where the hammer's force rises only."""
        channel = self._task(request).channel(request.trigger_source)
        sensor = self._chassis.wiring.get(channel.physical)
        if sensor is None or sensor.signal != "hammer":
            raise StatusError(
                Code.INVALID_ANALOG_TRIG_SRC, f"Source: {channel.name}. The bench triggers on its hammer only."
            )
        falls = request.trigger_slope_raw == Slope.FALLING.value
        if falls and not (request.trigger_level < 0 and self._faults.present("inverted", channel.physical)):
            raise StatusError(Code.INVALID_ATTRIBUTE_VALUE, "Trigger slope. The bench triggers where force rises only.")
        return Trigger(channel, request.trigger_level, request.pretrigger_samples)

    # -- running

    def StartTask(self, request: Message, _: grpc.ServicerContext) -> None:
        """Start to acquire or to wait for the trigger."""
        self._start(self._task(request))

    def _start(self, task: Task) -> None:
        with self._lock:
            self._check_free(task)
            task.start()

    def _check_free(self, task: Task) -> None:
        for other in self._tasks.values():
            shared = set(task.modules) & set(other.modules)
            if other is not task and other.running and shared:
                raise StatusError(Code.PAL_RESOURCE_RESERVED, f"Device: {min(shared)}, by task {other.name}.")

    def StopTask(self, request: Message, _: grpc.ServicerContext) -> None:
        """Stop."""
        self._task(request).stop()

    def TaskControl(self, request: Message, _: grpc.ServicerContext) -> None:
        """Verify, reserve, commit, start, stop or abort."""
        task, action = self._task(request), TaskMode(request.action_raw)
        if action is TaskMode.TASK_START:
            self._start(task)
        elif action in (TaskMode.TASK_STOP, TaskMode.TASK_ABORT):
            task.stop()
        elif action in (TaskMode.TASK_VERIFY, TaskMode.TASK_RESERVE, TaskMode.TASK_COMMIT):
            task.verify()
            if action is not TaskMode.TASK_VERIFY:
                self._check_free(task)

    def IsTaskDone(self, request: Message, _: grpc.ServicerContext) -> Message:
        """Whether a finite task has all its samples."""
        self._faults.check_device()
        return pb.IsTaskDoneResponse(is_task_done=self._task(request).done)

    def WaitUntilTaskDone(self, request: Message, context: grpc.ServicerContext) -> None:
        """Wait until a finite task has all its samples."""
        task = self._task(request)
        if not task.done and not task.wait(task.samples - task.position, request.time_to_wait, context.is_active):
            raise StatusError(Code.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE, f"Task: {task.name}.")

    def ResetDevice(self, request: Message, _: grpc.ServicerContext) -> None:
        """Stop every task that uses a module, or any module where the chassis is named."""
        device_attributes(self._chassis, request.device_name)
        with self._lock:
            for task in self._tasks.values():
                if request.device_name in (*task.modules, self._chassis.name):
                    task.stop()

    # -- reading

    def ReadBinaryI32(self, request: Message, context: grpc.ServicerContext) -> Message:
        """Counts as the converters gave them."""
        counts, in_time = self._take(request, context)
        return pb.ReadBinaryI32Response(
            status=0 if in_time else Code.SAMPLES_NOT_YET_AVAILABLE,
            read_array=_laid_out(counts, request).tolist(),
            samps_per_chan_read=counts.shape[1],
        )

    def ReadAnalogF64(self, request: Message, context: grpc.ServicerContext) -> Message:
        """Values in the units of the channels."""
        counts, in_time = self._take(request, context)
        channels = self._task(request).channels
        scale = np.array([channel.module.per_count / channel.per_unit for channel in channels])
        return pb.ReadAnalogF64Response(
            status=0 if in_time else Code.SAMPLES_NOT_YET_AVAILABLE,
            read_array=_laid_out(counts * scale[:, None], request).tolist(),
            samps_per_chan_read=counts.shape[1],
        )

    def _take(self, request: Message, context: grpc.ServicerContext) -> tuple[np.ndarray[Any, Any], bool]:
        task = self._task(request)
        if not task.running:
            self._start(task)
        samples = request.num_samps_per_chan
        wanted = task.samples if samples < 0 else samples
        if wanted * len(task.channels) > request.array_size_in_samps:
            raise StatusError(Code.READ_BUFFER_TOO_SMALL, f"Room for {request.array_size_in_samps} samples.")
        counts, in_time = task.read(samples, request.timeout, context.is_active)
        self.given.append(counts)
        return counts, in_time


def _laid_out(values: np.ndarray[Any, Any], request: Message) -> np.ndarray[Any, Any]:
    """`values` (channels, samples) in one row, by channel or by scan as the request wants it."""
    by_scan = request.fill_mode_raw == FillMode.GROUP_BY_SCAN_NUMBER.value
    return (values.T if by_scan else values).ravel()


TASK_ATTRIBUTES = {
    "Task": task_attributes,
    "Read": read_attributes,
    "Timing": timing_attributes,
    "Trig": trigger_attributes,
}
ATTRIBUTE_TYPES = {
    "SystemInfo": ("String", "UInt32"),
    "Device": ("String", "UInt32", "Int32", "Double", "DoubleArray", "Bool"),
    "PhysicalChan": ("UInt32",),
    "Task": ("String", "UInt32"),
    "Chan": ("String", "Int32", "Double", "DoubleArray"),
    "Read": ("String", "Bool", "Int32", "UInt32", "UInt64"),
    "Timing": ("Double", "Int32", "UInt64"),
    "Trig": ("String", "Double", "UInt32"),
}
for _owner, _types in ATTRIBUTE_TYPES.items():
    for _type in _types:
        _name = f"Get{_owner}Attribute{_type}"
        setattr(NiDaqmx, _name, _attribute_method(_owner, _name))
