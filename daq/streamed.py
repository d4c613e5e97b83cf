"""Records and triggers made of a stream of samples, for instruments whose plug-in gives no more than that.

Each sample has a number, so that a lost one is an error and never a gap. The stream is read in a thread of its own: a
plug-in that hangs ends a record with an error, in time.
"""

import logging
import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from queue import Empty, SimpleQueue

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial

from daq.block import Block, at_range_ends
from daq.channels import Channel
from daq.errors import (
    AcquisitionCancelledError,
    ChannelError,
    DaqError,
    OverrunError,
    TriggerTimeoutError,
    afterwards,
)
from daq.instrument import DaqInstrument, DaqTask, EdgeTrigger, OnDemand, Triggered
from daq.stream import OpenSource, Samples, SampleStream

POLL = 0.05  # s, between two questions whether to cancel, and for one read of a stream
READ_OVERTIME = 2.0  # s that a read of the stream, and the look at its samples, may take beyond their time
ARMING_TIMEOUT = 5.0  # s beyond the pre-trigger time itself
Counts = npt.NDArray[np.int32]
log = logging.getLogger(__name__)


@contextmanager
def _translated(what: str) -> Iterator[None]:
    """Raise an error of the plug-in as a DaqError; its message begins with `what`, the action that failed."""
    try:
        yield
    except DaqError:
        raise
    except Exception as error:  # a plug-in of others may raise anything
        raise DaqError(f"{what}: the plug-in failed ({type(error).__name__}: {error}); see its manual") from error


class StreamedInstrument(DaqInstrument):
    """The instrument of a plug-in.

    Raises DaqError where it cannot be opened or has no device.
    """

    def __init__(self, address: str, open_source: OpenSource) -> None:
        self.address = address
        with _translated(f"open {address}"):
            self._source = open_source(address)
            self.devices = tuple(self._source.devices)
        if not self.devices:
            self.close()
            raise DaqError(f"{address}: no device; check power and cable of the instrument")

    def close(self) -> None:
        """Close the connection."""
        with _translated(f"close {self.address}"):
            self._source.close()

    def verify(self, channels: Sequence[Channel]) -> None:
        """Open the channels once, at a sample rate that is usual in runs; ChannelError, DaqError if that fails."""
        with self.record(channels, 5120.0, 0.1):
            pass

    def triggered(
        self, channels: Sequence[Channel], sample_rate: float, duration: float, trigger: EdgeTrigger
    ) -> "StreamedTriggered":
        """A task that looks for the trigger in the samples."""
        names = [channel.name for channel in channels]
        if trigger.channel not in names:
            raise ChannelError(f"trigger on {trigger.channel!r}: not one of {', '.join(names)}")
        return StreamedTriggered(self, channels, sample_rate, duration, trigger)

    def record(self, channels: Sequence[Channel], sample_rate: float, duration: float) -> "StreamedRecorder":
        """A recorder, whose records each start the stream."""
        return StreamedRecorder(self, channels, sample_rate, duration)

    def open_stream(self, channels: Sequence[Channel], sample_rate: float) -> tuple[tuple[Channel, ...], SampleStream]:
        """The checked table and its stream. Raises ChannelError, DaqError."""
        table = self._checked(channels)
        with _translated(f"{', '.join(each.name for each in table)} at {sample_rate:g} Hz at {self.address}"):
            return table, self._source.open(table, sample_rate)


