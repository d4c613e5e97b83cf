"""Which lines of an apparent stiffness can be a joint's: elastomers can, inertia, resonances and noise cannot."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.inverse.apparent_stiffness import Refusal, identifiable_bands

FREQUENCY = np.arange(5.0, 1000.0, 5.0)
OMEGA = 2 * np.pi * FREQUENCY


def zener(order: float = 0.5, rise: float = 3.0, time: float = 1e-3) -> Complex:
    """A fractional Zener model, N/m."""
    relaxing = (1j * OMEGA * time) ** order
    return np.asarray(1e6 * (1 + rise * relaxing) / (1 + relaxing))


@given(order=st.floats(0.05, 1.0), rise=st.floats(1.0, 20.0), time=st.floats(1e-6, 1.0), error=st.floats(0.0, 0.2))
def test_every_relaxing_solid_is_accepted_at_every_line(order: float, rise: float, time: float, error: float) -> None:
    found = identifiable_bands(FREQUENCY, zener(order, rise, time), error)
    assert found.refused == ()
    assert np.all(found.accepted)


def test_inertia_is_told_where_it_takes_off_half_and_where_it_takes_off_more_than_all() -> None:
    mass = 1e6 / (2 * np.pi * 300.0) ** 2  # as stiff as the joint at 300 Hz
    found = identifiable_bands(FREQUENCY, np.asarray(1e6 * (1 + 0.2j) - OMEGA**2 * mass), 0.01)
    accepted = FREQUENCY[found.accepted]
    assert accepted[-1] == pytest.approx(300 / np.sqrt(2), rel=0.05)
    np.testing.assert_array_equal(accepted, FREQUENCY[: accepted.size])  # one band from the first line
    falling, negative = found.refused[0], found.refused[-1]
    assert falling.refusal is Refusal.FALL
    assert falling.value < -2
    assert falling.highest < 310 < negative.highest == 995.0
    assert (negative.refusal, negative.worst) == (Refusal.STORAGE, 995.0)
    assert negative.value == pytest.approx(1e6 * (1 - (995 / 300) ** 2))


def test_a_resonance_behind_the_joint_is_told() -> None:
    base = 1e6 * (1 + 0.02j) - OMEGA**2 * 1e6 / (2 * np.pi * 400.0) ** 2
    found = identifiable_bands(FREQUENCY, np.asarray(1 / (1 / zener() + 1 / base)), 0.01)
    assert not np.any(found.accepted[np.abs(FREQUENCY / 400 - 1) < 0.1])
    assert np.all(found.accepted[FREQUENCY < 150])


def test_energy_that_comes_out_of_a_joint_is_told() -> None:
    found = identifiable_bands(FREQUENCY, zener().conj(), 0.01)
    assert not np.any(found.accepted)
    assert {band.refusal for band in found.refused} == {Refusal.LOSS}


def test_what_is_uncertain_is_not_refused() -> None:
    lossless = np.full(FREQUENCY.size, 1e6 - 1e4j)
    assert identifiable_bands(FREQUENCY, lossless, 0.006).accepted.all()
    assert not identifiable_bands(FREQUENCY, lossless, 0.004).accepted.any()


def test_noise_alone_is_no_stiffness() -> None:
    rng = np.random.default_rng(3)
    noise = np.asarray(1e6 * rng.standard_normal((FREQUENCY.size, 2)) @ [1, 1j], dtype=np.complex128)
    assert not identifiable_bands(FREQUENCY, noise, 0.05).accepted.any()


def test_a_few_lines_are_too_few() -> None:
    found = identifiable_bands(FREQUENCY[:4], zener()[:4], 0.01)
    assert not np.any(found.accepted)
    assert (found.refused[0].refusal, found.refused[0].value) == (Refusal.NARROW, 4)


@pytest.mark.parametrize(
    ("frequency", "stiffness", "words"),
    [
        ([1.0, 2.0], [1.0], "give \\(lines,\\) each"),
        ([0.0, 2.0], [1.0, 1.0], "have to rise, from above zero"),
        ([2.0, 1.0], [1.0, 1.0], "have to rise, from above zero"),
        ([1.0, 2.0], [1.0, np.nan], "no finite numbers"),
    ],
)
def test_what_is_no_stiffness_over_frequency_is_refused(
    frequency: list[float], stiffness: list[float], words: str
) -> None:
    with pytest.raises(AnalysisError, match=words):
        identifiable_bands(np.array(frequency), np.array(stiffness, dtype=complex), 0.1)
