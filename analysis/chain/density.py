"""Power spectral density of a short record, to watch a channel live; results use the spectra of `analysis/modal`."""

import numpy as np
from scipy.signal.windows import hann

from analysis.frequency_response import Real


def power_density(signal: Real, sample_rate: float) -> tuple[Real, Real]:
    """One-sided power spectral density of a Hann-windowed record without its mean, as scipy.signal.periodogram has it.

    Args:
        signal: (samples,) in any unit.
        sample_rate: Hz.

    Returns:
        frequency in Hz and density in unit²/Hz, both (lines,), without the line at zero.
    """
    window = hann(signal.size, sym=False)
    power = 2 * np.abs(np.fft.rfft((signal - np.mean(signal)) * window)) ** 2 / (sample_rate * np.sum(window**2))
    if signal.size % 2 == 0:
        power[-1] /= 2
    return np.asarray(np.fft.rfftfreq(signal.size, 1 / sample_rate))[1:], np.asarray(power)[1:]
