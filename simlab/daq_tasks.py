"""A task of the simulated NI-DAQmx: its channels, timing and trigger, and the samples it has acquired."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from nidaqmx.constants import ReadRelativeTo
from numpy.typing import NDArray

from simlab.clock import Clock
from simlab.daq_channels import BRIDGES, VirtualChannel
from simlab.daq_errors import Code, DaqFaults, StatusError
from simlab.daq_modules import (
    Counts,
    Module,
    Real,
    Sensor,
    SimulatedChassis,
    faulty_values,
    input_values,
    level_of_force,
)

TRIGGER_POLL = 1e-3  # wall seconds between looks for a blow
LONGEST_NAP = 20e-3  # wall seconds after which a wait looks for faults and for clients that left
FROM_THE_BEGINNING = (ReadRelativeTo.FIRST_SAMPLE.value, ReadRelativeTo.FIRST_PRETRIGGER_SAMPLE.value)
BEFORE, AFTER = 32, 8  # samples searched around a crossing: the anti-alias filter rings before an edge
BUFFER_SIZES = ((100.0, 1_000), (10_000.0, 10_000), (1_000_000.0, 100_000))  # NI's default by rate


@dataclass(frozen=True)
class Trigger:
    """An edge through `level` (in its unit) of `channel`, away from zero; `pretrigger` samples are kept before it."""

    channel: VirtualChannel
    level: float
    pretrigger: int


class AcquisitionBench(Protocol):
    """What a task needs of the bench."""

    @property
    def clock(self) -> Clock:
        """The clock of the bench."""

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        """Signals of the hammer rig, SI (samples,), at bench times start + i / rate."""

    def tester_signals(self, times: Real) -> dict[str, Real]:
        """Signals of the tester, SI (samples,), at bench `times`."""

    def next_crossing(self, channel: str, level: float, after: float) -> float | None:
        """Bench time later than `after` when signal `channel` rises through `level`; None while not known."""


class Task:
    """A task; every method may be called from any thread."""

    def __init__(self, name: str, chassis: SimulatedChassis, bench: AcquisitionBench, faults: DaqFaults) -> None:
        self.name = name
        self.chassis = chassis
        self.bench = bench
        self.faults = faults
        self.channels: tuple[VirtualChannel, ...] = ()
        self.trigger: Trigger | None = None
        self.rate = 1000.0
        self.finite = True
        self.samples = 1000
        self.new_overloads: frozenset[str] = frozenset()
        self.reported_overloads: frozenset[str] = frozenset()
        self.position = 0  # samples of the record that were read
        self.relative_to = ReadRelativeTo.CURRENT_READ_POSITION.value
        self._converted: tuple[int, Counts] | None = None  # what was read last, and from which sample on
        self._changed = threading.Condition(threading.RLock())
        self._started: float | None = None  # bench time
        self._origin: float | None = None  # bench time of the first sample of the record, once it is known

    # -- configuration

    def add(self, channel: VirtualChannel) -> None:
        """Add a channel.

        Raises:
            StatusError: -200489, one of that name or on that input is there already; -200479, the task runs.
        """
        with self._changed:
            self._check_stopped()
            if any(channel.name == other.name or channel.physical == other.physical for other in self.channels):
                raise StatusError(Code.CHAN_ALREADY_IN_TASK, f"Channel: {channel.name}.")
            self.channels = (*self.channels, channel)

    def _check_stopped(self) -> None:
        if self.running:
            raise StatusError(Code.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING, f"Task: {self.name}.")

    def channel(self, name: str) -> VirtualChannel:
        """The channel called `name`; of several, or of none named, the first.

        Raises:
            StatusError: -200428, no such channel.
        """
        wanted = name.split(",")[0].strip()
        for channel in self.channels:
            if wanted in ("", channel.name):
                return channel
        raise StatusError(Code.LAB_VIEW_INVALID_TASK_OR_CHANS, f"Channel: {wanted}.")

    def set_timing(self, rate: float, finite: bool, samples: int) -> None:
        """Set the sample clock; all modules run on the time base of the first channel's.

        Raises:
            StatusError: -200478 without channels, -200077 for a rate or a number of samples out of range, -200479 when
                the task runs.
        """
        with self._changed:
            self._check_stopped()
            if samples < 2:
                raise StatusError(
                    Code.INVALID_ATTRIBUTE_VALUE, f"Property: SampQuant.SampPerChan. Requested: {samples}."
                )
            self.rate = self._first_module().coerced_rate(rate)
            self.finite = finite
            self.samples = samples

    def set_trigger(self, trigger: Trigger | None) -> None:
        """Set the trigger, or none.

        Raises:
            StatusError: -200479, the task runs.
        """
        with self._changed:
            self._check_stopped()
            self.trigger = trigger

    def read_relative_to(self, place: int) -> None:
        """Let each reading begin at `place`, NI's number: where the last one ended, or the beginning of the record.

        Raises:
            StatusError: -200077, anywhere else.
        """
        if place not in (ReadRelativeTo.CURRENT_READ_POSITION.value, *FROM_THE_BEGINNING):
            raise StatusError(Code.INVALID_ATTRIBUTE_VALUE, f"Property: RelativeTo. Requested: {place}.")
        self.relative_to = place

    def verify(self) -> None:
        """Check that the task as it stands can run.

        Raises:
            StatusError: -200478 without channels, -200077 for more pre-trigger samples than the record has room for,
                -201003 when the chassis is gone.
        """
        self.faults.check_device()
        self._first_module()
        pretrigger = self.trigger.pretrigger if self.trigger else None
        if pretrigger is not None and not 2 <= pretrigger <= self.samples - 2:
            raise StatusError(
                Code.INVALID_ATTRIBUTE_VALUE,
                f"Property: RefTrig.PretrigSamples. Requested value: {pretrigger}. "
                f"Minimum value: 2. Maximum value: {self.samples - 2}.",
            )

    def _first_module(self) -> Module:
        if not self.channels:
            raise StatusError(Code.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK, f"Task: {self.name}.")
        return self.channels[0].module

    @property
    def modules(self) -> tuple[str, ...]:
        """Names of the modules in use."""
        return tuple(dict.fromkeys(channel.module.name for channel in self.channels))

    @property
    def buffer_size(self) -> int:
        """Samples per channel that may wait to be read: NI's defaults, or those of a record where it is longer."""
        default = next((size for fastest, size in BUFFER_SIZES if self.rate <= fastest), 1_000_000)
        return max(default, self.samples)

    # -- running

    @property
    def running(self) -> bool:
        """Started and not yet stopped."""
        return self._started is not None

    def start(self) -> None:
        """Start to acquire, or to wait for the trigger.

        Raises:
            StatusError: -200479 when it runs already, -200077 for a trigger level in the noise; and what
                `verify` raises.
        """
        with self._changed:
            self._check_stopped()
            self.verify()
            self._started = self.bench.clock.now()
            self._origin = None if self.trigger else self._started
            self.position, self._converted = 0, None
            self.new_overloads = frozenset()
            try:
                self._find_origin()  # finds a trigger level that makes no sense
            except StatusError:
                self._started = None
                raise
            self._changed.notify_all()

    def stop(self) -> None:
        """Stop; samples that were not read are lost."""
        with self._changed:
            self._started = None
            self._changed.notify_all()

    @property
    def done(self) -> bool:
        """Whether a finite task has all its samples; a stopped task is done."""
        return not self.running or (self.finite and self.acquired >= self.samples)

    @property
    def total_acquired(self) -> int:
        """Samples per channel since the start, with those before the trigger that the record will not hold."""
        with self._changed:
            if self._started is None:
                return 0
            total = self._samples_since(self._started)
            return min(total, self.samples) if self.finite and self.trigger is None else total

    @property
    def acquired(self) -> int:
        """Samples per channel of the record; around a reference trigger it counts once it is complete."""
        with self._changed:
            origin = self._find_origin()
            if origin is None:
                return 0
            acquired = self._samples_since(origin)
            if self.trigger is not None and acquired < self.samples:
                return 0
            return min(acquired, self.samples) if self.finite else acquired

    @property
    def available(self) -> int:
        """Samples per channel that can be read now."""
        with self._changed:
            return max(0, self.acquired - self.position)

    def _samples_since(self, bench_time: float) -> int:
        return max(0, int((self.bench.clock.now() - bench_time) * self.rate + 1e-6))

    def _find_origin(self) -> float | None:
        """Bench time of the first sample of the record; None while the trigger has not come."""
        if self._origin is None and self._started is not None and self.trigger is not None:
            index = self._triggered(self.trigger, self._started)
            if index is not None:
                self._origin = self._started + (index - self.trigger.pretrigger) / self.rate
        return self._origin if self.running else None

    def _triggered(self, trigger: Trigger, started: float) -> int | None:
        """Index, from the start, of the first sample after the trigger; None while it has not come."""
        sensor = self._sensor(trigger.channel)
        if sensor is None or (sensor.fed and not trigger.channel.excitation):
            return None
        channel = trigger.channel
        present = partial(self.faults.present, channel=channel.physical)
        level = level_of_force(trigger.level * channel.per_unit, present, channel.module)
        if level is None:
            return None
        level /= sensor.sensitivity
        try:
            return rising_sample(self.bench, level, started, self.rate, trigger.pretrigger)
        except ValueError as error:
            raise StatusError(Code.INVALID_ATTRIBUTE_VALUE, f"Trigger level: {trigger.level:g}. {error}.") from error

    def wait(self, samples: int, timeout: float, alive: Callable[[], bool]) -> bool:
        """Wait until `samples` can be read; False when the timeout (wall s, negative for ever) came first.

        Raises:
            StatusError: -201003 when the chassis goes meanwhile, -200278 when the task is stopped meanwhile.
        """
        deadline = math.inf if timeout < 0 else time.monotonic() + timeout
        with self._changed:
            while True:
                self.faults.check_device()
                if not self.running:
                    raise StatusError(Code.SAMPLES_WILL_NEVER_BE_AVAILABLE, f"Task {self.name} was stopped.")
                if self.available >= samples:
                    return True
                remaining = deadline - time.monotonic()
                if remaining <= 0 or not alive():
                    return False
                self._changed.wait(min(self._nap(samples), remaining))

    def _nap(self, samples: int) -> float:
        if self._origin is None:
            return TRIGGER_POLL
        clock = self.bench.clock
        ready = self._origin + (self.position + samples) / self.rate
        return min(max(clock.wall(ready - clock.now()), 50e-6), LONGEST_NAP)

    def read(self, samples: int, timeout: float, alive: Callable[[], bool]) -> tuple[Counts, bool]:
        """Counts (channels, samples) of the next `samples`, -1 for all; and whether they came in time.

        Too late, the counts are those that did come.

        Raises:
            StatusError: -200278 when the task has no more, -200279 when they were overwritten, and what `wait` raises.
        """
        with self._changed:
            if not self.running:
                self.start()
            if self.relative_to in FROM_THE_BEGINNING:
                self.position = 0
            if samples < 0:
                samples = self.samples - self.position if self.finite else self.available
            if self.finite and self.position + samples > self.samples:
                raise StatusError(Code.SAMPLES_WILL_NEVER_BE_AVAILABLE, f"Task: {self.name}.")
            in_time = self.wait(samples, timeout, alive)
            self.faults.check_overrun()
            if not self.finite and self.available > self.buffer_size:
                raise StatusError(Code.SAMPLES_NO_LONGER_AVAILABLE, f"Task: {self.name}.")
            counts = self._again(self.position, samples if in_time else min(samples, self.available))
            self.position += counts.shape[1]
            return counts, in_time

    # -- conversion

    def _sensor(self, channel: VirtualChannel) -> Sensor | None:
        """What is connected to `channel`."""
        if self.faults.present("cable_open", channel.physical):
            return None
        return self.chassis.wiring.get(channel.physical)

    def _again(self, first: int, samples: int) -> Counts:
        """Counts as `_convert` gives them, of the converter's memory where they were read before."""
        if self._converted is None or self._converted[0] != first or self._converted[1].shape[1] != samples:
            self._converted = first, self._convert(first, samples)
        return self._converted[1]

    def _convert(self, first: int, samples: int) -> Counts:
        """Counts (channels, samples) of the record from its sample `first` on; notes overloads."""
        counts: NDArray[np.int32] = np.empty((len(self.channels), samples), dtype=np.int32)
        if samples == 0 or self._origin is None:
            return counts
        start = self._origin + first / self.rate
        sensors = [self._sensor(channel) for channel in self.channels]
        rigs = {sensor.rig for sensor in sensors if sensor is not None}
        signals: dict[str, Real] = {}
        if "hammer" in rigs:
            signals |= self.bench.hammer_signals(start, self.rate, samples)
        if "tester" in rigs:
            signals |= self.bench.tester_signals(start + np.arange(samples) / self.rate)
        for row, (channel, sensor) in enumerate(zip(self.channels, sensors, strict=True)):
            signal = signals.get(sensor.signal) if sensor else None
            excited = channel.excitation > 0
            number = round(start * self.rate)
            values = input_values(channel.physical, channel.module, sensor, signal, excited, number, samples)
            values = values * BRIDGES.get(channel.bridge, 1.0)
            present = partial(self.faults.present, channel=channel.physical)
            values = faulty_values(values, present, channel.physical, channel.module, start, self.rate)
            if np.max(np.abs(values)) > channel.module.largest:
                self.new_overloads |= {channel.name}
            counts[row] = channel.module.counts(values)
        return counts


def rising_sample(bench: AcquisitionBench, level: float, start: float, rate: float, earliest: int) -> int | None:
    """Index of the first sample of ``hammer``, `earliest` or later, at or above `level` N after one below it.

    Sample i is that of bench time start + i / rate. As in the instrument, the trigger is found on the samples: the
    bench only tells where to look. None while no such edge has passed.

    Raises:
        ValueError: the bench cannot tell a crossing of that level.
    """
    after = start + earliest / rate
    while (crossing := bench.next_crossing("hammer", level, after)) is not None and crossing <= bench.clock.now():
        first = max(math.ceil((crossing - start) * rate) - BEFORE, earliest - 1, 0)
        samples = bench.hammer_signals(start + first / rate, rate, BEFORE + AFTER)["hammer"]
        edges = np.flatnonzero((samples[:-1] < level) & (samples[1:] >= level))
        if edges.size:
            return first + int(edges[0]) + 1
        after = crossing
    return None
