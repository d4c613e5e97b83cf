import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simlab.article import SimulatedArticle
from simlab.beam import Load, Real
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.case.campaign import Row
from simlab.clock import Clock
from simlab.coupling import Complex, CoupledBeam, poles
from simlab.ordinary import BenchConditions, draw_article
from simlab.stand import BOUNCE, Stand
from simlab.truth import modal_truth
from tests.simlab.specimens import built_of

ARTICLE = draw_article(1, tolerances=0.0)
FREQUENCY = np.linspace(5.0, 1500.0, 60)
END = Row(1, "x")


def beam_at(frequency: Real) -> tuple[CoupledBeam, Complex]:
    """The beam on its joints, and their stiffness under a blow of 100 N."""
    stand = Stand(built_of(ARTICLE), frequency)
    omega = np.asarray(2 * np.pi * frequency, dtype=np.complex128)
    return CoupledBeam(stand.modes, stand.supports, omega), stand.support_stiffness(0, 0.5, 100.0)


BEAM, JOINTS = beam_at(FREQUENCY)
MODES = BEAM.modes

positions = st.floats(0.0, 0.914)
directions = st.sampled_from("xyr")


def natural_frequencies(article: SimulatedArticle = ARTICLE, peak_force: float = 100.0) -> Real:
    return np.array(modal_truth(built_of(article, peak_force))["frequency_hz"])


def test_the_supported_beam_has_six_modes_near_those_measured() -> None:
    """Table 4's experiment: 77.4, 79.5, 204, 266, 469, 865 Hz; these joints lie a little further in."""
    np.testing.assert_allclose(natural_frequencies(), [77.4, 79.5, 204.0, 266.0, 469.0, 865.0], rtol=0.035)


def test_joints_nearer_the_ends_give_the_frequencies_computed_independently() -> None:
    """Joint positions of 0.06 L give 76.9, 79.3, 204, 262, 464, 859 Hz with an independent ten-element code."""
    length = ARTICLE.beam.length
    moved = {
        name: dataclasses.replace(joint, position=share * length)
        for (name, joint), share in zip(ARTICLE.joints.items(), (0.06, 0.94), strict=True)
    }
    np.testing.assert_allclose(
        natural_frequencies(dataclasses.replace(ARTICLE, joints=moved)),
        [76.9, 79.3, 204.0, 262.0, 464.0, 859.0],
        rtol=0.003,
    )


def test_a_larger_amplitude_lowers_every_mode() -> None:
    assert np.all(natural_frequencies(peak_force=400.0) < natural_frequencies())


@given(positions, positions, directions, directions)
@settings(max_examples=40)
def test_force_and_response_may_change_places(first: float, second: float, here: str, there: str) -> None:
    one, other = MODES.shape(here, first), MODES.shape(there, second)
    forth = BEAM.accelerance(one, other[None], JOINTS)
    back = BEAM.accelerance(other, one[None], JOINTS)
    np.testing.assert_allclose(forth, back, rtol=1e-7, atol=1e-9 * np.abs(forth).max())


@given(positions, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.1, 0.1))
@settings(max_examples=40)
def test_no_force_anywhere_gets_energy_out_of_the_beam(position: float, x: float, y: float, moment: float) -> None:
    shapes = np.array([MODES.shape(direction, position) for direction in "xyr"])
    load = np.array([x, y, moment]) @ shapes
    accelerance = BEAM.accelerance(load, load[None], JOINTS)[0]
    mobility = accelerance / (2j * np.pi * FREQUENCY)
    assert np.all(mobility.real >= -1e-9 * np.abs(mobility).max())


def test_the_accelerance_peaks_where_the_poles_are() -> None:
    held = poles(MODES, Stand(built_of(ARTICLE), FREQUENCY).supports, lambda at: beam_at(np.array([at]))[1][0], 1024.0)
    pole = held[-1]
    frequency = np.linspace(0.99, 1.01, 4001) * pole.imag / (2 * np.pi)
    response = Stand(built_of(ARTICLE), frequency).blow(END, 0, 100.0, Load(0.0, y=1.0))
    assert frequency[np.argmax(np.abs(response))] == pytest.approx(pole.imag / (2 * np.pi), rel=1e-4)
    above_half = frequency[np.abs(response) > np.abs(response).max() / np.sqrt(2)]
    assert np.ptp(above_half) == pytest.approx(-2 * pole.real / (2 * np.pi), rel=0.02)


