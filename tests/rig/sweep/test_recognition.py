"""Recognising planned points in records, without instruments."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.block import Block
from rig.sequences.sweep_plan import Sine
from rig.sweep.recognition import NotAPointError, check_channels, check_settled, motion_in, planned_as
from tests.channels import TESTER_CHANNELS

RATE = 5000.0
COUNT = 1e-6  # V
TIME = np.arange(0.0, 1.0, 1 / RATE)
PRESET, STIFFNESS = 5e-4, 5e5 + 5e4j
SINES = (Sine(1, 1e-4, 20.0, 20.0), Sine(2, 1e-4, 50.0, 48.0), Sine(3, 5e-5, 50.0, 48.0), Sine(4, 5e-5, 200.0, 198.0))
LEAST_PP = 2.5e-5
TOLERANCE = 0.02
NOISE = 0.05 * np.random.default_rng(2).standard_normal(TIME.size)  # N


def block_of(displacement: NDArray[np.float64], force: NDArray[np.float64] | None = None) -> Block:
    force = np.zeros_like(displacement) if force is None else force
    volts = [
        values * channel.sensitivity for values, channel in zip((displacement, force), TESTER_CHANNELS, strict=True)
    ]
    counts = np.rint(np.array(volts) / COUNT).astype(np.int32)
    return Block(TESTER_CHANNELS, counts, ((0.0, COUNT),) * 2, RATE, datetime(2026, 1, 1, tzinfo=UTC))


def record(
    amplitude_pp: float = 1e-4, frequency: float = 48.0, preset: float = PRESET, stiffness: complex = STIFFNESS
) -> Block:
    turning = amplitude_pp / 2 * np.exp(2j * np.pi * frequency * TIME)
    return block_of(preset + turning.real, 100.0 + (stiffness * turning).real)


@pytest.mark.parametrize(
    ("amplitude_pp", "frequency", "number"),
    [
        (1e-4, 20.0, 1),
        (1e-4, 48.0, 2),
        (5e-5, 48.0, 3),
        (5e-5, 198.0, 4),
        (1.09e-4, 48.0, 2),
        (0.91e-4, 48.0, 2),
        (1e-4, 48.09, 2),
        (1e-4, 47.91, 2),
        (1.12e-4, 48.0, None),
        (0.88e-4, 48.0, None),
        (1e-4, 48.15, None),
        (1e-4, 47.85, None),
        (1e-4, 50.0, None),  # at the mains, where another frequency is planned
        (7.5e-5, 48.0, None),
        (1e-4, 96.0, None),
        (1e-4, 198.0, None),
    ],
)
def test_a_motion_is_the_point_that_it_agrees_with_in_both(
    amplitude_pp: float, frequency: float, number: int | None
) -> None:
    fit = motion_in(record(amplitude_pp, frequency), LEAST_PP)
    found = planned_as(fit, SINES)
    assert (None if found is None else found.order_number) == number
    assert fit.frequency == pytest.approx(frequency, rel=1e-5)
    assert fit.amplitude_pp[0] == pytest.approx(amplitude_pp, rel=1e-3)
    check_settled(fit, TOLERANCE)


def test_of_two_planned_points_within_reach_the_nearer_one_is_meant() -> None:
    close = (Sine(1, 1e-4, 100.0, 100.0), Sine(2, 1e-4, 100.2, 100.2), Sine(3, 0.95e-4, 100.2, 100.2))
    for sine in close:
        assert planned_as(motion_in(record(sine.amplitude_pp, sine.frequency), LEAST_PP), close) is sine


@pytest.mark.parametrize(
    ("displacement", "why"),
    [
        (np.full_like(TIME, PRESET), "one value alone"),
        (PRESET + 1e-7 * np.random.default_rng(1).standard_normal(TIME.size), "nothing moves|no steady sine"),
        (PRESET + 1e-5 * np.cos(2 * np.pi * 48 * TIME), "nothing moves"),
        (PRESET * TIME, "nothing moves|no steady sine"),
    ],
)
def test_what_does_not_cycle_is_said(displacement: NDArray[np.float64], why: str) -> None:
    with pytest.raises(NotAPointError, match=why):
        motion_in(block_of(displacement), LEAST_PP)


def test_a_saturated_displacement_is_no_motion() -> None:
    with pytest.raises(NotAPointError, match="end of its range"):
        motion_in(replace(record(), overloaded=("displacement",)), LEAST_PP)


def turning(frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
    return np.asarray(np.exp(2j * np.pi * np.cumsum(frequency) / RATE))


WHOLE = turning(np.full_like(TIME, 48.0))


@pytest.mark.parametrize(
    ("motion", "why"),
    [
        (WHOLE * (1 + 0.05 * TIME), "amplitude"),
        (WHOLE * (1 - 0.05 * TIME), "amplitude"),
        (WHOLE * np.where(TIME < 0.5, 1.0, 1.05), "amplitude"),
        (WHOLE * (1 - np.exp(-TIME / 0.1)), "amplitude"),
        (WHOLE * (TIME < 0.95), "amplitude"),
        (WHOLE * (TIME < 0.97), "amplitude"),
        (WHOLE * (TIME > 0.04), "amplitude"),
        (turning(48.0 * (1 + 0.01 * (TIME - 0.5))), "frequency"),
        (turning(np.where(TIME < 0.5, 47.9, 48.1)), "frequency"),
        (WHOLE + 0.3 * turning(np.full_like(TIME, 131.0)), "other frequencies|amplitude"),
        (WHOLE + 0.25 * turning(np.full_like(TIME, 96.0)), "other frequencies"),
    ],
)  # fmt: skip
def test_a_record_that_changes_is_refused(motion: NDArray[np.complex128], why: str) -> None:
    fit = motion_in(block_of(PRESET + 5e-5 * motion.real), LEAST_PP)
    with pytest.raises(NotAPointError, match=why):
        check_settled(fit, TOLERANCE)


@pytest.mark.parametrize("tolerance", [0.02, 0.05])
def test_a_noisy_machine_is_settled_in_most_records(tolerance: float) -> None:
    chance, settled = np.random.default_rng(3), 0
    for _ in range(50):
        cycles = 1 + tolerance * chance.standard_normal(60)
        wandering = np.interp(48.0 * TIME, np.arange(60), cycles)
        try:
            check_settled(motion_in(block_of(PRESET + 5e-5 * (wandering * WHOLE).real), LEAST_PP), tolerance)
        except NotAPointError:
            continue
        settled += 1
    assert settled > 35


def checked(block: Block, *, is_specimen: bool = True) -> None:
    check_channels(block, motion_in(block, LEAST_PP), PRESET, is_specimen=is_specimen)


@pytest.mark.parametrize("stiffness", [STIFFNESS, -STIFFNESS.real + STIFFNESS.imag * 1j])
def test_a_specimen_whose_force_leads_is_taken_also_above_the_resonance_of_what_moves_with_it(
    stiffness: complex,
) -> None:
    checked(record(stiffness=stiffness))


@pytest.mark.parametrize(
    ("block", "why"),
    [
        (record(preset=4.4e-4), "it moves about 0.44 mm"),
        (record(preset=5.6e-4), "it moves about 0.56 mm"),
        (record(preset=-5e-4), "it moves about -0.5 mm"),
        (record(stiffness=-STIFFNESS), "polarity"),
        (record(stiffness=STIFFNESS.conjugate()), "polarity"),
        (block_of(record().value("displacement")), "force is constant"),
        (block_of(record().value("displacement"), NOISE), "no force follows"),
        (replace(record(), overloaded=("force",)), "force channel is at an end"),
    ],
)
def test_what_the_channels_say_against_a_point_is_told(block: Block, why: str) -> None:
    with pytest.raises(NotAPointError, match=why):
        checked(block)


def test_a_known_piece_may_give_no_force_and_a_mass_pulls() -> None:
    checked(block_of(record().value("displacement"), NOISE), is_specimen=False)
    checked(record(stiffness=-STIFFNESS), is_specimen=False)
    with pytest.raises(NotAPointError, match="end of its range"):
        checked(replace(record(), overloaded=("force",)), is_specimen=False)
