"""A single degree of freedom against formulas and against an integration in time."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.gap.parameter import Parameter
from analysis.gap.structures.chain_effects import Delay
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import Acting
from analysis.gap.structures.material_effects import (
    CubicSpring,
    FractionalZener,
    OfAmplitude,
    PowerOfAmplitude,
    SlippingSpring,
    SmoothAmplitude,
    ViscousDamping,
    WilliamsLandelFerry,
    smooth,
)
from analysis.gap.structures.single_degree import SingleDegree

STIFFNESS, MASS, LOSS = 4e4, 0.5, 0.05
VALUES = {"stiffness": STIFFNESS, "mass": MASS, "loss_factor": LOSS}
FREQUENCY = np.linspace(30.0, 60.0, 61)


def sines(observable: str, force: float = 1.0) -> Curve:
    size = FREQUENCY.size
    conditions = {"frequency": FREQUENCY, "force": np.full(size, force)}
    return Curve(observable, "a", np.ones(size, dtype=complex), np.ones(size), conditions)


def simulator() -> SingleDegree:
    return SingleDegree((Parameter("stiffness", "N/m", STIFFNESS, 0.1, positive=True),))


def test_a_linear_response_is_force_over_dynamic_stiffness() -> None:
    angular = 2 * np.pi * FREQUENCY
    expected = 1 / (STIFFNESS * (1 + 1j * LOSS) - angular**2 * MASS)
    np.testing.assert_allclose(simulator().predict(VALUES, (), sines("displacement")), expected)
    acceleration = simulator().predict(VALUES, (), sines("acceleration"))
    np.testing.assert_allclose(acceleration, -(angular**2) * expected)


@pytest.mark.parametrize("force", [1.0, 20.0])
def test_a_response_under_a_law_of_amplitude_has_the_amplitude_that_the_law_was_given(force: float) -> None:
    law, given = PowerOfAmplitude(1e-3), {"softening": 0.1, "loss": 0.05, "exponent": 0.5}
    found = simulator().predict(VALUES, (Acting(law, given),), sines("displacement", force))
    share = (np.abs(found) / 1e-3) ** 0.5
    own = STIFFNESS * (1 - 0.1 * share + 1j * (LOSS + 0.05 * share)) - (2 * np.pi * FREQUENCY) ** 2 * MASS
    np.testing.assert_allclose(found * own, force, rtol=1e-11)


@pytest.mark.parametrize("size", [12.0, 36.0])  # N; three times as strong, the cubic force is half of the linear one
def test_a_record_of_a_duffing_oscillator_is_that_of_an_integration_in_time(size: float) -> None:
    rate, count, cubic, damping = 500.0, 2000, 1e8, LOSS * np.sqrt(STIFFNESS * MASS)
    time = np.arange(count) / rate
    rising = np.minimum(1.0, time)  # a smooth start, which samples can follow
    force = size * rising * sum(np.sin(2 * np.pi * f * time + f) for f in (23.0, 37.0, 44.0, 61.0))

    def forced(t: float) -> float:
        return float(size * min(1.0, t) * sum(np.sin(2 * np.pi * f * t + f) for f in (23.0, 37.0, 44.0, 61.0)))

    def slope(t: float, state: list[float]) -> list[float]:
        x, v = state
        return [v, (forced(t) - STIFFNESS * x - damping * v - cubic * x**3) / MASS]

    exact = solve_ivp(slope, (0.0, time[-1]), [0.0, 0.0], t_eval=time, rtol=1e-8, atol=1e-12).y[0]
    curve = Curve("displacement", "a", exact, np.ones(count), {"time": time, "force": force})
    largest = float(np.sqrt(2) * np.std(exact))
    effects = (
        Acting(ViscousDamping(), {"viscous": 1.0}),
        Acting(CubicSpring(largest), {"share": cubic * largest**2 / STIFFNESS}),
    )
    found = simulator().predict(VALUES, effects, curve).real
    linear = simulator().predict(VALUES, effects[:1], curve).real
    inner = slice(count // 4, -count // 8)
    error, without = (np.std((each - exact)[inner]) / np.std(exact[inner]) for each in (found, linear))
    assert error < 0.01 < 0.05 < without


def test_a_free_decay_has_the_frequency_and_the_rate_of_its_amplitude() -> None:
    size, cubic, damping = 2e-3, 1e9, 3.0

    def slope(t: float, state: list[float]) -> list[float]:
        x, v = state
        return [v, -(STIFFNESS * x + damping * v + cubic * x**3) / MASS]

    time = np.linspace(0.0, 0.4, 8001)
    x = solve_ivp(slope, (0.0, 0.4), [size, 0.0], t_eval=time, rtol=1e-9, atol=1e-15).y[0]
    crossings = time[:-1][(x[:-1] < 0) & (x[1:] >= 0)]
    peaks = np.array([np.max(x[(time >= a) & (time < b)]) for a, b in pairwise(crossings)])
    curve = Curve("pole", "a", np.ones(peaks.size, dtype=complex), np.ones(peaks.size), {"amplitude": peaks})
    effects = (Acting(CubicSpring(size), {"share": cubic * size**2 / STIFFNESS}),)
    values = {**VALUES, "loss_factor": 0.0, "damping": damping, "gain": 0.5, "detuning": 0.1}
    found = simulator().predict(values, effects, curve)
    np.testing.assert_allclose(2 * np.pi / np.diff(crossings), found.imag, rtol=5e-3)
    assert np.ptp(found.imag) > 0.02 * found.imag[-1]
    np.testing.assert_allclose(np.log(peaks[0] / peaks[-1]) / (crossings[-2] - crossings[0]), -found.real, rtol=0.02)
    lossy = simulator().predict(VALUES, (), curve)
    np.testing.assert_allclose(lossy**2, -STIFFNESS / MASS * (1 + 1j * LOSS))


def test_a_cubic_spring_too_strong_for_the_iteration_is_an_error() -> None:
    time = np.arange(500) / 500.0
    curve = Curve("displacement", "a", np.ones(500), np.ones(500), {"time": time, "force": np.sin(250 * time)})
    with pytest.raises(AnalysisError, match="does not settle"):
        simulator().predict(VALUES, (Acting(CubicSpring(1e-4), {"share": 100.0}),), curve)


@pytest.mark.parametrize(
    "time",
    [
        np.zeros(100),
        np.zeros(1),
        -np.arange(100) / 200,
        np.concatenate([np.arange(50), np.arange(51, 101)]) / 200,  # a sample is lost
        (np.arange(100) + 1e-4 * np.arange(100) ** 2) / 200,  # a clock that becomes slower
    ],
)
def test_a_record_of_unequal_time_steps_is_refused(time: Real) -> None:
    curve = Curve("displacement", "run 3", np.ones(time.size), np.ones(time.size), {"time": time, "force": time})
    with pytest.raises(AnalysisError, match="of part 'run 3': time does not rise by equal steps; resample"):
        simulator().predict(VALUES, (), curve)


def test_rounding_of_times_is_no_unequal_step() -> None:
    force, even = np.sin(np.arange(100.0)), np.arange(100) / 200
    records = [
        Curve("displacement", "a", np.ones(100), np.ones(100), {"time": time, "force": force})
        for time in (even, 10 + even + 2e-6 * (-1) ** np.arange(100))
    ]
    found, rounded = (simulator().predict(VALUES, (), each) for each in records)
    np.testing.assert_allclose(rounded, found, atol=1e-3 * np.max(np.abs(found)))


@pytest.mark.parametrize("effect", [PowerOfAmplitude(1e-3), SlippingSpring(1e-3)])
def test_laws_of_amplitude_are_passive(effect: OfAmplitude) -> None:
    given = {each.name: each.value(1.0) for each in effect.parameters}
    conditions = {"amplitude": np.geomspace(1e-6, 1e-2, 50), "frequency": np.ones(50)}
    found = effect.properties(given, {"stiffness": STIFFNESS, "loss_factor": 0.0}, conditions)
    assert np.all(found["loss_factor"] >= 0)


def test_friction_that_sticks_is_a_spring_and_that_slips_is_a_loss() -> None:
    effect, given = SlippingSpring(1.0), {"stiffness_share": 0.2, "slip_amplitude": 0.01}
    conditions = {"amplitude": np.array([0.001, 0.02, 100.0]), "frequency": np.ones(3)}
    found = effect.properties(given, {"stiffness": 1.0, "loss_factor": 0.0}, conditions)
    np.testing.assert_allclose(found["stiffness"], [1.2, 1.1, 1.0], atol=1e-3)
    # 4 F d over the largest energy, of a Jenkins element at twice its slip amplitude: k X^2 pi loss = 4 F (X - d)
    dissipated = np.pi * found["stiffness"][1] * found["loss_factor"][1] * 0.02**2
    assert dissipated == pytest.approx(4 * 0.2 * 0.01 * (0.02 - 0.01), rel=1e-6)
    assert found["loss_factor"][0] == 0


def test_a_smooth_function_passes_its_heights_and_goes_on_straight() -> None:
    heights = np.array([0.0, 0.1, -0.2, 0.3])
    np.testing.assert_allclose(smooth(heights, np.arange(4.0)), heights)
    beyond = smooth(heights, np.array([3.0, 4.0, 5.0]))
    assert np.diff(beyond)[0] == pytest.approx(np.diff(beyond)[1])
    law = SmoothAmplitude((1e-5, 1e-4, 1e-3))
    assert len(law.parameters) == 4


def test_a_warm_specimen_is_as_stiff_as_a_cold_one_at_a_lower_frequency() -> None:
    zener = Acting(FractionalZener(), {"rise": 20.0, "corner": 3.0, "order": 0.4})
    shift = Acting(WilliamsLandelFerry(), {"c1": 10.0, "c2": 120.0})

    def stiffness(frequency: float, temperature: float) -> complex:
        conditions = {"frequency": np.array([frequency]), "temperature": np.array([temperature])}
        curve = Curve("stiffness", "a", np.ones(1, dtype=complex), np.ones(1), conditions)
        return complex(simulator().predict({"stiffness": 1e6, "loss_factor": 0.0}, (zener, shift), curve)[0])

    factor = 10 ** (-10.0 * 15.0 / (120.0 + 15.0))
    assert stiffness(50.0, 35.0) == pytest.approx(stiffness(50.0 * factor, 20.0))


def test_an_observable_that_does_not_exist_is_refused_with_those_that_do() -> None:
    with pytest.raises(AnalysisError, match=r"no observable 'temperature'; it has displacement.* pole"):
        simulator().predict(VALUES, (), sines("temperature"))


def test_a_delay_turns_complex_readings_and_leaves_real_ones_which_have_no_phase() -> None:
    frequency = np.array([10.0, 20.0])
    for values in (np.array([1.0, 2.0]), np.array([1.0 + 0j, 2.0])):
        curve = Curve("displacement", "a", values, np.ones(2), {"frequency": frequency})
        turn = np.exp(-2j * np.pi * frequency * 1e-3) if curve.is_complex else 1.0
        np.testing.assert_allclose(Delay().reading({"delay": 1e-3}, values, curve), values * turn)