def test_far_above_its_joints_the_beam_answers_as_if_it_were_free() -> None:
    beam, held = beam_at(np.linspace(2400.0, 2500.0, 20))
    middle = MODES.shape("y", 0.457)
    supported, free = (beam.accelerance(middle, middle[None], k) for k in (held, 0 * held))
    np.testing.assert_allclose(np.abs(supported), np.abs(free), rtol=0.1)


def test_only_a_cross_axis_sensor_sees_a_leaning_blow_bend_the_beam_sideways() -> None:
    leaning, straight = Load(0.0, x=1.0, z=0.02, s=1e-3), Load(0.0, x=1.0)
    blind, seeing = (
        Stand(built_of(dataclasses.replace(ARTICLE, cross_axis=cross_axis)), FREQUENCY) for cross_axis in (0.0, 0.02)
    )
    unseen = [blind.blow(END, 0, 100.0, load) for load in (leaning, straight)]
    np.testing.assert_array_equal(unseen[0], unseen[1])
    seen = [seeing.blow(END, 0, 100.0, load) for load in (leaning, straight)]
    assert np.abs(seen[0] - seen[1]).max() > 1e-4
    np.testing.assert_array_equal(seen[1], unseen[1])


def test_a_beam_with_its_kinks_is_the_limit_of_ever_longer_series() -> None:
    kinks = tuple(sorted({ARTICLE.sensor_position, *(joint.position for joint in ARTICLE.joints.values())}))
    frequency = np.linspace(70.0, 90.0, 200)

    def peak(terms: int, kinks: tuple[float, ...] = ()) -> Complex:
        beam = dataclasses.replace(ARTICLE.beam, terms=terms, kinks=kinks)
        article = dataclasses.replace(ARTICLE, beam=beam)
        stand = Stand(dataclasses.replace(built_of(ARTICLE), article=article), frequency)
        return stand.blow(Row(9, "y"), 0, 100.0, Load(0.7, y=1.0))

    exact = peak(24, kinks)
    # series of 12 to 32 terms differ by rounding: 1e-7 on most processors, up to 2e-6 on others
    np.testing.assert_allclose(peak(16, kinks), exact, rtol=1e-5)
    off = [np.abs(peak(terms) / exact - 1).max() for terms in (20, 40, 80)]
    assert off[0] > 1.5 * off[1] > 1.5**2 * off[2]
    assert off[2] < 1e-3


def test_a_line_at_zero_hertz_is_refused() -> None:
    with pytest.raises(ValueError, match="above 0 Hz"):
        Stand(built_of(ARTICLE), np.array([0.0, 1.0]))


QUIET = BenchConditions(scatter=0.0, gain_error=0.0, force_noise=1e-9, acceleration_noise=1e-9)


def test_the_hanging_beam_bounces_slowly_and_rings_as_a_free_one() -> None:
    built = built_of(draw_article(1))
    hanging = Stand(built, FREQUENCY, suspended=True)
    cords = hanging.support_stiffness(0, 0.5, 100.0)[0]
    frequency = np.abs(poles(hanging.modes, hanging.supports, lambda _: cords, 1024.0)) / (2 * np.pi)
    free = hanging.modes.frequency[3:6]
    elastic = frequency[frequency > 100]
    assert elastic[:3] == pytest.approx(free, rel=1e-3)
    assert np.all(elastic[:3] > free)
    rigid = frequency[frequency < 100]
    assert np.min(np.abs(rigid - BOUNCE)) < 0.05 * BOUNCE
    assert rigid.max() < 2.2 * BOUNCE


def rings(bench: SimulatedBench, at: float) -> float:
    """Frequency of the strongest line between 100 and 600 Hz after a blow at 8y."""
    bench.strike(8, "y", at=at, what="clean")
    signal = bench.hammer_signals(at - 0.05, 5120.0, 4 * 5120)["accelerometer"]
    spectrum = np.abs(np.fft.rfft(signal))
    frequency = np.fft.rfftfreq(signal.size, 1 / 5120.0)
    within = (frequency > 100) & (frequency < 600)
    return float(frequency[within][np.argmax(spectrum[within])])


def test_the_beam_is_hung_and_put_back() -> None:
    bench = ordinary_bench(1, Clock(), QUIET)
    supported = rings(bench, 1.0)
    bench.mount("beam", "suspended")
    assert not bench.hammer_signals(1.0, 5120.0, 5120)["hammer"].max() > 1.0  # what rang before is at rest
    hanging = rings(bench, 10.0)
    free = bench.truth()["free"]["frequency_hz"]
    assert min(abs(hanging - f) for f in free) < 1.0
    assert abs(supported - hanging) > 5.0
    bench.mount("beam", "supported")
    assert rings(bench, 20.0) == supported
    assert bench.mounted is None
