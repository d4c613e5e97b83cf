"""What the rig needs of an acquisition instrument, whatever its driver: its devices, and tasks that give blocks."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

from daq.block import Block
from daq.channels import Channel, checked_table
from daq.errors import ChannelError, DaqError

RATE_TOLERANCE = 1e-6  # relative difference from the requested rate above which it is reported


@dataclass(frozen=True)
class Device:
    """A chassis or module as the driver lists it: name, product, serial number and its analog inputs."""

    name: str
    product_type: str
    serial: str
    inputs: tuple[str, ...]


@dataclass(frozen=True)
class Teds:
    """What a sensor says of itself by its electronic data sheet (IEEE 1451.4): numbers of maker, model and serial."""

    manufacturer: int
    model: int
    serial: int

    def is_of(self, serial: str) -> bool:
        """Whether `serial` of a certificate may be this sensor's: letters and leading zeros are not in a data sheet."""
        groups = re.findall(r"\d+", serial)
        return self.serial in {int(digits) for digits in (*groups, "".join(groups)) if digits}


@dataclass(frozen=True)
class EdgeTrigger:
    """Record when `channel` rises through `level` (its SI unit), from `pre_trigger` seconds before that on."""

    channel: str
    level: float
    pre_trigger: float


class DaqTask(ABC):
    """Channels on one clock, set up once. A context manager.

    Attributes:
        channels: in the order of the rows of a block.
        requested_rate: Hz.
        sample_rate: Hz, as the instrument coerced it; the blocks have this one.
        samples: per channel and block.
    """

    channels: tuple[Channel, ...]
    requested_rate: float
    sample_rate: float
    samples: int
    _range: tuple[tuple[float, float], ...]  # of the input of each channel, for a positive quantity

    @property
    def rate_note(self) -> str | None:
        """A note that the sample rate differs from the requested one; None if it does not."""
        if abs(self.sample_rate / self.requested_rate - 1) <= RATE_TOLERANCE:
            return None
        return f"{self.requested_rate:g} Hz were requested; the instrument samples at {self.sample_rate:.6g} Hz"

    @property
    def _names(self) -> str:
        return ", ".join(channel.name for channel in self.channels)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _traceback: object) -> None:
        if error is None:
            self.close()
        else:
            self._close_because_of(error)

    @abstractmethod
    def close(self) -> None:
        """Free the channels; DaqError if the instrument cannot be reached."""

    def _close_because_of(self, error: BaseException) -> None:
        """Free the channels because of `error`, which stays the error that is raised."""
        try:
            self.close()
        except DaqError as second:
            error.add_note(f"the task could not be cleared either: {second}")


class Triggered(DaqTask):
    """Blocks around a trigger: arm, wait for the block, any number of times."""

    @abstractmethod
    def arm(self) -> None:
        """Start, and return when the pre-trigger samples are there, so that a trigger counts; DaqError if it fails."""

    @abstractmethod
    def wait(self, timeout: float, cancelled: Callable[[], bool] | None = None) -> Block:
        """The block of the trigger that comes within `timeout` seconds.

        Args:
            timeout: s.
            cancelled: called repeatedly, in this thread: whether to give up.

        Raises:
            AcquisitionCancelledError: `cancelled` said so; the task is stopped and can be started again.
            TriggerTimeoutError: the block was not complete in time; the task is stopped and can be started again.
            OverrunError: samples were lost; the task is cleared.
            InstrumentAbsentError: instrument or server is gone; the task is cleared.
            DaqError: any other failure; the task is cleared.
        """


class OnDemand(DaqTask):
    """Blocks that start on demand, any number of times."""

    def input_range(self, name: str) -> tuple[float, float]:
        """Ends of the range of the input of channel `name`, in V, V/V or C, positive for a positive quantity."""
        return self._range[[channel.name for channel in self.channels].index(name)]

    @abstractmethod
    def is_dc_coupled(self, name: str) -> bool | None:
        """Whether the input of channel `name` lets a mean voltage pass; None where the instrument does not say."""

    @abstractmethod
    def record(
        self, duration: float | None = None, timeout: float = 5.0, cancelled: Callable[[], bool] | None = None
    ) -> Block:
        """The block that starts now; errors as for `Triggered.wait`.

        Args:
            duration: s; None for the duration of the block before.
            timeout: s that it may take beyond its duration.
            cancelled: called repeatedly, in this thread: whether to give up.
        """


class DaqInstrument(ABC):
    """The devices at one address. A context manager: leaving it closes the connection.

    Attributes:
        address: as it was configured.
        devices: as the driver lists them.
    """

    address: str
    devices: tuple[Device, ...]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Close the connection, also that of open tasks."""

    @abstractmethod
    def verify(self, channels: Sequence[Channel]) -> None:
        """Check that the instrument has these channels and supports their settings; ChannelError if not."""

    @abstractmethod
    def triggered(
        self, channels: Sequence[Channel], sample_rate: float, duration: float, trigger: EdgeTrigger
    ) -> Triggered:
        """A task that records `duration` s around a trigger, repeatedly.

        Raises DaqError where the instrument cannot do it; ChannelError for an error in the channel table.
        """

    @abstractmethod
    def record(self, channels: Sequence[Channel], sample_rate: float, duration: float) -> OnDemand:
        """A recorder of all `channels` on one clock, `duration` s at a time, repeatedly; errors as for `triggered`."""

    def teds(self, channel: Channel) -> Teds | None:  # noqa: ARG002 - overridden where the instrument can read one
        """The data sheet of the sensor that is connected to `channel` now; None where there is none.

        Raises DaqError where there is one that cannot be read.
        """
        return None

    def device_of(self, channel: Channel) -> Device:
        """The module of `channel`; ChannelError, which names the known ones, if device or input do not exist."""
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

    def _checked(self, channels: Sequence[Channel]) -> tuple[Channel, ...]:
        table = checked_table(channels)
        for channel in table:
            self.device_of(channel)
        return table
