"""What a lab makes of its records: H1 accelerance and coherence of ten blows, and the scatter of a sine fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simlab.beam import Real
from simlab.case.blows import Blows, half_sine_spectrum
from simlab.case.campaign import AVERAGES, Campaign
from simlab.coupling import Complex


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
    """(rows, lines) standard deviation of the real, as of the imaginary part of an average, sensor noise alone."""
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
