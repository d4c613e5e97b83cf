"""Mains hum under sine points: flagged where it matters, and in the interval."""

import numpy as np
import pytest

from analysis.direct.dynamic_stiffness import DynamicStiffness, dynamic_stiffness
from analysis.direct.mains_hum import hum_of, tones_beside, with_hum
from analysis.frequency_response import Real

RATE, TRUTH = 2560.0, 2.3e6 * (1 + 0.12j)
FREQUENCIES = np.arange(5.0, 201.0, 5.0)
FORCE = abs(TRUTH) * 50e-6


def record(rng: np.random.Generator, frequency: float, hum: float, noise: float = 1e-4) -> Real:
    """(2, samples) 24 cycles or 0.5 s; the mains is at 50.02 Hz, with half of its size at 100 and a third at 150 Hz."""
    time = np.arange(round(max(24.0, 0.5 * frequency) / frequency * RATE)) / RATE
    wave = 50e-6 * np.exp(2j * np.pi * frequency * time)
    mains = sum(hum / m * np.cos(2 * np.pi * m * 50.02 * time + rng.uniform(0, 2 * np.pi)) for m in (1, 2, 3))
    sensor = noise * rng.standard_normal((2, time.size))
    return np.stack([wave.real + 50e-6 * sensor[0], (TRUTH * wave).real + FORCE * (mains + sensor[1])])


def sweep(seed: int, hum: float, noise: float = 1e-4) -> dict[float, tuple[DynamicStiffness, DynamicStiffness]]:
    """Points at some frequencies as measured, and with what the run knows of its hum."""
    rng = np.random.default_rng(seed)
    records = {frequency: record(rng, frequency, hum, noise) for frequency in FREQUENCIES.tolist()}
    found = hum_of(tones_beside(each, RATE, frequency) for frequency, each in records.items())
    points = {
        frequency: dynamic_stiffness(records[frequency][0], records[frequency][1], RATE, frequency)
        for frequency in (45.0, 50.0, 150.0)
    }
    return {
        frequency: (point, with_hum(point, records[frequency].shape[1] / RATE, found))
        for frequency, point in points.items()
    }


@pytest.mark.parametrize("noise", [1e-4, 1e-2])
def test_a_sine_at_the_mains_is_flagged_wherever_its_hum_matters_and_unflagged_intervals_hold(noise: float) -> None:
    held, missed, bad = [], 0, 0
    for seed in range(40):
        hum = 0.02 * np.random.default_rng([seed, 1]).random() ** 4
        for frequency, (plain, point) in sweep(seed, hum, noise).items():
            low, high = point.stiffness_estimate.interval()
            matters = frequency > 45 and hum * 50 / frequency * abs(TRUTH) > plain.stiffness_estimate.half_width()
            bad += matters
            missed += matters and point.first_harmonic_sufficient
            if point.first_harmonic_sufficient:
                held.append(low <= TRUTH.real <= high)
    assert bad > 30
    assert missed == 0
    assert np.mean(held) > 0.9


def test_a_run_without_hum_has_no_remark_and_hardly_wider_intervals() -> None:
    plain, point = sweep(0, 0.0)[50.0]
    assert not point.remarks
    assert point.stiffness_estimate.standard_error < 1.3 * plain.stiffness_estimate.standard_error


def test_the_remark_says_how_far_k_may_be_off_and_what_to_do() -> None:
    _, point = sweep(1, 0.007)[50.0]
    (said,) = point.shortcomings
    assert said.startswith("mains hum of 50 Hz shifts k by up to 0.7")
    assert said.endswith("measure beside 50 Hz")
    low, high = point.stiffness_estimate.interval()
    assert low <= TRUTH.real <= high