class _StreamTask(DaqTask):
    """Channels of a stream."""

    def __init__(
        self, instrument: StreamedInstrument, channels: Sequence[Channel], sample_rate: float, duration: float
    ) -> None:
        self.requested_rate = sample_rate
        self.channels, self._stream = instrument.open_stream(channels, sample_rate)
        self._came = SimpleQueue[tuple[datetime, Counts] | DaqError]()
        self._reader: threading.Thread | None = None
        self._hanging: threading.Thread | None = None  # a reader that was to end, and did not
        self._ended = threading.Event()
        try:
            with _translated(f"set up {self._names}"):
                self.sample_rate = float(self._stream.sample_rate)
                self._scaling = tuple(
                    tuple(each.polarity * float(c) for c in row)
                    for each, row in zip(self.channels, self._stream.scaling, strict=True)
                )
                self._range = tuple(
                    (min(ends), max(ends))
                    for each, (low, high) in zip(self.channels, self._stream.ranges, strict=True)
                    for ends in [(each.polarity * float(low), each.polarity * float(high))]
                )
            if not (math.isfinite(self.sample_rate) and self.sample_rate > 0):
                raise DaqError(f"{self._names}: the plug-in has a sample rate of {self.sample_rate} Hz; correct it")
            for channel, (low, high) in zip(self.channels, self._range, strict=True):
                unit = channel.kind.input_unit
                ends = channel.minimum * channel.sensitivity, channel.maximum * channel.sensitivity
                if ends[0] < low * (1 + 1e-6) or ends[1] > high * (1 + 1e-6):
                    raise ChannelError(
                        f"channel {channel.name!r} asks for {ends[0]:g} to {ends[1]:g} {unit}, its input takes "
                        f"{low:g} to {high:g} {unit}; correct minimum and maximum, or take another input"
                    )
        except DaqError as error:
            self._close_because_of(error)
            raise
        self.samples = max(2, round(duration * self.sample_rate))

    def close(self) -> None:
        """Free the channels, also where the stream cannot be stopped; DaqError if the plug-in fails.

        They are freed later where the plug-in does not return from a read: it need not bear two calls at a time.
        """
        with afterwards(self._close_when_read, DaqError):
            self._stop()

    def _close_when_read(self) -> None:
        if self._hanging is not None and self._hanging.is_alive():
            threading.Thread(target=self._close_later, args=(self._hanging,), daemon=True).start()
        else:
            self._close_stream()

    def _close_later(self, hanging: threading.Thread) -> None:
        hanging.join()
        try:
            self._close_stream()
        except DaqError as error:  # there is nobody left to raise it to
            log.warning("%s", error)

    def _close_stream(self) -> None:
        with _translated(f"close {self._names}"):
            self._stream.close()

    def _start(self) -> None:
        self._came, self._ended = SimpleQueue(), threading.Event()
        self._started_at = datetime.now(UTC)
        with _translated(f"start {self._names}"):
            self._stream.start()
        self._reader = threading.Thread(target=self._read, args=(self._came, self._ended), daemon=True)
        self._reader.start()

    def _stop(self) -> None:
        reader, self._reader = self._reader, None
        if reader is None:
            return
        self._ended.set()
        reader.join(READ_OVERTIME)
        if reader.is_alive():
            self._hanging = reader
            raise DaqError(f"{self._names}: the plug-in does not return from a read of {POLL:g} s; restart it")
        with _translated(f"stop {self._names}"):
            self._stream.stop()

    def _read(self, came: "SimpleQueue[tuple[datetime, Counts] | DaqError]", ended: threading.Event) -> None:
        """Read the stream until it has `ended`; the samples, or the error that ends it, go into `came`."""
        expected = 0
        try:
            with _translated(f"read {self._names}"):
                while not ended.is_set():
                    counts = self._counts(self._stream.read(POLL), expected)
                    expected += counts.shape[1]
                    if counts.size:
                        came.put((datetime.now(UTC), counts.astype(np.int32)))
        except DaqError as error:
            came.put(error)

    def _counts(self, got: Samples, expected: int) -> npt.NDArray[np.integer]:
        """The counts that were read, (channels, samples), of which the first has to be sample `expected`.

        Raises DaqError where they have another type or shape, OverrunError where samples were lost.
        """
        counts = np.asarray(got.counts)
        if counts.ndim != 2 or len(counts) != len(self.channels) or counts.dtype.kind not in "iu":
            raise DaqError(
                f"{self._names}: the plug-in gave {counts.dtype} of shape {counts.shape} in place of "
                f"integers, ({len(self.channels)}, samples); correct it"
            )
        if got.first != expected and counts.size:
            raise OverrunError(
                f"{self._names}: sample {got.first} came in place of {expected}, samples were lost; close "
                "other programs, repeat"
            )
        return counts

    def _more(self, held: Counts, by: float, cancelled: Callable[[], bool] | None) -> Counts:
        """`held` and the samples after it; waits for them until `by`, s of `time.monotonic`.

        Samples that came until then may be looked at for `READ_OVERTIME` s more; a stream that is quicker than this
        thread would have no end otherwise.
        """
        while True:
            if cancelled is not None and cancelled():
                raise AcquisitionCancelledError(f"{self._names}: the record was cancelled")
            left = by - time.monotonic()
            with suppress(Empty):
                found = self._came.get(timeout=max(min(left, POLL), 0.0))
                if isinstance(found, DaqError):
                    raise found
                if left > -READ_OVERTIME:
                    self._latest_at = found[0]
                    return np.concatenate([held, found[1]], axis=1)
            if left <= 0:
                raise TriggerTimeoutError(f"{self._names}: nothing came in time; check the trigger, then arm")

    def _no_samples(self) -> Counts:
        return np.empty((len(self.channels), 0), np.int32)

    def _block(self, held: Counts, first: int, trigger_index: int | None) -> Block:
        """The block from column `first` of `held`, which ends with the sample that came last."""
        counts = np.ascontiguousarray(held[:, first : first + self.samples])
        began = self._latest_at - timedelta(seconds=(held.shape[1] - first) / self.sample_rate)
        return Block(
            self.channels, counts, self._scaling, self.sample_rate, max(self._started_at, began), trigger_index,
            at_range_ends(self.channels, counts, self._scaling, self._range),
        )  # fmt: skip


