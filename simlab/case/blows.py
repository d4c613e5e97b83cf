"""Blows and sine fits as a laboratory gets them: records of single blows, H1 of ten of them, and all scatter."""

from dataclasses import dataclass

import numpy as np

from simlab.beam import Real
from simlab.case.campaign import AVERAGES, HIGHEST_LINE, LINE_SPACING, Campaign
from simlab.case.effects import SimulatedEffect
from simlab.coupling import Complex

PEAK_SCATTER = 0.1
"""Standard deviation of the peak force from blow to blow, relative."""
SAMPLE_RATE = 4 * HIGHEST_LINE
RECORD_SECONDS = 1 / LINE_SPACING
UNIT_NOISE = float(np.sqrt(RECORD_SECONDS / SAMPLE_RATE))
"""s, standard deviation of a record's spectrum for a sample noise of one unit."""
PRETRIGGER = 0.01
"""Seconds of a record before the middle of the pulse."""


@dataclass(frozen=True, eq=False)
class Blows:
    """Fourier transforms of blows, (blows, rows, lines): force in N s and acceleration in m/s^2 s."""

    force: Complex
    acceleration: Complex


def half_sine_spectrum(frequency: Real, peak_force: float, width: float) -> Real:
    """(lines,) Fourier transform in N s of a half-sine pulse of `width` s from foot to foot about its middle."""
    ratio = frequency * width
    # at ratio 1/2 numerator and denominator vanish together; their quotient tends to pi / 4
    close = np.abs(ratio - 0.5) < 1e-6
    safe = np.where(close, 0.0, ratio)
    shape = np.where(close, np.pi / 4, np.cos(np.pi * safe) / (1.0 - 4.0 * safe**2))
    return np.asarray(2.0 / np.pi * peak_force * width * shape)


def strike(
    rng: np.random.Generator,
    count: int,
    accelerance: Complex,
    slope: Complex,
    frequency: Real,
    peak_force: float,
    campaign: Campaign,
    effects: tuple[SimulatedEffect, ...],
) -> Blows:
    """`count` blows a row, which differ a little in place and force, with the noise of both sensors.

    Args:
        accelerance, slope: (rows, lines) true accelerance, and its change along the beam, per m.
        frequency: (lines,) Hz.
    """
    rows, lines = accelerance.shape
    shape = (count, rows, 1)
    peak = 1.0 + PEAK_SCATTER * np.clip(rng.standard_normal(shape), -3, 3)
    place = campaign.place_scatter * np.clip(rng.standard_normal(shape), -3, 3)
    pulse = half_sine_spectrum(frequency, peak_force, campaign.pulse_width)
    force: Complex = np.asarray(peak * pulse, dtype=np.complex128)
    force_noise = campaign.force_noise * _white(rng, count, rows, lines)
    acceleration_noise = campaign.acceleration_noise * _white(rng, count, rows, lines)
    for effect in effects:
        force = force * effect.bounced(rng, frequency, (count, rows))
        acceleration_noise = acceleration_noise + effect.hummed(rng, frequency, (count, rows))
    acceleration = force * (accelerance + place * slope)
    return Blows(np.asarray(force + force_noise), np.asarray(acceleration + acceleration_noise))


def record_frequency() -> Real:
    """(lines,) Hz, every line of a record above zero, up to half its sample rate."""
    return np.asarray(np.arange(1, round(SAMPLE_RATE / LINE_SPACING / 2) + 1) * LINE_SPACING, dtype=np.float64)


def record(spectrum: Complex) -> Real:
    """(samples,) of the record whose spectrum at `record_frequency` is (lines,), pulse after `PRETRIGGER`.

    The anti-alias filter is flat to 0.45 of the rate and without delay, on both channels alike.
    """
    frequency = record_frequency()
    edge = np.clip((frequency / SAMPLE_RATE - 0.45) / 0.05, 0.0, 1.0)
    late = np.exp(-2j * np.pi * frequency * PRETRIGGER) * np.cos(0.5 * np.pi * edge) ** 2
    # the pulse has an impulse at 0 Hz too, next to that of the first line
    whole = np.concatenate([[spectrum[0].real], spectrum * late])
    return np.asarray(np.fft.irfft(whole, round(SAMPLE_RATE * RECORD_SECONDS)) * SAMPLE_RATE)


def _white(rng: np.random.Generator, count: int, rows: int, lines: int) -> Complex:
    """(count, rows, lines) complex noise of unit variance."""
    parts = rng.standard_normal((count, rows, lines, 2), dtype=np.float32)
    return np.asarray(parts.view(np.complex64)[..., 0] * np.float32(np.sqrt(0.5)))


@dataclass(frozen=True, eq=False)
class Averaged:
    """H1 accelerance in (m/s^2)/N and coherence of some rows, (rows, lines)."""

    accelerance: Complex
    coherence: Real


def average(blows: Blows) -> Averaged:
    """H1 and ordinary coherence over the blows (Bendat and Piersol, Random Data, 4th ed., 6.1.4)."""
    cross = np.sum(blows.acceleration * np.conj(blows.force), axis=0)
    force_power = np.sum(np.abs(blows.force) ** 2, axis=0)
    acceleration_power = np.sum(np.abs(blows.acceleration) ** 2, axis=0)
    return Averaged(cross / force_power, np.abs(cross) ** 2 / (force_power * acceleration_power))


def noise_deviation(accelerance: Complex, frequency: Real, campaign: Campaign, peak_force: float) -> Real:
    """(rows, lines) standard deviation per real and imaginary part of an average, from sensor noise alone."""
    force = half_sine_spectrum(frequency, peak_force, campaign.pulse_width)
    noise = np.hypot(campaign.acceleration_noise, campaign.force_noise * np.abs(accelerance))
    return np.asarray(noise / force / np.sqrt(2 * AVERAGES))


def direct_deviation(campaign: Campaign) -> Real:
    """(points,) relative standard deviation of the tester's complex stiffness, per real and imaginary part."""
    return np.asarray(1e-3 * campaign.direct_noise * 0.1 / campaign.points.amplitude_pp_mm)


def sine_fit(rng: np.random.Generator, stiffness: Complex, deviation: Real) -> Complex:
    """(points,) dynamic stiffness with a sine fit's scatter."""
    noise = rng.standard_normal(stiffness.size) + 1j * rng.standard_normal(stiffness.size)
    return np.asarray(stiffness + np.abs(stiffness) * deviation * noise)
