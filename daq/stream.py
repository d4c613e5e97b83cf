"""What a plug-in for acquisition gives: devices, and streams of samples. `daq.streamed` makes records of them.

A package offers its function `open_source` in its pyproject.toml, and `daq_address = "soundcard://..."` selects it:

    [project.entry-points."jointlab.daq"]
    soundcard = "our_soundcard:open_source"
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from daq.channels import Channel
from daq.instrument import Device


@dataclass(frozen=True, eq=False)
class Samples:
    """The samples that came since the last read.

    Attributes:
        first: number of the first of these samples, counted by the instrument from 0 at the start, so that lost samples
            leave a gap.
        counts: (channels, samples) of an integer type, in the order of the channels; may have no samples.
    """

    first: int
    counts: npt.NDArray[np.integer]


class SampleStream(Protocol):
    """Some channels on one clock.

    Attributes:
        sample_rate: Hz, as the instrument has it, not as it was asked for.
        scaling: for each channel the polynomial from counts to V at the input (V/V of a bridge, C of a charge),
            coefficients in ascending order.
        ranges: for each channel the ends of its range, in the same unit.
    """

    sample_rate: float
    scaling: Sequence[Sequence[float]]
    ranges: Sequence[tuple[float, float]]

    def start(self) -> None:
        """Begin with sample 0, now."""

    def read(self, timeout: float) -> Samples:
        """Wait at most `timeout` s for samples, and return those that came; called in a thread of its own."""

    def stop(self) -> None:
        """End; `start` may follow."""

    def close(self) -> None:
        """Free the channels."""


class SampleSource(Protocol):
    """An instrument, as its plug-in opens it.

    Attributes:
        devices: its chassis and modules; each input is named ``device/input``.
    """

    devices: Sequence[Device]

    def open(self, channels: Sequence[Channel], sample_rate: float) -> SampleStream:
        """A stream of these channels; raises ChannelError for a range, excitation or rate that it does not have."""

    def close(self) -> None:
        """Free the instrument."""


OpenSource = Callable[[str], SampleSource]
"""Opens the instrument at the whole address, such as ``soundcard://hw:1``."""