class StreamedTriggered(_StreamTask, Triggered):
    """Blocks around a trigger that is looked for in the samples."""

    def __init__(
        self,
        instrument: StreamedInstrument,
        channels: Sequence[Channel],
        sample_rate: float,
        duration: float,
        trigger: EdgeTrigger,
    ) -> None:
        super().__init__(instrument, channels, sample_rate, duration)
        self._trigger = trigger
        self._before = max(2, round(trigger.pre_trigger * self.sample_rate))
        self._row = [channel.name for channel in self.channels].index(trigger.channel)
        self._held = self._no_samples()

    def arm(self) -> None:
        """Start, and return when the pre-trigger samples are there; DaqError if it fails."""
        self._stop()
        self._start()
        by, held = time.monotonic() + self._before / self.sample_rate + ARMING_TIMEOUT, self._no_samples()
        try:
            while held.shape[1] < self._before:
                held = self._more(held, by, None)
        except TriggerTimeoutError as error:
            self._stop()
            raise DaqError(f"{self._names}: no samples arrive; check the sample clock of the instrument") from error
        self._held = held[:, -self._before :]

    def wait(self, timeout: float, cancelled: Callable[[], bool] | None = None) -> Block:
        """The block of the trigger that comes within `timeout` s; errors as for `daq.instrument.Triggered.wait`."""
        by, held = time.monotonic() + timeout + self.samples / self.sample_rate, self._held
        with afterwards(self._stop, DaqError):
            while (at := self._edge(held)) is None:
                held = self._more(held[:, -self._before :], by, cancelled)
            while held.shape[1] < at - self._before + self.samples:
                held = self._more(held, by, cancelled)
        return self._block(held, at - self._before, self._before)

    def _edge(self, held: Counts) -> int | None:
        """Column of the first sample at or above the level after one below it, with the pre-trigger samples before."""
        channel = self.channels[self._row]
        value = polynomial.polyval(held[self._row].astype(np.float64), self._scaling[self._row]) / channel.sensitivity
        level = self._trigger.level
        edges = np.flatnonzero((value[:-1] < level) & (value[1:] >= level)) + 1
        return next((int(edge) for edge in edges if edge >= self._before), None)


class StreamedRecorder(_StreamTask, OnDemand):
    """Blocks that start on demand."""

    def is_dc_coupled(self, name: str) -> bool | None:  # noqa: ARG002 - a stream does not say
        """None: a stream does not say."""
        return None

    def record(
        self, duration: float | None = None, timeout: float = 5.0, cancelled: Callable[[], bool] | None = None
    ) -> Block:
        """The block that starts now; as `daq.instrument.OnDemand.record`."""
        self.samples = self.samples if duration is None else max(2, round(duration * self.sample_rate))
        by, held = time.monotonic() + timeout + self.samples / self.sample_rate, self._no_samples()
        with afterwards(self._stop, DaqError):
            self._start()
            while held.shape[1] < self.samples:
                held = self._more(held, by, cancelled)
        return self._block(held, 0, None)
