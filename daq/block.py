"""A block: raw counts of the converters, and the scaling that turns them into SI units."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial

from daq.channels import Channel
from daq.errors import ChannelError


@dataclass(frozen=True, eq=False)
class Block:
    """Simultaneous samples of several channels; ChannelError for the name of a channel that it does not hold.

    Attributes:
        channels: one per row of `counts`.
        counts: int32 (channels, samples), raw converter counts.
        scaling: per channel, the polynomial from counts to volts (V/V of a bridge, C of a charge), coefficients in
            ascending order of power; volts are positive for a positive quantity, whatever the polarity of the sensor.
        sample_rate: in Hz, as the instrument coerced it.
        started_at: UTC of the first sample by the clock of this computer.
        trigger_index: column of the first sample at or after the trigger; None for a record without a trigger.
        overloaded: names of channels that exceeded the range of their input during the block.
    """

    channels: tuple[Channel, ...]
    counts: npt.NDArray[np.int32]
    scaling: tuple[tuple[float, ...], ...]
    sample_rate: float
    started_at: datetime
    trigger_index: int | None = None
    overloaded: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Channel names, in the order of the rows."""
        return tuple(channel.name for channel in self.channels)

    @property
    def samples(self) -> int:
        """Samples per channel."""
        return int(self.counts.shape[1])

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.samples / self.sample_rate

    def row(self, name: str) -> int:
        """Row of the channel called `name`."""
        try:
            return self.names.index(name)
        except ValueError:
            raise ChannelError(f"no channel {name!r} in this block; it holds {', '.join(self.names)}") from None

    def at_input(self, name: str) -> npt.NDArray[np.float64]:
        """What is measured at the input of channel `name`, (samples,): V, V/V of a bridge, C of a charge."""
        row = self.row(name)
        return np.asarray(polynomial.polyval(self.counts[row].astype(np.float64), self.scaling[row]))

    def value(self, name: str) -> npt.NDArray[np.float64]:
        """Channel `name` in its SI unit, (samples,)."""
        return self.at_input(name) / self.channels[self.row(name)].sensitivity


def at_range_ends(
    channels: Sequence[Channel],
    counts: npt.NDArray[np.int32],
    scaling: Sequence[Sequence[float]],
    ranges: Sequence[tuple[float, float]],
) -> tuple[str, ...]:
    """Names of channels whose lowest or highest count is at an end of the range.

    Args:
        channels: one per row of `counts`.
        counts: (channels, samples).
        scaling: per channel, the polynomial from counts to V, V/V or C, as in `Block`.
        ranges: per channel, the ends of the range of its input, in the same unit.
    """
    names = []
    for channel, row, coefficients, (low, high) in zip(channels, counts, scaling, ranges, strict=True):
        ends = polynomial.polyval(np.array([row.min(), row.max()], dtype=np.float64), coefficients)
        one_count = abs(coefficients[1])  # in the unit of the range
        if ends.min() <= low + one_count or ends.max() >= high - one_count:
            names.append(channel.name)
    return tuple(names)
