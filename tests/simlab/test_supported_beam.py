from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simlab.article import draw_article
from simlab.elastomer import BLOW_AMPLITUDE, REFERENCE_TEMPERATURE
from simlab.supported_beam import Load, SupportedBeam

NOMINAL = SupportedBeam(draw_article(1, tolerances=0.0))
FREQUENCY = np.linspace(5.0, 1500.0, 60)
LINES = NOMINAL.in_plane.lines(FREQUENCY)
JOINTS = NOMINAL.joint_stiffness(BLOW_AMPLITUDE, FREQUENCY, REFERENCE_TEMPERATURE)

positions = st.floats(0.0, 0.914)
directions = st.sampled_from("xyr")


def natural_frequencies(beam: SupportedBeam, amplitude: float = BLOW_AMPLITUDE) -> np.ndarray:
    square = -(beam.poles(amplitude) ** 2)
    return np.sqrt(square.real) / (2 * np.pi)


def test_the_supported_beam_has_six_modes_near_those_measured() -> None:
    """Table 4's experiment: 77.4, 79.5, 204, 266, 469, 865 Hz; these joints lie a little further in."""
    np.testing.assert_allclose(natural_frequencies(NOMINAL), [77.4, 79.5, 204.0, 266.0, 469.0, 865.0], rtol=0.035)


def test_joints_nearer_the_ends_give_the_frequencies_computed_independently() -> None:
    """Joint positions of 0.06 L give 76.9, 79.3, 204, 262, 464, 859 Hz with an independent ten-element code."""
    article = draw_article(1, tolerances=0.0)
    length = article.bar.length
    moved = {
        name: dataclasses.replace(joint, position=share * length)
        for (name, joint), share in zip(article.joints.items(), (0.06, 0.94), strict=True)
    }
    beam = SupportedBeam(dataclasses.replace(article, joints=moved))
    np.testing.assert_allclose(natural_frequencies(beam), [76.9, 79.3, 204.0, 262.0, 464.0, 859.0], rtol=0.003)


def test_a_larger_amplitude_lowers_every_mode() -> None:
    assert np.all(natural_frequencies(NOMINAL, 4 * BLOW_AMPLITUDE) < natural_frequencies(NOMINAL))


@given(positions, positions, directions, directions)
@settings(max_examples=40, deadline=None)
def test_force_and_response_may_change_places(first: float, second: float, here: str, there: str) -> None:
    one, other = NOMINAL.free.shape(here, first), NOMINAL.free.shape(there, second)
    forth = NOMINAL.in_plane.accelerance(LINES, JOINTS, one, other)
    back = NOMINAL.in_plane.accelerance(LINES, JOINTS, other, one)
    np.testing.assert_allclose(forth, back, rtol=1e-7, atol=1e-9 * np.abs(forth).max())


@given(positions, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.1, 0.1))
@settings(max_examples=40, deadline=None)
def test_no_force_anywhere_gets_energy_out_of_the_beam(position: float, x: float, y: float, moment: float) -> None:
    shapes = np.array([NOMINAL.free.shape(direction, position) for direction in "xyr"])
    load = np.array([x, y, moment]) @ shapes
    accelerance = NOMINAL.in_plane.accelerance(LINES, JOINTS, load, load)
    mobility = accelerance / (2j * np.pi * FREQUENCY)
    assert np.all(mobility.real >= -1e-9 * np.abs(mobility).max())


def test_the_accelerance_peaks_where_the_poles_are() -> None:
    pole = NOMINAL.poles(BLOW_AMPLITUDE)[-1]
    frequency = np.linspace(0.99, 1.01, 4001) * pole.imag / (2 * np.pi)
    response = NOMINAL.accelerance(NOMINAL.lines(frequency), Load(0.0, y=1.0), BLOW_AMPLITUDE)
    assert frequency[np.argmax(np.abs(response))] == pytest.approx(pole.imag / (2 * np.pi), rel=1e-4)
    above_half = frequency[np.abs(response) > np.abs(response).max() / np.sqrt(2)]
    assert np.ptp(above_half) == pytest.approx(-2 * pole.real / (2 * np.pi), rel=0.02)


def test_far_above_its_joints_the_beam_answers_as_if_it_were_free() -> None:
    frequency = np.linspace(2400.0, 2500.0, 20)
    lines = NOMINAL.in_plane.lines(frequency)
    middle = NOMINAL.free.shape("y", 0.457)
    held = NOMINAL.joint_stiffness(BLOW_AMPLITUDE, frequency, REFERENCE_TEMPERATURE)
    supported, free = (NOMINAL.in_plane.accelerance(lines, k, middle, middle) for k in (held, 0 * held))
    np.testing.assert_allclose(np.abs(supported), np.abs(free), rtol=0.1)


def test_only_a_cross_axis_sensor_sees_a_leaning_blow_bend_the_beam_sideways() -> None:
    article = draw_article(1, tolerances=0.0)
    lines = NOMINAL.lines(FREQUENCY)
    leaning, straight = Load(0.0, x=1.0, z=0.02, s=1e-3), Load(0.0, x=1.0)
    blind = [NOMINAL.accelerance(lines, load, BLOW_AMPLITUDE) for load in (leaning, straight)]
    np.testing.assert_array_equal(blind[0], blind[1])
    seeing = SupportedBeam(article, cross_axis=0.02)
    seen = [seeing.accelerance(lines, load, BLOW_AMPLITUDE) for load in (leaning, straight)]
    assert np.abs(seen[0] - seen[1]).max() > 1e-4
    np.testing.assert_array_equal(seen[1], blind[1])


def test_a_bar_told_of_its_kinks_is_what_ever_longer_series_tend_to() -> None:
    article = draw_article(1, tolerances=0.0)
    kinks = tuple(sorted({article.sensor_position, *(joint.position for joint in article.joints.values())}))
    frequency = np.linspace(70.0, 90.0, 200)

    def peak(terms: int, kinks: tuple[float, ...] = ()) -> np.ndarray:
        bar = dataclasses.replace(article.bar, terms=terms, kinks=kinks)
        beam = SupportedBeam(dataclasses.replace(article, bar=bar))
        return beam.accelerance(beam.lines(frequency), Load(0.7, y=1.0), BLOW_AMPLITUDE)

    exact = peak(24, kinks)
    # series of 12 to 32 terms differ by rounding: 1e-7 on most processors, up to 2e-6 on others
    np.testing.assert_allclose(peak(16, kinks), exact, rtol=1e-5)
    off = [np.abs(peak(terms) / exact - 1).max() for terms in (20, 40, 80)]
    assert off[0] > 1.5 * off[1] > 1.5**2 * off[2]
    assert off[2] < 1e-3


def test_a_line_at_zero_hertz_is_refused() -> None:
    with pytest.raises(ValueError, match="above 0 Hz"):
        NOMINAL.lines(np.array([0.0, 1.0]))
