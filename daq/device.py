"""The instrument: connect to a chassis, locally or over the network, and open tasks on it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import TracebackType

import nidaqmx
from nidaqmx.constants import TaskMode
from nidaqmx.system import System

from daq.channels import Channel, checked_table
from daq.errors import ChannelError, DaqError, InstrumentAbsentError
from daq.grpc_link import open_line
from daq.nidaqmx_errors import translated
from daq.readback import agreed
from daq.session import forget, open_task
from daq.task import EdgeTrigger, Recorder, TriggeredTask, add_channels

TIMEOUT = 5.0  # s


@dataclass(frozen=True)
class Device:
    """A chassis or module as the driver lists it: name, product, serial number and its analog inputs."""

    name: str
    product_type: str
    serial: str
    inputs: tuple[str, ...]


def connect(address: str, timeout: float = TIMEOUT) -> Chassis:
    """Connect to the instrument.

    Args:
        address: "local" for the NI-DAQmx driver of this computer, or "grpc://host:port" of an NI gRPC device server.
        timeout: seconds that a server has to answer each call, beyond what the call is meant to wait.

    Raises:
        DaqError: the address is neither.
        InstrumentAbsentError: no driver, no server, or no device.
    """
    if address == "local":
        return Chassis(address, None, lambda: None)
    match = re.fullmatch(r"grpc://([^/\s]+:\d+)", address)
    if match is None:
        raise DaqError(f"address {address!r}: write local, or grpc://host:port of an NI gRPC device server")
    channel, close = open_line(match[1], timeout)
    options = nidaqmx.GrpcSessionOptions(channel, "")
    try:
        return Chassis(address, options, close)
    except DaqError:
        close()
        raise


def _devices_of(system: System) -> tuple[Device, ...]:
    return tuple(
        Device(
            device.name,
            device.product_type,
            f"{device.serial_num:08X}",
            tuple(device.ai_physical_chans.channel_names),
        )
        for device in system.devices
    )


class Chassis:
    """The devices at one address. A context manager: leaving it closes the connection.

    Attributes:
        address: where it is.
        devices: what is there.

    Raises:
        InstrumentAbsentError: the driver or the server lists no device.
    """

    def __init__(
        self, address: str, options: nidaqmx.GrpcSessionOptions | None, close_line: Callable[[], None]
    ) -> None:
        self.address = address
        self._options = options
        self._close_line = close_line
        with translated(f"instrument at {address}"):
            system = System.local() if options is None else System.remote(options)
            self.devices = agreed(f"devices at {address}", lambda: _devices_of(system))
        if not self.devices:
            raise InstrumentAbsentError(f"instrument at {address}: no device; check power and cable of the chassis")

    def __enter__(self) -> Chassis:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; tasks that are open lose it."""
        self._close_line()

    def device_of(self, channel: Channel) -> Device:
        """The module that `channel` is on.

        Raises:
            ChannelError: there is no such device, or it has no such input; what there is, is named.
        """
        name = channel.physical.partition("/")[0]
        device = next((d for d in self.devices if d.name == name), None)
        if device is None:
            known = ", ".join(f"{d.name} ({d.product_type})" for d in self.devices)
            raise ChannelError(
                f"channel {channel.name!r} is on {channel.physical}, but there is no device {name!r} at "
                f"{self.address}; there are {known}"
            )
        if channel.physical not in device.inputs:
            raise ChannelError(
                f"channel {channel.name!r} is on {channel.physical}, but {name} ({device.product_type}) has only "
                f"{', '.join(device.inputs) or 'no analog input'}"
            )
        return device

    def verify(self, channels: Sequence[Channel]) -> None:
        """Check that the instrument has these channels and can do what the table asks of each.

        Raises:
            ChannelError: what does not fit, and what there is instead.
        """
        table = checked_table(channels)
        for channel in table:
            self.device_of(channel)
        with translated(f"channel table at {self.address}"):
            task, session = open_task(self._options, table)
            try:
                add_channels(task, table)
                task.control(TaskMode.TASK_VERIFY)
            finally:
                forget(session)
                task.close()

    def triggered(
        self, channels: Sequence[Channel], sample_rate: float, duration: float, trigger: EdgeTrigger
    ) -> TriggeredTask:
        """A task that records `duration` s around a trigger, again and again; see `TriggeredTask`.

        Raises:
            DaqError: the instrument cannot do it; ChannelError for what the channel table has wrong.
        """
        self._look_up(channels)
        return TriggeredTask(self._options, channels, sample_rate, duration, trigger)

    def record(self, channels: Sequence[Channel], sample_rate: float, duration: float) -> Recorder:
        """A recorder of all `channels` on one clock, `duration` s at a time, again and again; see `Recorder`.

        Raises:
            DaqError: the instrument cannot do it; ChannelError for what the channel table has wrong.
        """
        self._look_up(channels)
        return Recorder(self._options, channels, sample_rate, duration)

    def _look_up(self, channels: Sequence[Channel]) -> None:
        for channel in checked_table(channels):
            self.device_of(channel)
