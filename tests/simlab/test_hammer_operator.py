import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simlab.article import NODE_POSITIONS
from simlab.hammer_operator import BlowKind, HammerOperator, Pulse, SimulatedBlow

MEMBERS = [(1, "y"), (3, "y"), (6, "y"), (11, "y"), (1, "x"), (11, "x")]


def blows(
    count: int, node: int = 6, direction: str = "y", kind: BlowKind | None = BlowKind.CLEAN
) -> list[SimulatedBlow]:
    operator = HammerOperator(seed=4)
    return [operator.strike(number, node, direction, float(number), 100.0, kind) for number in range(count)]


def test_peak_forces_scatter_by_a_tenth_about_the_level_asked_for() -> None:
    force = np.array([blow.peak_force for blow in blows(600)])
    assert force.mean() == pytest.approx(100.0, abs=1.5)
    assert force.std() == pytest.approx(10.0, rel=0.1)


def test_blows_land_within_millimetres_of_a_mark_that_is_itself_a_little_off() -> None:
    place = np.array([blow.load.position for blow in blows(600)]) - NODE_POSITIONS[5]
    assert place.std() == pytest.approx(1e-3, rel=0.1)
    assert place.mean() == pytest.approx(HammerOperator(seed=4).place_bias(6, "y")[0], abs=2e-4)
    biases = [HammerOperator(seed).place_bias(6, "y")[0] for seed in range(300)]
    assert np.std(biases) == pytest.approx(0.5e-3, rel=0.15)


def test_blows_lean_by_about_a_degree_and_keep_their_force() -> None:
    loads = [blow.load for blow in blows(600)]
    assert np.degrees(np.std([load.x for load in loads])) == pytest.approx(1.0, rel=0.1)
    assert np.degrees(np.std([load.z for load in loads])) == pytest.approx(1.0, rel=0.1)
    size = np.array([load.x**2 + load.y**2 + load.z**2 for load in loads])
    np.testing.assert_allclose(size, 1.0, rtol=1e-12)


def test_a_blow_on_an_end_face_off_its_middle_turns_the_bar_both_ways() -> None:
    loads = [blow.load for blow in blows(600, node=11, direction="x")]
    assert all(load.position == NODE_POSITIONS[10] for load in loads)
    assert np.std([load.r for load in loads]) == pytest.approx(1e-3, rel=0.1)
    assert np.std([load.s for load in loads]) == pytest.approx(1e-3, rel=0.1)


def test_pulses_are_half_to_seven_tenths_of_a_millisecond_long() -> None:
    width = np.array([blow.pulses[0].width for blow in blows(600)])
    assert width.min() > 0.5e-3
    assert width.max() < 0.7e-3
    assert width.std() > 0.02e-3


def test_a_few_in_a_hundred_ordinary_blows_bounce() -> None:
    share = np.mean([blow.kind is BlowKind.DOUBLE for blow in blows(8000, kind=None)])
    assert share == pytest.approx(0.03, abs=4 * np.sqrt(0.03 * 0.97 / 8000))


@pytest.mark.parametrize("number", range(20))
def test_a_double_hit_bounces_within_thirty_milliseconds(number: int) -> None:
    main, bounce = HammerOperator(1).strike(number, 3, "y", 5.0, 100.0, BlowKind.DOUBLE).pulses
    assert main.time == 5.0
    assert 4e-3 <= bounce.time - main.time <= 30e-3
    assert 0.05 <= bounce.peak / main.peak <= 0.4


def test_bad_blows_are_bad_in_the_way_asked_for() -> None:
    operator = HammerOperator(1)
    weak, overload, soft, late, clean = (
        operator.strike(0, 3, "y", 5.0, 100.0, kind)
        for kind in (BlowKind.WEAK, BlowKind.OVERLOAD, BlowKind.SOFT, BlowKind.LATE, BlowKind.CLEAN)
    )
    assert weak.peak_force < 30.0
    assert overload.peak_force > 2500.0
    at_1024 = [
        abs(blow.spectrum(np.array([1024.0]), 0.0)[0] / blow.spectrum(np.zeros(1), 0.0)[0]) for blow in (soft, clean)
    ]
    assert at_1024[0] < 0.05
    assert at_1024[1] > 0.5
    lean, main = late.pulses
    assert 0.04 <= main.time - lean.time <= 0.08
    assert lean.peak < 0.3 * main.peak


def test_a_hammer_in_a_guide_does_not_scatter() -> None:
    operator = HammerOperator(seed=9, scatter=0.0, double_hits=0.0)
    first, second = (operator.strike(number, 1, "x", 1.0, 100.0) for number in (0, 1))
    assert first.load == second.load
    assert first.pulses == second.pulses == (Pulse(1.0, 100.0),)


@given(st.integers(0, 10_000), st.sampled_from(MEMBERS), st.sampled_from([None, *BlowKind]))
def test_a_blow_depends_on_its_number_and_nothing_that_came_before(
    number: int, point: tuple[int, str], kind: BlowKind | None
) -> None:
    again = [HammerOperator(seed=2).strike(number, *point, 3.0, 100.0, kind) for _ in range(2)]
    assert again[0] == again[1]
    assert again[0] != HammerOperator(seed=3).strike(number, *point, 3.0, 100.0, kind)


@given(st.floats(-10.0, 10.0), st.floats(1.0, 4000.0), st.floats(1e-4, 0.05), st.floats(0.01, 0.99))
def test_a_pulse_rises_through_a_level_where_it_says(time: float, peak: float, width: float, share: float) -> None:
    pulse = Pulse(time, peak, width)
    crossing = pulse.crossing(share * peak)
    assert crossing is not None
    assert pulse.foot < crossing < time
    # the time itself is known to 1e-15 s of 10 s only
    assert float(pulse.force(crossing)) == pytest.approx(share * peak, rel=1e-8)
    assert pulse.crossing(peak) is None


def test_a_pulse_has_the_height_at_half_its_width_of_a_sine_squared() -> None:
    pulse = Pulse(0.0, 100.0, 0.6e-3)
    np.testing.assert_allclose(pulse.force(np.array([-0.15e-3, 0.0, 0.15e-3])), [50.0, 100.0, 50.0], rtol=1e-9)


def test_a_spectrum_is_the_fourier_transform_of_the_force() -> None:
    blow = HammerOperator(1).strike(0, 3, "y", 0.02, 100.0, BlowKind.DOUBLE)
    rate = 50_000.0
    times = np.arange(5000) / rate
    frequency = np.array([0.0, 10.0, 333.0, 2000.0])
    summed = (blow.force(times) * np.exp(-2j * np.pi * frequency[:, None] * times)).sum(axis=1) / rate
    np.testing.assert_allclose(blow.spectrum(frequency, 0.0), summed, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("node", "direction"), [(2, "y"), (10, "y"), (0, "y"), (12, "y"), (3, "x"), (1, "r")])
def test_a_point_no_hammer_reaches_is_refused(node: int, direction: str) -> None:
    with pytest.raises(ValueError, match=f"no hammer reaches {node}{direction}"):
        HammerOperator(1).strike(0, node, direction, 1.0, 100.0)
