"""Sensitivity of a vibration sensor from a record on a hand-held calibrator (ISO 16063-44).

A calibrator moves with a known rms acceleration at one frequency. The sensitivity is the rms voltage of the tone over
it; its uncertainty is that of the calibrator and the scatter from block to block.
"""

from dataclasses import dataclass

import numpy as np

from analysis.direct.sine import fit_sine
from analysis.errors import AnalysisError
from analysis.frequency_response import Real

COVERAGE = 2.0
"""Coverage factor of uncertainties in certificates: about 95 %."""
LEAST_PURITY = 0.5
"""Share of the tone in the rms of a record below which it is none of a calibrator."""


@dataclass(frozen=True)
class Calibrator:
    """A vibration calibrator: Hz, m/s^2 rms, and the relative expanded uncertainty (k = 2) of that acceleration."""

    frequency: float = 159.15
    acceleration: float = 10.0
    uncertainty: float = 0.03


@dataclass(frozen=True)
class FoundSensitivity:
    """What a record on a calibrator says.

    Attributes:
        sensitivity: V/(m/s^2).
        uncertainty: of it, relative, expanded (k = 2).
        frequency: of the tone, Hz.
        purity: rms of the tone over that of all that varies; 1 is a pure tone.
    """

    sensitivity: float
    uncertainty: float
    frequency: float
    purity: float


def found_sensitivity(volts: Real, sample_rate: float, calibrator: Calibrator) -> FoundSensitivity:
    """The sensitivity of a sensor on a calibrator.

    Args:
        volts: (samples,) V, 1 s or longer.
        sample_rate: Hz.
        calibrator: whose frequency is known within 2 % or so.

    Raises AnalysisError where the record has no such tone, or is too short for a fit.
    """
    spectrum = np.abs(np.fft.rfft((volts - np.mean(volts)) * np.hanning(volts.size)))
    frequency = np.fft.rfftfreq(volts.size, 1 / sample_rate)
    beside = np.abs(frequency / calibrator.frequency - 1) < 0.05
    begin = float(frequency[beside][np.argmax(spectrum[beside])])
    fit = fit_sine(volts[None], sample_rate, begin, harmonics=1)
    tone = float(fit.amplitude_pp[0]) / np.sqrt(8.0)
    purity = min(tone / float(np.std(volts)), 1.0)
    if purity < LEAST_PURITY:
        raise AnalysisError(f"no sine found near {calibrator.frequency:g} Hz")
    scatter = float(fit.amplitude_pp_standard_error[0] / fit.amplitude_pp[0])
    return FoundSensitivity(
        sensitivity=tone / calibrator.acceleration,
        uncertainty=float(np.hypot(calibrator.uncertainty, COVERAGE * scatter)),
        frequency=fit.frequency,
        purity=purity,
    )
