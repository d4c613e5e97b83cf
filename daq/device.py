"""The instrument: a chassis, local or on the network, and its tasks."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

import nidaqmx
from nidaqmx.constants import TaskMode
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.system import PhysicalChannel, System

from daq.channels import Channel
from daq.errors import DaqError, InstrumentAbsentError
from daq.grpc_link import open_channel
from daq.instrument import DaqInstrument, Device, EdgeTrigger, Teds
from daq.nidaqmx_errors import translated
from daq.readback import agreed
from daq.session import forget, open_task
from daq.task import NOT_SUPPORTED, Recorder, TriggeredTask, add_channels

TIMEOUT = 5.0  # s
NO_TEDS = (
    *NOT_SUPPORTED,
    DAQmxErrors.TEDS_SENSOR_NOT_DETECTED,
    DAQmxErrors.TEDS_NOT_SUPPORTED,
    DAQmxErrors.NO_TEDS_TERMINAL_BLOCK,
    DAQmxErrors.CANT_CONFIGURE_TEDS_FOR_CHAN,
)


def connect(address: str, timeout: float = TIMEOUT) -> Chassis:
    """Connect to the instrument.

    Args:
        address: "local" for the NI-DAQmx driver of this computer, or "grpc://host:port" of an NI gRPC device server.
        timeout: seconds for the answer of a server to each call, in addition to the time that the call itself may wait.

    Raises:
        DaqError: the address has another form.
        InstrumentAbsentError: no driver, no server, or no device.
    """
    if address == "local":
        return Chassis(address, None, lambda: None)
    match = re.fullmatch(r"grpc://([^/\s]+:\d+)", address)
    if match is None:
        raise DaqError(f"address {address!r}: write local, or grpc://host:port of an NI gRPC device server")
    channel, close = open_channel(match[1], timeout)
    options = nidaqmx.GrpcSessionOptions(channel, "")
    try:
        return Chassis(address, options, close)
    except DaqError:
        close()
        raise


def _devices_of(system: System) -> tuple[Device, ...]:
    return tuple(
        Device(each.name, each.product_type, f"{each.serial_num:08X}", tuple(each.ai_physical_chans.channel_names))
        for each in system.devices
    )


class Chassis(DaqInstrument):
    """The devices that NI-DAQmx has at one address.

    Raises:
        InstrumentAbsentError: the driver or the server lists no device.
    """

    def __init__(
        self, address: str, options: nidaqmx.GrpcSessionOptions | None, close_channel: Callable[[], None]
    ) -> None:
        self.address = address
        self._options = options
        self._close_channel = close_channel
        with translated(f"instrument at {address}"):
            system = System.local() if options is None else System.remote(options)
            self.devices = agreed(f"devices at {address}", lambda: _devices_of(system))
        if not self.devices:
            raise InstrumentAbsentError(f"instrument at {address}: no device; check power and cable of the chassis")

    def close(self) -> None:
        """Close the connection, also that of open tasks."""
        self._close_channel()

    def verify(self, channels: Sequence[Channel]) -> None:
        """Check that the instrument has these channels and supports their settings; ChannelError if not."""
        table = self._checked(channels)
        with translated(f"channel table at {self.address}"):
            task, session = open_task(self._options, table)
            try:
                add_channels(task, table)
                task.control(TaskMode.TASK_VERIFY)
            finally:
                forget(session)
                task.close()

    def teds(self, channel: Channel) -> Teds | None:
        """The data sheet of the sensor, read again at each call, so that none of an earlier sensor counts."""
        where = f"TEDS of channel {channel.name!r} on {channel.physical}"
        with translated(where):
            sensor = PhysicalChannel(channel.physical, grpc_options=self._options)
            try:
                sensor.configure_teds()
                return agreed(where, lambda: Teds(sensor.teds_mfg_id, sensor.teds_model_num, sensor.teds_serial_num))
            except nidaqmx.errors.DaqError as error:
                if error.error_code not in NO_TEDS:
                    raise
                return None

    def triggered(
        self, channels: Sequence[Channel], sample_rate: float, duration: float, trigger: EdgeTrigger
    ) -> TriggeredTask:
        """A task with the trigger of the instrument."""
        return TriggeredTask(self._options, self._checked(channels), sample_rate, duration, trigger)

    def record(self, channels: Sequence[Channel], sample_rate: float, duration: float) -> Recorder:
        """A recorder of all `channels`."""
        return Recorder(self._options, self._checked(channels), sample_rate, duration)
