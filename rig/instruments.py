"""The instruments of one laboratory: their addresses, how they are opened, and the limits in force."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field

from daq.channels import Channel
from daq.device import connect as connect_daq
from daq.errors import ChannelError
from daq.instrument import DaqInstrument
from daq.stream import OpenSource
from daq.streamed import StreamedInstrument
from rig.errors import RigError
from rig.events import Observer, ignore_event
from rig.tester.actuator_stop import stop_tester
from rig.tester.driver import Tester
from rig.tester.driver import connect as connect_tester
from rig.tester.limits import TesterLimits
from rig.tester.missing_functions import Lack
from rig.tester.register_map import OURS, TesterMap
from rig.tester.stop_latch import StopLatch
from rig.thermometer import Thermometer
from store.instrument import Instrument, StoredChannel

NO_TESTER = "this rig has no tester; write tester_url into jointlab.toml where it has one"
EXTERNAL = "external"
"""In place of the address of a tester that its own software drives: displacement and force alone are recorded of it."""
NOT_DRIVEN = "this machine is not driven from here"


@dataclass(frozen=True)
class Instruments:
    """Addresses, channel table and limits; nothing is open yet.

    Attributes:
        daq_address: "local", "grpc://host:port", or what `open_source` takes.
        tester_url: "tcp://host:port", "rtu:///dev/ttyS0?baudrate=115200", what the codec of its map takes, or
            `EXTERNAL`; None where the rig has no tester.
        thermometer_url: serial port or pyserial URL.
        channels: the channel table.
        limits: what the rig may ask of the tester.
        rig: name of the rig, for its stored limits and for the lock that the driving process holds.
        latch: STOP of the rig, for all that moves its actuator.
        unused: makes a context in which the run only waits, and others may poll the tester.
        tester_map: the registers of the tester's controller.
        tester_without: functions of `NEEDS_CONSENT` that the tester may lack.
        open_source: of the plug-in that acquires; None: NI-DAQmx.
        external_patience: s without a new point of an external tester, after which the operator is asked.
    """

    daq_address: str
    tester_url: str | None
    thermometer_url: str
    channels: tuple[Channel, ...]
    limits: TesterLimits = field(default_factory=TesterLimits)
    rig: str = "rig"
    latch: StopLatch = field(default_factory=StopLatch, compare=False)
    unused: Callable[[], AbstractContextManager[None]] = field(default=nullcontext, compare=False)
    tester_map: TesterMap = OURS
    tester_without: frozenset[Lack] = frozenset()
    open_source: OpenSource | None = None
    external_patience: float = 300.0

    @property
    def driven_url(self) -> str | None:
        """Address of the tester that is driven from here; None where there is none."""
        return None if self.is_external else self.tester_url

    @property
    def is_external(self) -> bool:
        """Whether the tester is driven by its own software."""
        return self.tester_url == EXTERNAL

    def channels_named(self, *names: str) -> tuple[Channel, ...]:
        """The channels of these names, in this order.

        Raises ChannelError where the table has no channel of that name; the message lists those that it has.
        """
        table = {channel.name: channel for channel in self.channels}
        missing = [name for name in names if name not in table]
        if missing:
            known = ", ".join(table) or "none"
            raise ChannelError(f"no channel {', '.join(missing)} in the channel table; it has {known}")
        return tuple(table[name] for name in names)

    def daq(self) -> DaqInstrument:
        """The acquisition instrument, open. Raises DaqError where it does not answer."""
        if self.open_source is None:
            return connect_daq(self.daq_address)
        return StreamedInstrument(self.daq_address, self.open_source)

    @contextmanager
    def acquisition(self) -> Iterator[tuple[DaqInstrument, Thermometer]]:
        """Chassis and thermometer, open until the context is left.

        Raises DaqError, RigError where an instrument does not answer.
        """
        with self.daq() as chassis, Thermometer(self.thermometer_url) as thermometer:
            yield chassis, thermometer

    @contextmanager
    def tester(self, observer: Observer = ignore_event) -> Iterator[Tester]:
        """The tester, driven until the context is left, which leaves the actuator at rest.

        Raises RigError where there is none, it does not answer, or it is not the tester that this rig knows.
        """
        with connect_tester(
            self._tester_url(),
            self.limits,
            observer=observer,  # until the actuator is at rest, or is not confirmed to be
            latch=self.latch,
            tester_map=self.tester_map,
            without=self.tester_without,
        ) as tester:
            yield tester

    def stop_tester(self, observer: Observer = ignore_event) -> None:
        """Bring the actuator to rest and switch hydraulics off, also where the tester may not be driven.

        Raises RigError where there is no tester, or the actuator was not confirmed at rest.
        """
        stop_tester(self._tester_url(), self.tester_map, observer)

    def _tester_url(self) -> str:
        if self.is_external:
            raise RigError(f"{NOT_DRIVEN}; use its own controls")
        if self.tester_url is None:
            raise RigError(NO_TESTER)
        return self.tester_url


def stored_channel(channel: Channel) -> StoredChannel:
    """A row of the channel table as the catalogue stores it, with the sensor and its calibration."""
    return StoredChannel(
        name=channel.name,
        physical=channel.physical,
        kind=channel.kind.value,
        unit=channel.unit,
        sensitivity=channel.sensitivity,
        minimum=channel.minimum,
        maximum=channel.maximum,
        excitation_current=channel.excitation_current or None,
        instrument=Instrument(
            kind=channel.kind.value,
            model=channel.name,
            serial=channel.serial,
            calibrated_on=channel.calibrated_on,
            sensitivity=channel.sensitivity,
            sensitivity_unit=channel.sensitivity_unit,
            certificate=channel.certificate or None,
            uncertainty=channel.uncertainty,
            due_on=channel.due_on,
        ),
        polarity=channel.polarity,
    )
