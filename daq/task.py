"""Tasks: set up once, they acquire any number of blocks."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from functools import partial

import nidaqmx
import nidaqmx.errors
import numpy as np
import numpy.typing as npt
from nidaqmx.constants import (
    AccelChargeSensitivityUnits,
    AccelSensitivityUnits,
    AccelUnits,
    AcquisitionType,
    BridgeElectricalUnits,
    BridgePhysicalUnits,
    ChargeUnits,
    Coupling,
    ExcitationSource,
    ForceIEPESensorSensitivityUnits,
    ForceUnits,
    ReadRelativeTo,
    Slope,
    TaskMode,
)
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.stream_readers import AnalogUnscaledReader

from daq.block import Block, at_range_ends
from daq.channels import Channel, ChannelKind, checked_table
from daq.errors import AcquisitionCancelledError, ChannelError, DaqError, TriggerTimeoutError
from daq.input_scaling import range_of, scaling_of
from daq.instrument import DaqTask, EdgeTrigger, OnDemand, Triggered
from daq.nidaqmx_errors import translated
from daq.readback import agreed, bridge_configuration, check_channels, check_samples, check_trigger
from daq.session import forget, open_task

STANDARD_GRAVITY = 9.80665
LONGEST_ARMING_SLEEP = 5e-3  # s
CANCELLATION_POLL = 0.05  # s, between two questions whether to cancel
ARMING_TIMEOUT = 5.0  # s beyond the pre-trigger time itself
NOT_SUPPORTED = (DAQmxErrors.ATTR_NOT_SUPPORTED, DAQmxErrors.ATTRIBUTE_NOT_SUPPORTED_IN_TASK_CONTEXT)


def add_channels(task: nidaqmx.Task, channels: Sequence[Channel]) -> None:
    """Add `channels` to `task`, each by its kind; ChannelError if the instrument refuses one."""
    for channel in channels:
        with translated(f"channel {channel.name!r} on {channel.physical}"):
            _add_channel(task.ai_channels, channel)


def _add_channel(inputs: nidaqmx.task.collections.AIChannelCollection, channel: Channel) -> None:
    source = ExcitationSource.INTERNAL if channel.excitation_current else ExcitationSource.NONE
    iepe = {
        "min_val": channel.minimum,
        "max_val": channel.maximum,
        "current_excit_source": source,
        "current_excit_val": channel.excitation_current,
    }
    at_input = {"min_val": channel.minimum * channel.sensitivity, "max_val": channel.maximum * channel.sensitivity}
    match channel.kind:
        case ChannelKind.FORCE_IEPE:
            inputs.add_ai_force_iepe_chan(
                channel.physical,
                channel.name,
                units=ForceUnits.NEWTONS,
                sensitivity=channel.sensitivity * 1e3,
                sensitivity_units=ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_NEWTON,
                **iepe,
            )
        case ChannelKind.ACCELERATION_IEPE:
            inputs.add_ai_accel_chan(
                channel.physical,
                channel.name,
                units=AccelUnits.METERS_PER_SECOND_SQUARED,
                sensitivity=channel.sensitivity * STANDARD_GRAVITY * 1e3,
                sensitivity_units=AccelSensitivityUnits.MILLIVOLTS_PER_G,
                **iepe,
            )
        case ChannelKind.FORCE_BRIDGE:
            _add_bridge(inputs, channel)
        case ChannelKind.ACCELERATION_CHARGE:
            inputs.add_ai_accel_charge_chan(
                channel.physical,
                channel.name,
                min_val=channel.minimum,
                max_val=channel.maximum,
                units=AccelUnits.METERS_PER_SECOND_SQUARED,
                sensitivity=channel.sensitivity * 1e12,
                sensitivity_units=AccelChargeSensitivityUnits.PICO_COULOMBS_PER_METERS_PER_SECOND_SQUARED,
            )
        case ChannelKind.FORCE_CHARGE:
            inputs.add_ai_charge_chan(channel.physical, channel.name, units=ChargeUnits.COULOMBS, **at_input)
        case ChannelKind.VOLTAGE:
            inputs.add_ai_voltage_chan(channel.physical, channel.name, **at_input)


def _add_bridge(inputs: nidaqmx.task.collections.AIChannelCollection, channel: Channel) -> None:
    assert channel.bridge is not None  # as the channel was checked
    largest = max(abs(channel.minimum), abs(channel.maximum))
    inputs.add_ai_force_bridge_two_point_lin_chan(
        channel.physical,
        channel.name,
        min_val=channel.minimum,
        max_val=channel.maximum,
        units=ForceUnits.NEWTONS,
        bridge_config=bridge_configuration(channel.bridge),
        voltage_excit_source=ExcitationSource.INTERNAL,
        voltage_excit_val=channel.bridge.excitation,
        nominal_bridge_resistance=channel.bridge.resistance,
        first_electrical_val=0.0,
        second_electrical_val=channel.sensitivity * largest,
        electrical_units=BridgeElectricalUnits.VOLTS_PER_VOLT,
        first_physical_val=0.0,
        second_physical_val=largest,
        physical_units=BridgePhysicalUnits.NEWTONS,
    )


class _FiniteTask(DaqTask):
    """A finite acquisition of several channels on one clock, set up once.

    Any error but a timeout or a cancellation clears the task, so that the instrument is free again; after that the task
    cannot be used.
    """

    def __init__(
        self,
        options: nidaqmx.GrpcSessionOptions | None,
        channels: Sequence[Channel],
        sample_rate: float,
        duration: float,
        trigger: EdgeTrigger | None = None,
    ) -> None:
        self.channels = checked_table(channels)
        self.requested_rate = sample_rate
        self._overload_attribute = True
        self._open = True
        self._is_remote = options is not None
        with translated("new task"):
            self._task, self._session = open_task(options, self.channels)
        try:
            add_channels(self._task, self.channels)
            with translated(f"{self._names} at {sample_rate:g} Hz"):
                self._set_up(sample_rate, duration, trigger)
        except DaqError as error:
            self._close_because_of(error)
            raise

    def _set_up(self, sample_rate: float, duration: float, trigger: EdgeTrigger | None) -> None:
        timing = self._task.timing
        timing.cfg_samp_clk_timing(sample_rate, sample_mode=AcquisitionType.FINITE, samps_per_chan=2)
        self.sample_rate = agreed("sample rate", lambda: float(timing.samp_clk_rate))
        self.samples = max(2, round(duration * self.sample_rate))
        timing.samp_quant_samp_per_chan = self.samples
        self._pre_trigger = 0
        if trigger is not None:
            self._set_trigger(trigger)
        inputs = [(channel, self._task.ai_channels[channel.name]) for channel in self.channels]
        self._range = tuple(agreed("range", partial(range_of, self._task, *each)) for each in inputs)
        self._scaling = tuple(
            agreed("scaling", partial(scaling_of, *each, largest))
            for each, (_, largest) in zip(inputs, self._range, strict=True)
        )
        check_channels(self._task, self.channels)
        check_samples(self._task, self.samples)
        if self._is_remote:  # so that a record can be read twice
            first = ReadRelativeTo.FIRST_PRETRIGGER_SAMPLE if self._pre_trigger else ReadRelativeTo.FIRST_SAMPLE
            self._task.in_stream.relative_to = first
        self._reader = AnalogUnscaledReader(self._task.in_stream)
        self._reader.verify_array_shape = False  # the array is ours; spares a call a block
        self._task.control(TaskMode.TASK_COMMIT)  # so that each start is quick

    def _set_trigger(self, trigger: EdgeTrigger) -> None:
        self._pre_trigger = max(2, round(trigger.pre_trigger * self.sample_rate))
        source = next((c for c in self.channels if c.name == trigger.channel), None)
        if source is None:
            raise ChannelError(f"trigger on {trigger.channel!r}: not one of {self._names}")
        in_unit_of_input = source.kind in (ChannelKind.VOLTAGE, ChannelKind.FORCE_CHARGE)
        level = trigger.level * source.sensitivity if in_unit_of_input else trigger.level
        level *= source.polarity
        slope = Slope.RISING if source.polarity > 0 else Slope.FALLING
        self._task.triggers.reference_trigger.cfg_anlg_edge_ref_trig(
            source.name, pretrigger_samples=self._pre_trigger, trigger_slope=slope, trigger_level=level
        )
        check_trigger(self._task, source.name, level, self._pre_trigger)

    def close(self) -> None:
        """Clear the task and free the instrument, once; DaqError if the instrument cannot be reached."""
        if self._open:
            self._open = False
            forget(self._session)
            with translated(f"clear task of {self._names}"):
                self._task.close()

    @contextmanager
    def _cleared_on_error(self, what: str) -> Iterator[None]:
        """Translate errors; clear the task on any but a timeout or a cancellation, after which it is only stopped."""
        if not self._open:
            raise DaqError(f"{what} {self._names}: the task is cleared; open a new one")
        try:
            with translated(f"{what} {self._names}"):
                yield
        except (TriggerTimeoutError, AcquisitionCancelledError) as error:
            try:
                with translated(f"stop {self._names}"):
                    self._task.stop()
            except DaqError as second:
                error.add_note(str(second))
                self._close_because_of(error)
            raise
        except DaqError as error:
            self._close_because_of(error)
            raise

    def _start(self) -> None:
        with self._cleared_on_error("start"):
            self._started_at = datetime.now(UTC)
            self._task.start()

    def _block(self, timeout: float, cancelled: Callable[[], bool] | None) -> Block:
        """Wait for the record and stop."""
        with self._cleared_on_error("read"):
            if cancelled is not None:
                timeout = self._wait_unless(cancelled, timeout)
            counts = self._counts(timeout)
            complete_at = datetime.now(UTC)
            overloaded = self._flagged() | set(at_range_ends(self.channels, counts, self._scaling, self._range))
            self._task.stop()
        return Block(
            channels=self.channels,
            counts=counts,
            scaling=self._scaling,
            sample_rate=self.sample_rate,
            # a record ends before it is read and begins after the start
            started_at=max(self._started_at, complete_at - timedelta(seconds=self.samples / self.sample_rate)),
            trigger_index=self._pre_trigger or None,
            overloaded=tuple(channel.name for channel in self.channels if channel.name in overloaded),
        )

    def _counts(self, timeout: float) -> npt.NDArray[np.int32]:
        """The record, (channels, samples); over a network read until two readings agree."""

        def read() -> npt.NDArray[np.int32]:
            counts = np.empty((len(self.channels), self.samples), dtype=np.int32)
            if (came := self._reader.read_int32(counts, self.samples, timeout=timeout)) != self.samples:
                raise DaqError(f"{self._names}: {came} samples of {self.samples} arrived; try again")
            return counts

        return agreed(f"record of {self._names}", read) if self._is_remote else read()

    def _wait_unless(self, cancelled: Callable[[], bool], timeout: float) -> float:
        """Wait for the record, at most `timeout` s; the rest of `timeout`, or AcquisitionCancelledError."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0:
            if cancelled():
                raise AcquisitionCancelledError(f"{self._names}: the record was cancelled")
            try:
                self._task.wait_until_done(min(left, CANCELLATION_POLL))
            except nidaqmx.errors.DaqError as error:
                if error.error_code != DAQmxErrors.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE:
                    raise
            else:
                break
        return max(left, 0.0)

    def _flagged(self) -> set[str]:
        """Names of channels that the instrument reports as overloaded; not every instrument can."""
        if not self._overload_attribute:
            return set()
        try:
            stream = self._task.in_stream
            return set(stream.overloaded_chans) if stream.overloaded_chans_exist else set()
        except nidaqmx.errors.DaqError as error:
            if error.error_code not in NOT_SUPPORTED:
                raise
            self._overload_attribute = False
            return set()


