"""From blows to samples: both channels of a blow on any sampling grid, exact between lines, and the sensors' noise.

A blow's spectra are known in closed form (pulse times accelerance), so a waveform on a grid of any rate and phase is
one inverse transform; nothing is interpolated. The converter's anti-alias filter, flat to 0.45 of the rate and
without delay, acts on both channels alike.
"""

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from simlab.beam import Real
from simlab.coupling import Complex
from simlab.hammer_operator import SimulatedBlow
from simlab.stand import Stand

MEMORY = 3.0
"""Seconds after which a blow's response has died out, to 1e-9 for the sharpest mode."""
LEAD = 0.05
"""Seconds before the hammer's touch that a blow's waveform covers, for the filter's ringing."""
HIGHEST = 8000.0
"""No blow has force above this frequency, Hz: the shortest sends 1e-6 of its impulse there."""
NOISE_CHUNK = 4096

Value = TypeVar("Value")


@dataclass(frozen=True)
class Grid:
    """Sampling at `rate` Hz over one blow's memory.

    Attributes:
        size: samples, and with them rate / size Hz between lines.
        frequency: (lines,) from the first above zero.
        filter: (lines,) gain of the anti-alias filter.
        stand: the beam's rig at these lines.
    """

    rate: float
    size: int
    frequency: Real
    filter: Real
    stand: Stand


class Sampler:
    """Waveforms of blows; for one thread at a time.

    Args:
        stand_at: the beam's rig at frequency lines (lines,) in Hz, all above zero.
        temperature: deg C at a time in s.
        memory: seconds that a blow is heard.
    """

    def __init__(
        self, stand_at: Callable[[Real], Stand], temperature: Callable[[float], float], memory: float = MEMORY
    ) -> None:
        self._stand_at = stand_at
        self._memory = memory
        self._temperature = temperature
        self._grids: Recent[Grid] = Recent(3)
        self._spectra: Recent[Complex] = Recent(8)
        self._waveforms: Recent[Real] = Recent(16)
        self._rate: float | None = None

    def prepare(self, blow: SimulatedBlow) -> None:
        """Work out a blow's spectra at the rate read last, so that the next block is quick."""
        if self._rate is not None:
            self._spectrum(blow, self._rate)

    def read(self, blows: Iterable[SimulatedBlow], start: float, rate: float, samples: int) -> Real:
        """(2, samples) force in N and acceleration in m/s^2 at start + i / rate: the sum of all `blows`."""
        self._rate = rate
        total = np.zeros((2, samples))
        for blow in blows:
            origin = blow.foot - LEAD
            # the blow's own samples are those of the block's grid: the first comes `phase` samples after its origin
            behind = (origin - start) * rate
            first = int(np.ceil(behind - 1e-6))
            if first >= samples or first + (self._memory + LEAD) * rate < 0:
                continue
            waveform = self._waveform(blow, rate, round(first - behind, 6))
            begin, end = max(first, 0), min(first + waveform.shape[1], samples)
            if begin < end:
                total[:, begin:end] += waveform[:, begin - first : end - first]
        return total

    def _waveform(self, blow: SimulatedBlow, rate: float, phase: float) -> Real:
        """(2, size) samples of a blow, the first `phase` samples after its origin."""

        def make() -> Real:
            grid = self._grid(rate)
            spectrum = np.zeros((2, grid.size // 2 + 1), dtype=np.complex128)
            shift = grid.filter * np.exp(2j * np.pi * grid.frequency * (phase / rate))
            spectrum[0, 0] = blow.spectrum(np.zeros(1), 0.0)[0]
            spectrum[:, 1 : 1 + grid.frequency.size] = self._spectrum(blow, rate) * shift
            return np.asarray(np.fft.irfft(spectrum, grid.size) * rate)

        return self._waveforms.get_or_make((blow.number, rate, phase), make)

    def _spectrum(self, blow: SimulatedBlow, rate: float) -> Complex:
        """(2, lines) force in N s and acceleration in m/s^2 s, time counted from the blow's origin."""

        def make() -> Complex:
            grid = self._grid(rate)
            force = blow.spectrum(grid.frequency, blow.foot - LEAD)
            struck = (blow.row, blow.setup, blow.peak_force, blow.load, self._temperature(blow.foot))
            return np.stack([force, force * grid.stand.blow(*struck)])

        return self._spectra.get_or_make((blow.number, rate), make)

    def _grid(self, rate: float) -> Grid:
        def make() -> Grid:
            size = 1 << int(np.ceil(np.log2((self._memory + LEAD) * rate)))
            frequency: Real = np.arange(1.0, size // 2 + 1) * (rate / size)
            frequency = frequency[frequency <= min(0.5 * rate, HIGHEST)]
            edge = np.clip((frequency / rate - 0.45) / 0.05, 0.0, 1.0)
            return Grid(rate, size, frequency, np.cos(0.5 * np.pi * edge) ** 2, self._stand_at(frequency))

        return self._grids.get_or_make(rate, make)


class Recent(OrderedDict[Hashable, Value]):
    """The last few values made, by key."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self._most = most

    def get_or_make(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """The value under `key`, made if it is not there; the one unused longest is dropped."""
        if key not in self:
            self[key] = make()
            while len(self) > self._most:
                self.popitem(last=False)
        self.move_to_end(key)
        return self[key]


def white_noise(seed: int, channel: int, first: int, samples: int) -> Real:
    """(samples,) unit white noise from sample number `first` on: the same for a sample in whatever block it is read."""
    if samples == 0:
        return np.zeros(0)
    chunks = range(first // NOISE_CHUNK, (first + samples - 1) // NOISE_CHUNK + 1)
    keys = np.array([(seed, (16 * chunk + channel) % 2**64) for chunk in chunks], dtype=np.uint64)
    noise = [np.random.Generator(np.random.Philox(key=key)).standard_normal(NOISE_CHUNK) for key in keys]
    offset = first - chunks.start * NOISE_CHUNK
    return np.concatenate(noise)[offset : offset + samples]
