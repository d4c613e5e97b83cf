"""From what is to what a lab gets: H1 accelerance and coherence of ten blows, and a sine fit's scatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simlab.assembly import Complex
from simlab.beam import Real
from simlab.case.campaign import AVERAGES, Campaign

FORCE_SCATTER = 0.1
"""Standard deviation of the hand's peak force from blow to blow, relative."""


@dataclass(frozen=True, eq=False)
class Averaged:
    """H1 accelerance in (m/s^2)/N and coherence of some rows, (rows, lines)."""

    accelerance: Complex
    coherence: Real


def half_sine_spectrum(frequency: Real, peak_force: float, width: float) -> Real:
    """(lines,) magnitude of the Fourier transform in N s of a half-sine pulse of `width` s from foot to foot."""
    ratio = frequency * width
    # at ratio 1/2 numerator and denominator vanish together; their quotient tends to pi / 4
    close = np.abs(ratio - 0.5) < 1e-6
    safe = np.where(close, 0.0, ratio)
    shape = np.where(close, np.pi / 4, np.cos(np.pi * safe) / (1.0 - 4.0 * safe**2))
    return np.asarray(2.0 / np.pi * peak_force * width * np.abs(shape))


def average(
    rng: np.random.Generator,
    accelerance: Complex,
    slope: Complex,
    frequency: Real,
    campaign: Campaign,
    peak_force: float,
) -> Averaged:
    """Ten blows a row, each a little elsewhere and differently hard, with noise on force and acceleration.

    Args:
        accelerance, slope: (rows, lines) true accelerance and its change along the bar, per m.
        frequency: (lines,) Hz.
    """
    rows, lines = accelerance.shape
    peak = 1.0 + FORCE_SCATTER * np.clip(rng.standard_normal((AVERAGES, rows, 1)), -3, 3)
    place = campaign.place_scatter * np.clip(rng.standard_normal((AVERAGES, rows, 1)), -3, 3)
    true_force = peak * half_sine_spectrum(frequency, peak_force, campaign.pulse_width)
    acceleration = true_force * (accelerance + place * slope) + campaign.acceleration_noise * _white(rng, rows, lines)
    force = true_force + campaign.force_noise * _white(rng, rows, lines)
    cross = np.sum(acceleration * np.conj(force), axis=0)
    force_power = np.sum(np.abs(force) ** 2, axis=0)
    acceleration_power = np.sum(np.abs(acceleration) ** 2, axis=0)
    return Averaged(cross / force_power, np.abs(cross) ** 2 / (force_power * acceleration_power))


def noise_deviation(accelerance: Complex, frequency: Real, campaign: Campaign, peak_force: float) -> Real:
    """(rows, lines) standard deviation of the real, as of the imaginary part of `average`, sensor noise alone."""
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


def _white(rng: np.random.Generator, rows: int, lines: int) -> Complex:
    """(averages, rows, lines) complex noise of unit variance."""
    parts = rng.standard_normal((AVERAGES, rows, lines, 2), dtype=np.float32)
    return np.asarray(parts.view(np.complex64)[..., 0] * np.float32(np.sqrt(0.5)))
