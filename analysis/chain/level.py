"""Level of a channel at rest: its mean, its noise, and the hum of the mains in it.

Hum is the power of a Hann-windowed periodogram within `NEAR` of the first multiples of the mains, less what lines
beside them have (G. Heinzel, A. Ruediger, R. Schilling, Spectrum and spectral density estimation by the DFT, 2002).
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal.windows import hann

from analysis.direct.mains_hum import MAINS, MULTIPLES
from analysis.errors import AnalysisError
from analysis.frequency_response import Real

NEAR, BESIDE = 1.5, 5.0
"""Hz from a multiple of the mains within which its tone is, and its noise is taken from. Mains keep within 1 %."""
SHORTEST = 1.0  # s, so that a tone stands on lines of its own


@dataclass(frozen=True)
class ChannelLevel:
    """Level of one channel at rest, in the unit of its signal.

    Attributes:
        mean: of the record.
        noise: rms of all that varies, without hum.
        hum: rms of the tones at multiples of `mains`.
        mains: 50 or 60 Hz, whichever has more.
    """

    mean: float
    noise: float
    hum: float
    mains: float


def level_of(signal: Real, sample_rate: float) -> ChannelLevel:
    """The level of a channel at rest.

    Args:
        signal: (samples,) in any unit.
        sample_rate: Hz.

    Raises AnalysisError where the record is shorter than `SHORTEST`.
    """
    if signal.size < SHORTEST * sample_rate:
        raise AnalysisError(f"{signal.size / sample_rate:.3g} s are too short for a level; record {SHORTEST:g} s")
    mean = float(np.mean(signal))
    window = hann(signal.size, sym=False)
    spectrum = np.fft.rfft((signal - mean) * window)
    power = np.asarray(2 * np.abs(spectrum) ** 2 / (signal.size * np.sum(window**2)))
    frequency: Real = np.asarray(np.fft.rfftfreq(signal.size, 1 / sample_rate), dtype=np.float64)
    hum = {mains: _power_of_tones(power, frequency, mains) for mains in MAINS}
    mains = max(MAINS, key=hum.__getitem__)
    noise = float(np.var(signal)) - hum[mains]
    return ChannelLevel(mean, float(np.sqrt(max(noise, 0.0))), float(np.sqrt(max(hum[mains], 0.0))), mains)


def _power_of_tones(power: Real, frequency: Real, mains: float) -> float:
    """Mean square of the tones at the first multiples of `mains`; noise may make it negative."""
    total = 0.0
    for tone in mains * np.arange(1, MULTIPLES + 1):
        away = np.abs(frequency - tone)
        near, beside = away <= NEAR, (away > NEAR) & (away <= BESIDE)
        if tone + BESIDE < frequency[-1]:
            total += float(np.sum(power[near]) - np.mean(power[beside]) * np.count_nonzero(near))
    return total
