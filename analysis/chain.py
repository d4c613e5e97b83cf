"""Checks of a measuring chain, from sensor to converter, on records whose content is known: rest, blows, a calibrator.

Hum is the power of a Hann-windowed periodogram within `NEAR` of the first multiples of the mains, less what lines
beside them have (G. Heinzel, A. Ruediger, R. Schilling, Spectrum and spectral density estimation by the DFT, 2002).
Force over acceleration of a suspended rigid mass, during blows, is the mass times the error of both sensitivities
together (F = m a, ISO 7626-5, annex on calibration). A calibrator moves with a known rms acceleration at one frequency
(ISO 16063-44): the sensitivity is the rms voltage of the tone over it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal.windows import hann

from analysis.direct.mains_hum import MAINS, MULTIPLES
from analysis.direct.sine import fit_sine
from analysis.errors import AnalysisError
from analysis.frequency_response import Real

NEAR, BESIDE = 1.5, 5.0
"""Hz from a multiple of the mains, for its tone and for the noise about it. The mains deviate by less than 1 %."""
SHORTEST = 1.0  # s, so that a tone stands on lines of its own
DURING = 0.2  # of the highest force of a record: samples above it belong to a blow
COVERAGE = 2.0
"""Coverage factor of uncertainties in certificates: about 95 %."""
LEAST_PURITY = 0.5
"""Smallest share of the tone in the rms of a record on a calibrator."""


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


@dataclass(frozen=True)
class ApparentMass:
    """The mass that blows on a rigid body show.

    Attributes:
        mass: force over acceleration by least squares, kg; negative where their signs differ.
        correlation: of both during the blows; 1 or -1 for a rigid mass and sensors that follow it.
        peak_force: largest force, N.
    """

    mass: float
    correlation: float
    peak_force: float


def apparent_mass(force: Real, acceleration: Real) -> ApparentMass:
    """The mass that blows in a record show.

    Args:
        force: (samples,) N of the hammer.
        acceleration: (samples,) m/s^2 of the mass.

    Raises AnalysisError where a channel does not vary at all.
    """
    force, acceleration = force - np.median(force), acceleration - np.median(acceleration)
    size = np.abs(force)
    during = size >= DURING * size.max()
    struck, moved = force[during], acceleration[during]
    if not (np.any(struck) and np.any(moved)):
        raise AnalysisError("a channel does not vary: no blow is in the record")
    product = float(struck @ moved)
    return ApparentMass(
        mass=product / float(moved @ moved),
        correlation=product / float(np.linalg.norm(struck) * np.linalg.norm(moved)),
        peak_force=float(struck[np.argmax(np.abs(struck))]),
    )


def mass_if_swapped(mass: float, force_sensitivity: float, acceleration_sensitivity: float) -> float:
    """The apparent mass of `mass` kg where the cables of hammer (V/N) and accelerometer (V/(m/s^2)) are swapped."""
    return (acceleration_sensitivity / force_sensitivity) ** 2 / mass


@dataclass(frozen=True)
class Calibrator:
    """A vibration calibrator: Hz, m/s^2 rms, and the relative expanded uncertainty (k = 2) of that acceleration."""

    frequency: float = 159.15
    acceleration: float = 10.0
    uncertainty: float = 0.03


@dataclass(frozen=True)
class FoundSensitivity:
    """The sensitivity that a record on a calibrator shows.

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
    if not np.any(beside):
        raise AnalysisError(
            f"a record of {volts.size} samples at {sample_rate:g} Hz has no line near {calibrator.frequency:g} Hz; "
            "sample faster, or record longer"
        )
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
