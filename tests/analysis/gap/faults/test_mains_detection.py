"""Mains hum is found in the silence after blows and in coherence, and its lines are left out."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.frequency_response import Real
from analysis.gap.faults.mains_detection import MainsTones, mains_hum, without_leakage, without_tones
from analysis.gap.measurement import HammerSet, Measurement, RawBlow

RATE, SECONDS, NOISE = 4096.0, 2.0, 0.01
POINTS = (Dof(1, Direction.Y), Dof(6, Direction.Y))


def ringing(frequency: float, decay: float, tones: dict[float, float], seed: int) -> RawBlow:
    """A beam that rings down under noise, beside tones (amplitude by frequency) of any phase."""
    random, time = np.random.default_rng(seed), np.arange(round(RATE * SECONDS)) / RATE
    acceleration = 20 * np.exp(-decay * time) * np.sin(2 * np.pi * frequency * time)
    acceleration += NOISE * random.standard_normal(time.size)
    for tone, amplitude in tones.items():
        acceleration += amplitude * np.sin(2 * np.pi * tone * time + random.uniform(0, 2 * np.pi))
    return RawBlow("blow", POINTS[0], np.zeros(time.size), acceleration, RATE)


def heard(empty: Measurement, frequency: float, decay: float, tones: dict[float, float]) -> MainsTones | None:
    blows = tuple(ringing(frequency, decay, tones, seed) for seed in range(3))
    return mains_hum(replace(empty, blows=blows))


@pytest.mark.parametrize("mains", [50.0, 60.0])
def test_hum_below_the_noise_of_a_sample_is_heard_with_its_size(empty: Measurement, mains: float) -> None:
    found = heard(empty, 77.0, 12.0, {mains: 0.005, 3 * mains: 0.004})
    assert found is not None
    assert (found.mains, found.tones) == (mains, (mains, 3 * mains))
    assert found.amplitude is not None
    value, deviation = found.amplitude
    assert value == pytest.approx(0.005, abs=4 * deviation)
    assert deviation < 0.001


def test_silence_does_not_hum(empty: Measurement) -> None:
    assert heard(empty, 77.0, 12.0, {}) is None


def test_a_beam_that_rings_at_a_multiple_of_the_mains_does_not_hum(empty: Measurement) -> None:
    assert heard(empty, 50.0, 6.0, {}) is None


def test_a_tone_at_one_multiple_alone_is_no_mains(empty: Measurement) -> None:
    assert heard(empty, 77.0, 12.0, {350.0: 0.02}) is None
    assert heard(empty, 77.0, 12.0, {300.0: 0.02, 600.0: 0.02}) is None


def test_a_record_too_short_to_tell_50_from_60_hz_says_nothing(empty: Measurement) -> None:
    blow = ringing(77.0, 12.0, {50.0: 0.5}, 1)
    short = replace(blow, force=blow.force[:2000], acceleration=blow.acceleration[:2000])
    assert mains_hum(replace(empty, blows=(short,))) is None


def averaged(coherence: Real, frequency: Real) -> HammerSet:
    shape = len(POINTS), frequency.size
    ones = np.ones(shape)
    return HammerSet(POINTS, frequency, ones.astype(complex), 1e-3 * ones, 100.0, coherence=coherence * ones)


def test_dips_of_coherence_at_mains_and_a_multiple_are_hum(empty: Measurement) -> None:
    frequency = np.arange(5.0, 400.0, 0.5)
    coherence = np.full(frequency.size, 0.999)
    coherence[np.isin(frequency, [60.0, 180.0])] = 0.9
    found = mains_hum(replace(empty, sets=(averaged(coherence, frequency),)))
    assert found == MainsTones(60.0, (60.0, 180.0))


def test_dips_of_coherence_beside_the_mains_are_no_hum(empty: Measurement) -> None:
    frequency = np.arange(5.0, 400.0, 0.5)
    coherence = np.full(frequency.size, 0.999)
    coherence[np.isin(frequency, [62.0, 186.0])] = 0.5
    assert mains_hum(replace(empty, sets=(averaged(coherence, frequency),))) is None
    broad = 1 - 0.4 / (1 + ((frequency - 100.0) / 6.0) ** 2)
    assert mains_hum(replace(empty, sets=(averaged(broad, frequency),))) is None


def test_lines_of_tones_are_left_out_of_every_set(empty: Measurement) -> None:
    frequency = np.arange(5.0, 400.0, 0.5)
    measured = replace(empty, sets=(averaged(np.full(frequency.size, 0.9), frequency),) * 2)
    for each in without_tones(measured, MainsTones(50.0, (50.0, 100.0))).sets:
        gone = np.setdiff1d(frequency, each.frequency)
        assert gone.tolist() == [49.0, 49.5, 50.0, 50.5, 51.0, 99.0, 99.5, 100.0, 100.5, 101.0]
        assert each.coherence is not None
        assert each.coherence.shape == each.accelerance.shape


def test_what_a_tone_off_its_line_leaks_is_taken_off() -> None:
    frequency, random = np.arange(5.0, 400.0, 0.5), np.random.default_rng(2)
    clean = 1 / (1 - (frequency / 77.0) ** 2 + 0.05j * frequency / 77.0) * np.ones((6, 1))
    away = (180.06 - frequency) / 0.5
    heights = random.standard_normal((6, 1)) + 1j * random.standard_normal((6, 1))
    leaked = heights * np.sinc(away) * np.exp(1j * np.pi * away)
    points = tuple(Dof(node, Direction.Y) for node in range(1, 7))
    each = HammerSet(points, frequency, clean + leaked, np.full(clean.shape, 1e-3), 100.0)
    (found,) = without_leakage([each], [180.0])
    beside = np.abs(frequency - 180.0) > 1.2
    assert np.max(np.abs(leaked[:, beside])) > 0.02
    assert np.max(np.abs((found.accelerance - clean)[:, beside])) < 0.1 * np.max(np.abs(leaked[:, beside]))
