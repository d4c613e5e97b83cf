"""A waveform: raw samples of simultaneous channels, and their scaling to physical values."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.errors import NotFoundError, StoreError

SampleArray = NDArray[Any]


@dataclass(frozen=True)
class WaveformChannel:
    """Scaling of one row of samples to physical values.

    Attributes:
        name: the channel's name, unique within the waveform.
        unit: physical unit, such as N or m/s^2.
        coefficients: of the polynomial from raw samples to volts, lowest power first.
        sensitivity: volts per physical unit; V/V of a bridge, C of a charge.
    """

    name: str
    unit: str
    coefficients: tuple[float, ...] = (0.0, 1.0)
    sensitivity: float = 1.0


@dataclass(frozen=True, eq=False)
class Waveform:
    """One record of all channels on one clock.

    Attributes:
        channels: (channels,) of the rows.
        samples: (channels, samples) int32 counts of the converter, or float64 values of a file.
        sample_rate: Hz.
        started_at: UTC of the first sample, or None where it is not known.
        trigger_index: index of the sample at the trigger, or None for an untriggered record.
        overloaded: names of the channels that were overloaded.
    """

    channels: tuple[WaveformChannel, ...]
    samples: SampleArray
    sample_rate: float
    started_at: datetime | None = None
    trigger_index: int | None = None
    overloaded: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.samples.dtype not in (np.int32, np.float64):
            raise StoreError(f"a waveform holds int32 counts or float64 values, not {self.samples.dtype}")
        if self.samples.ndim != 2 or self.samples.shape[0] != len(self.channels) or self.samples.shape[1] == 0:
            raise StoreError(f"samples have shape {self.samples.shape}, expected ({len(self.channels)}, samples)")
        names = [channel.name for channel in self.channels]
        if len(set(names)) != len(names):
            raise StoreError(f"channel names {', '.join(names)} are not unique")
        if self.samples.dtype == np.float64 and not np.all(np.isfinite(self.samples)):
            raise StoreError("samples hold values that are not finite numbers")
        if not (np.isfinite(self.sample_rate) and self.sample_rate > 0):
            raise StoreError(f"sample rate {self.sample_rate} Hz is not positive")

    def value(self, name: str) -> NDArray[np.float64]:
        """(samples,) physical values of a channel in its unit; NotFoundError if there is no such channel."""
        for channel, row in zip(self.channels, self.samples, strict=True):
            if channel.name == name:
                volts = np.polynomial.polynomial.polyval(row.astype(np.float64), channel.coefficients)
                return np.asarray(volts / channel.sensitivity)
        have = ", ".join(channel.name for channel in self.channels)
        raise NotFoundError(f"the waveform has no channel {name!r}; it has {have}")


@dataclass(frozen=True)
class WaveformReference:
    """Reference to a waveform: the run's file and the record's number in it."""

    file: str
    record: int

    def __str__(self) -> str:
        return f"{self.file} record {self.record}"


def record_number(reference: WaveformReference | None, file: str, where: str) -> int | None:
    """The number to store with a row of the run whose waveform file is `file`; None without a waveform.

    Raises StoreError if the waveform is of another run; the message starts with `where`.
    """
    if reference is not None and reference.file != file:
        raise StoreError(f"{where}: waveform {reference} is not of this run, whose file is {file}")
    return None if reference is None else reference.record


def reference_to(file: str, record: int | None) -> WaveformReference | None:
    """The reference for a stored number; None without a waveform."""
    return None if record is None else WaveformReference(file, record)
