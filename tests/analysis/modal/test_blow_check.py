"""Blows are judged on synthetic records behind anti-alias filters, which ring after every short pulse."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy import signal

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.modal.blow_check import BlowFault, BlowLimits, BlowVerdict, check_blow, check_point
from simlab.bench import ordinary_bench
from simlab.clock import Clock

LIMITS = BlowLimits(lowest_peak_force=10.0)
OVERSAMPLING = 16
SAMPLES = 1024
TRIGGER = 100


@dataclass(frozen=True)
class Bounce:
    fraction: float
    delay: float  # s


def contact(time: Real, width: float, shape: str) -> Real:
    """A contact of the hammer centred at 0, height 1."""
    inside = np.abs(time) < width / 2
    arch = np.cos(np.pi * np.where(inside, time, 0) / width)
    return np.where(inside, arch if shape == "half-sine" else arch**2, 0.0)


@cache
def filter_response(kind: str) -> Complex:
    """Anti-alias filter at the lines of a record that is sampled `OVERSAMPLING` times as fast."""
    # cycles per sample of the slow rate
    cycles = np.asarray(np.fft.rfftfreq(SAMPLES * OVERSAMPLING, 1 / OVERSAMPLING), dtype=np.float64)
    if kind == "linear-phase":  # as in a sigma-delta converter: flat to 0.453, nothing above 0.547
        return np.interp(cycles, [0.453, 0.547], [1, 0]).astype(np.complex128)
    design = signal.butter(8, 0.4, analog=True, output="zpk")
    if kind == "elliptic":
        design = signal.ellip(8, 0.1, 80, 0.45, analog=True, output="zpk")
    return np.asarray(signal.freqs_zpk(*design, worN=cycles)[1], dtype=np.complex128)


FILTERS = ("linear-phase", "butterworth", "elliptic")


def force_record(
    rng: np.random.Generator, rate: float, kind: str, peak: float, noise: float, bounce: Bounce | None = None
) -> Real:
    """A blow as a converter at `rate` sees it."""
    width, shape = rng.uniform(0.3e-3, 2e-3), rng.choice(["half-sine", "sine-squared"])
    fine = SAMPLES * OVERSAMPLING
    time = (np.arange(fine) / OVERSAMPLING - TRIGGER - rng.uniform(0, 1)) / rate
    force = contact(time, width, shape)
    if bounce is not None:
        force = force + bounce.fraction * contact(time - width - bounce.delay, width * rng.uniform(0.95, 1.05), shape)
    spectrum = np.fft.rfft(force) * filter_response(kind)
    return peak * np.fft.irfft(spectrum, fine)[::OVERSAMPLING] + noise * rng.standard_normal(SAMPLES)


def ringing_beam(rng: np.random.Generator, rate: float) -> Real:
    time = (np.arange(SAMPLES) - TRIGGER) / rate
    ring = np.where(time > 0, np.exp(-30 * time) * np.sin(2 * np.pi * 80 * time), 0.0)
    return (40 * ring + 0.02 * rng.standard_normal(SAMPLES))[None, :]


def judged(seed: int, bounce: Bounce | None = None, limits: BlowLimits = LIMITS) -> BlowVerdict:
    """A blow drawn from the seed: rate, filter, width, shape, force and noise."""
    rng = np.random.default_rng(seed)
    rate = float(rng.choice([4096.0, 5120.0, 25600.0]))
    peak = float(np.exp(rng.uniform(np.log(30), np.log(500))))
    noise = rng.uniform(0.002, 0.05)
    force = force_record(rng, rate, FILTERS[seed % 3], peak, noise, bounce)
    return check_blow(force, ringing_beam(rng, rate), rate, TRIGGER, limits)


def clean_force(peak: float = 100.0) -> Real:
    rng = np.random.default_rng(0)
    time = (np.arange(SAMPLES) - TRIGGER) / 4096.0
    return peak * contact(time, 1e-3, "half-sine") + 0.02 * rng.standard_normal(SAMPLES)


def beam() -> Real:
    return ringing_beam(np.random.default_rng(1), 4096.0)


def test_a_clean_single_blow_is_never_refused() -> None:
    refused = {seed: verdict.reasons for seed in range(1000) if not (verdict := judged(seed)).accepted}
    assert refused == {}


def test_a_bounce_at_the_limit_is_missed_in_less_than_one_blow_in_a_hundred() -> None:
    missed = 0
    for seed in range(600):
        delay = np.random.default_rng([seed, 1]).uniform(2.5e-3, 30e-3)
        missed += judged(seed, Bounce(LIMITS.bounce, delay)).accepted
    assert missed <= 6


def test_a_double_hit_is_told_with_its_size_and_delay() -> None:
    force = clean_force()
    force += np.roll(0.2 * force, 41)
    verdict = check_blow(force, beam(), 4096.0, TRIGGER, LIMITS)
    assert verdict.faults == (BlowFault.DOUBLE_HIT,)
    assert verdict.second_contact == pytest.approx(0.2, rel=0.02)
    assert "20." in str(verdict.reasons[0])
    assert "10.0 ms after" in str(verdict.reasons[0])


def test_a_contact_before_the_peak_is_a_double_hit_too() -> None:
    force = clean_force()
    force += np.roll(0.3 * force, -20)
    verdict = check_blow(force, beam(), 4096.0, TRIGGER, LIMITS)
    assert BlowFault.DOUBLE_HIT in verdict.faults
    assert "4.9 ms before" in str(verdict.reasons[0])


def test_a_weak_blow_is_refused_with_its_peak_in_the_reason() -> None:
    verdict = check_blow(clean_force(peak=6.0), beam(), 4096.0, TRIGGER, LIMITS)
    assert verdict.faults == (BlowFault.WEAK,)
    assert "6.0 N" in str(verdict.reasons[0])
    assert "10 N" in str(verdict.reasons[0])


def test_a_blow_too_noisy_to_see_a_bounce_is_refused_as_weak() -> None:
    rng = np.random.default_rng(2)
    verdict = check_blow(clean_force(20.0) + 0.5 * rng.standard_normal(SAMPLES), beam(), 4096.0, TRIGGER, LIMITS)
    assert verdict.faults == (BlowFault.WEAK,)
    assert "noise hides" in str(verdict.reasons[0])


def test_a_record_that_does_not_move_between_contacts_is_refused_for_what_it_is() -> None:
    force = np.round(clean_force(60.0) / 2.0) * 2.0
    verdict = check_blow(force, beam(), 4096.0, TRIGGER, LIMITS)
    assert BlowFault.WEAK in verdict.faults
    reason = next(str(reason) for reason in verdict.reasons if reason.fault is BlowFault.WEAK)
    assert "does not move at all" in reason
    assert "noise hides" not in reason


def test_an_overload_that_the_device_reports_refuses_the_blow() -> None:
    verdict = check_blow(clean_force(), beam(), 4096.0, TRIGGER, LIMITS, overloaded=True)
    assert verdict.faults == (BlowFault.OVERLOAD,)
    assert "100 N" in str(verdict.reasons[0])


@pytest.mark.parametrize("channel", ["force", "accelerometer 1"])
def test_a_clipped_channel_is_named(channel: str) -> None:
    force, acceleration = clean_force(), beam()
    if channel == "force":
        force = np.minimum(force, 60.0)
    else:
        acceleration = np.clip(acceleration, -25.0, 25.0)
    verdict = check_blow(force, acceleration, 4096.0, TRIGGER, LIMITS)
    assert verdict.faults == (BlowFault.CLIPPED,)
    assert channel in str(verdict.reasons[0])


def quantised(signal: Real, full_scale: float, bits: int) -> Real:
    step = 2 * full_scale / 2**bits
    return np.asarray(np.clip(np.round(signal / step), -(2 ** (bits - 1)), 2 ** (bits - 1) - 1) * step)


def test_two_samples_at_the_end_of_a_24_bit_converter_are_enough() -> None:
    blunt = clean_force() + np.roll(clean_force(), 1)  # two samples at the crest
    force = quantised(blunt, 150.0, 24)
    assert np.count_nonzero(force == force.max()) == 2
    verdict = check_blow(force, quantised(beam(), 500.0, 24), 4096.0, TRIGGER, LIMITS)
    assert verdict.faults == (BlowFault.CLIPPED,)
    assert "2 samples stand at its extreme, 150" in str(verdict.reasons[0])


@pytest.mark.parametrize("bits", [12, 16, 24])
def test_the_steps_of_a_converter_are_not_taken_for_clipping(bits: int) -> None:
    """Coarse steps make two samples equal at the crest in many a blow."""
    for seed in range(100):
        rng = np.random.default_rng(seed)
        force = force_record(rng, 4096.0, FILTERS[seed % 3], 100.0, 0.02)
        acceleration = quantised(ringing_beam(rng, 4096.0), 500.0, bits)
        verdict = check_blow(quantised(force, 2200.0, bits), acceleration, 4096.0, TRIGGER, LIMITS)
        assert BlowFault.CLIPPED not in verdict.faults, verdict.reasons


def test_a_peak_far_from_the_trigger_is_a_late_trigger() -> None:
    verdict = check_blow(clean_force(), beam(), 4096.0, TRIGGER - 30, LIMITS)
    assert verdict.faults == (BlowFault.LATE_TRIGGER,)
    assert "7.3 ms after" in str(verdict.reasons[0])


def test_a_dead_accelerometer_is_named() -> None:
    rng = np.random.default_rng(3)
    alive, dead = beam()[0], 0.02 * rng.standard_normal(SAMPLES)
    verdict = check_blow(clean_force(), np.array([alive, dead]), 4096.0, TRIGGER, LIMITS)
    assert verdict.faults == (BlowFault.NO_RESPONSE,)
    assert "accelerometer 2" in str(verdict.reasons[0])


def test_an_accelerometer_that_reads_zero_throughout_is_dead() -> None:
    verdict = check_blow(clean_force(), np.zeros(SAMPLES), 4096.0, TRIGGER, LIMITS)
    assert verdict.faults == (BlowFault.NO_RESPONSE,)


def test_a_soft_tip_is_refused_only_where_a_highest_frequency_is_asked_for() -> None:
    time = (np.arange(SAMPLES) - TRIGGER) / 4096.0
    soft = 100 * np.exp(-((time / 1.2e-3) ** 2)) + 0.01 * np.random.default_rng(0).standard_normal(SAMPLES)
    asked = BlowLimits(lowest_peak_force=10.0, highest_frequency=1024.0)
    assert check_blow(soft, beam(), 4096.0, TRIGGER, LIMITS).accepted
    verdict = check_blow(soft, beam(), 4096.0, TRIGGER, asked)
    assert verdict.faults == (BlowFault.SOFT,)
    assert "1024 Hz" in str(verdict.reasons[0])
    assert check_blow(clean_force(), beam(), 4096.0, TRIGGER, asked).accepted


def test_a_record_without_pre_trigger_cannot_be_judged() -> None:
    with pytest.raises(AnalysisError, match="longer pre-trigger"):
        check_blow(clean_force(), beam(), 4096.0, 10, LIMITS)


def test_records_of_different_length_are_refused() -> None:
    with pytest.raises(AnalysisError, match="equal samples"):
        check_blow(clean_force()[:-1], beam(), 4096.0, TRIGGER, LIMITS)


RATE, SAMPLES = 4096.0, 8192
BAND = (20.0, 1024.0)


def blows(*points: str, seed: int = 1) -> tuple[Real, Real]:
    """Records of clean blows at these points, one after the other."""
    bench = ordinary_bench(seed, Clock())
    records = []
    for number, point in enumerate(points):
        bench.strike(int(point[:-1]), point[-1], at=1 + 5.0 * number, what="clean")
        records.append(bench.hammer_signals(0.95 + 5.0 * number, RATE, SAMPLES))
    return np.array([each["hammer"] for each in records]), np.array([each["accelerometer"] for each in records])


@pytest.mark.parametrize("point", ["1y", "6y", "9y", "1x"])
def test_blows_at_one_mark_fit_each_other(point: str) -> None:
    force, acceleration = blows(*[point] * 6)
    for count in range(7):
        assert check_point(force[:count], acceleration[:count], RATE, BAND) == (None,) * count


@pytest.mark.parametrize("wrong", range(4))
def test_a_blow_at_the_neighbouring_point_is_found_wherever_it_came(wrong: int) -> None:
    struck = ["8y"] * 4
    struck[wrong] = "9y"
    found = check_point(*blows(*struck), RATE, BAND)
    assert [reason is not None for reason in found] == [blow == wrong for blow in range(4)]
    reason = found[wrong]
    assert reason is not None
    assert reason.fault is BlowFault.INCONSISTENT
    assert "was another point struck?" in str(reason)


def test_the_difference_is_told_in_figures() -> None:
    reason = check_point(*blows("3y", "3y", "3y", "4y"), RATE, BAND)[3]
    assert "between 20 and 1024 Hz its accelerance differs from theirs by 4" in str(reason)
    assert "those from each other by 4 %" in str(reason)


def test_a_blow_from_the_other_side_is_told_as_such() -> None:
    force, acceleration = blows("5y", "5y", "5y", "5y")
    acceleration[1] *= -1
    found = check_point(force, acceleration, RATE, BAND)
    assert [reason is not None for reason in found] == [False, True, False, False]
    assert "opposite sign" in str(found[1])


def test_of_two_blows_nobody_knows_which_is_wrong() -> None:
    assert check_point(*blows("8y", "9y"), RATE, BAND) == (None, None)


def test_nothing_is_told_where_blows_disagree_anyway() -> None:
    """Along the beam a lean of a degree changes the accelerance by as much as it is large."""
    assert check_point(*blows("1x", "1x", "1x", "1x", "11x"), RATE, BAND) == (None,) * 5


def test_records_that_do_not_belong_together_are_refused() -> None:
    force, acceleration = blows("8y", "8y", "8y")
    with pytest.raises(AnalysisError, match="give equal ones"):
        check_point(force[:, :-1], acceleration, RATE, BAND)
    with pytest.raises(AnalysisError, match="no lines between 3000 and 4000 Hz"):
        check_point(force, acceleration, RATE, (3000.0, 4000.0))


def under_hum(size: float, drift: float, bounce: Bounce | None = None) -> BlowVerdict:
    """A hard blow at 4096 Hz beside mains at 50.03 Hz of `size` N and a force that drifts by `drift` N."""
    rng = np.random.default_rng(5)
    force = force_record(rng, 4096.0, FILTERS[0], 400.0, 0.05, bounce)
    time = np.arange(SAMPLES) / 4096.0
    force = force + size * np.cos(2 * np.pi * 50.03 * time + 1) + size / 3 * np.cos(2 * np.pi * 150.09 * time)
    return check_blow(force + drift * time / time[-1], ringing_beam(rng, 4096.0), 4096.0, TRIGGER, LIMITS)


@pytest.mark.parametrize(("size", "drift"), [(12.0, 0.0), (0.0, 60.0), (8.0, 30.0)])
def test_hum_or_drift_beside_a_hard_blow_does_not_make_it_weak(size: float, drift: float) -> None:
    assert under_hum(size, drift).accepted


def test_a_bounce_in_hum_is_still_a_double_hit() -> None:
    assert under_hum(12.0, 0.0, Bounce(0.08, 0.01)).faults == (BlowFault.DOUBLE_HIT,)
