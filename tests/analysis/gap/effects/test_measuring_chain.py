"""Effects of the measuring chain by their laws, in numbers."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.catalogue import candidates
from analysis.gap.effects.measuring_chain import (
    ChannelDelay,
    ExponentialWindow,
    HighpassCorner,
    SecondOrderCorner,
    SensorGain,
)
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.baseline import Baseline
from analysis.gap.simulation.free_beam_modes import BeamModes
from tests.analysis.gap.conftest import at_centre
from tests.analysis.gap.effects.readings import read


def test_every_law_answers_for_points_that_were_not_struck(
    empty: Measurement, modes: BeamModes, baseline: Baseline
) -> None:
    unseen = tuple(Dof(node, Direction.Y) for node in (5, 8))
    first = np.zeros(len(unseen), dtype=np.intp)
    struck_at = Setting(unseen, empty.sets[0].frequency, np.array([100.0]), first, first)
    mounting = baseline.mounting(at_centre(baseline))
    for effect in candidates(empty):
        found = effect.beam(at_centre(effect), baseline.beam(at_centre(baseline), struck_at, mounting), struck_at)
        assert found.blow_offset.shape == found.lean.shape == (2,), effect.law


def test_a_gain_is_one_factor_on_all_rows(empty: Measurement, modes: BeamModes) -> None:
    once, more = (read(SensorGain(), empty, modes, gain=gain) for gain in (0.0, 0.04))
    assert np.allclose(more, 1.04 * once, rtol=1e-12)


def test_a_delay_turns_the_phase_back_in_proportion_to_frequency(empty: Measurement, modes: BeamModes) -> None:
    prompt, late = (read(ChannelDelay(), empty, modes, tau=tau) for tau in (0.0, 4e-5))
    expected = np.exp(-2j * np.pi * empty.sets[0].frequency * 4e-5)
    assert np.allclose(late / prompt, expected, rtol=1e-9)


def test_a_highpass_corner_halves_the_power_at_its_corner(bench: BeamBench, setting: Setting) -> None:
    at_corner = replace(bench, pole=np.array([2j * np.pi * 3.0, 2j * np.pi * 300.0]))
    first, second = (
        law.beam({"corner": 3.0}, at_corner, setting).chain[0] for law in (HighpassCorner(), SecondOrderCorner())
    )
    assert np.abs(first[0]) == pytest.approx(np.sqrt(0.5))
    assert np.abs(second[0]) == pytest.approx(np.sqrt(0.5))
    assert np.degrees(np.angle([first[0], second[0]])) == pytest.approx([45.0, 90.0])
    assert np.angle(first[1]) == pytest.approx(3.0 / 300.0, rel=1e-3)
    assert np.abs([first[1], second[1]]) == pytest.approx(1.0, abs=1e-4)


def test_a_window_evaluates_beside_the_axis_of_frequency(empty: Measurement, modes: BeamModes) -> None:
    """H is analytic, so a shift of the pole by s is one of i s in frequency: every mode gains s of half-width."""
    near = np.arange(70.0, 80.0, 0.05)
    shape = len(empty.sets[0].inputs), near.size
    fine = replace(
        empty.sets[0], frequency=near, accelerance=np.ones(shape, dtype=complex), deviation=np.full(shape, 1.0)
    )
    measurement = replace(empty, sets=(fine,))
    once, shifted = (read(ExponentialWindow(), measurement, modes, s=s) for s in (0.0, 0.02))
    by_pole = -1j * np.gradient(once, 2 * np.pi * near, axis=1)[:, 1:-1]
    assert np.allclose((shifted - once)[:, 1:-1] / 0.02, by_pole, rtol=0, atol=2e-3 * np.max(np.abs(by_pole)))


def test_a_window_that_is_stated_is_no_effect(empty: Measurement, modes: BeamModes) -> None:
    """What a window of 2 1/s does is explained by stating it, and by nothing else beside."""
    stated = replace(empty, sets=tuple(replace(each, decay=2.0) for each in empty.sets))
    with_effect, as_stated = (
        read(ExponentialWindow(), empty, modes, s=2.0),
        read(ExponentialWindow(), stated, modes, s=0.0),
    )
    np.testing.assert_allclose(as_stated, with_effect, rtol=1e-9)