class TriggeredTask(_FiniteTask, Triggered):
    """Blocks around a trigger: arm, wait for the block, any number of times. Made by `Chassis.triggered`."""

    def arm(self) -> None:
        """Start, and return when the pre-trigger samples are there, so that a trigger counts; DaqError if it fails."""
        self._start()
        deadline = time.monotonic() + self._pre_trigger / self.sample_rate + ARMING_TIMEOUT
        with self._cleared_on_error("arm"):
            while (missing := self._pre_trigger - int(self._task.in_stream.total_samp_per_chan_acquired)) > 0:
                if time.monotonic() > deadline:
                    raise DaqError(f"{self._names}: no samples arrive; check the sample clock of the instrument")
                time.sleep(min(missing / self.sample_rate, LONGEST_ARMING_SLEEP))

    def wait(self, timeout: float, cancelled: Callable[[], bool] | None = None) -> Block:
        """The block of the trigger that comes within `timeout` s; as `daq.instrument.Triggered.wait`."""
        return self._block(timeout + self.samples / self.sample_rate, cancelled)


class Recorder(_FiniteTask, OnDemand):
    """Blocks that start on demand, any number of times. Made by `Chassis.record`."""

    def is_dc_coupled(self, name: str) -> bool | None:
        """Whether the input of channel `name` lets a mean voltage pass; None where the instrument does not say."""
        with translated(f"coupling of channel {name!r}"):
            try:
                return self._task.ai_channels[name].ai_coupling is Coupling.DC
            except nidaqmx.errors.DaqError as error:
                if error.error_code not in NOT_SUPPORTED:
                    raise
                return None

    def record(
        self, duration: float | None = None, timeout: float = 5.0, cancelled: Callable[[], bool] | None = None
    ) -> Block:
        """The block that starts now; as `daq.instrument.OnDemand.record`."""
        samples = self.samples if duration is None else max(2, round(duration * self.sample_rate))
        if samples != self.samples:
            with self._cleared_on_error("record"):
                self._task.timing.samp_quant_samp_per_chan = samples
            self.samples = samples
        self._start()
        return self._block(timeout + self.samples / self.sample_rate, cancelled)
