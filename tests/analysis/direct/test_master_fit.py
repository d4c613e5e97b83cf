"""Master curves of elastomers that do not follow the fitted law: intervals hold, stiffness and loss stay causal."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.direct.master_curve import FARTHEST, MasterCurve, MasterPoint
from analysis.direct.master_fit import fit_master_curve, temperature_groups
from analysis.direct.point_covariance import with_shared_error
from analysis.direct.shift_law import ShiftLaw
from analysis.errors import AnalysisError
from tests.analysis.direct.materials import REFERENCE, Material

TEMPERATURES = (-10.0, 5.0, 23.0, 40.0)
ASKED = ((1000.0, 23.0), (400.0, 23.0), (1000.0, 40.0), (100.0, 15.0), (1000.0, 5.0), (50.0, 30.0), (3000.0, -10.0))
"""Frequencies and temperatures: covered by reduced frequency, between two temperatures, and far outside."""


def drawn(seed: int) -> tuple[Material, MasterCurve]:
    random = np.random.default_rng(seed)
    material = Material.drawn(random)
    return material, fit_master_curve(*material.sweeps(TEMPERATURES, random))


@pytest.fixture(scope="module")
def one() -> tuple[Material, MasterCurve]:
    return drawn(1)


def test_intervals_hold_for_materials_that_do_not_follow_the_law() -> None:
    held, widths = [], []
    for seed in range(8):
        material, curve = drawn(seed)
        for asked in ASKED:
            true, found = material.stiffness(*asked), curve.at(*asked)
            held += [
                found.stiffness.low < true.real < found.stiffness.high,
                found.loss_factor.low < true.imag / true.real < found.loss_factor.high,
            ]
        widths.append(curve.at(1000, REFERENCE).stiffness.high / curve.at(1000, REFERENCE).stiffness.value - 1)
    assert np.mean(held) >= 0.92
    assert np.median(widths) < 0.02  # 1 kHz at 23 degrees Celsius, from 5 to 200 Hz: to better than 2 %


def test_intervals_grow_outside_of_what_was_measured(one: tuple[Material, MasterCurve]) -> None:
    curve = one[1]
    low, high = curve.covered
    inside, near, far = (curve.at(at, REFERENCE) for at in (high / 30, 10 * high, 100 * high))
    assert inside.beyond == ()
    assert near.beyond
    assert _relative(inside) < _relative(near) < _relative(far)
    assert _relative(curve.at(low / 100, REFERENCE)) > _relative(curve.at(low / 10, REFERENCE)) > _relative(inside)
    with pytest.raises(AnalysisError, match="3 decades outside"):
        curve.at(2 * high * 10**FARTHEST, REFERENCE)


def test_intervals_grow_between_and_beyond_temperatures(one: tuple[Material, MasterCurve]) -> None:
    curve = one[1]
    at, between, warmest, beyond = (curve.at(100.0, temperature) for temperature in (23.0, 31.5, 40.0, 55.0))
    assert _relative(at) < _relative(between)
    assert _relative(warmest) < _relative(beyond)
    assert "above the measured 40" in beyond.beyond[0]


def test_stiffness_and_loss_are_those_of_one_causal_law(one: tuple[Material, MasterCurve]) -> None:
    curve = one[1]
    low, high = curve.covered
    grid = np.geomspace(low / 500, high * 500, 4000)
    magnitude = np.array([curve.at(each, REFERENCE).logarithm.real for each in grid])
    for place in (1500, 2000, 2500):
        centre = grid[place]
        found = curve.at(centre, REFERENCE).logarithm
        # phase of a minimum-phase function by Kramers-Kronig (H. W. Bode): the principal value over ln of frequency
        u = np.log(grid / centre)
        integrand = np.zeros(grid.size)
        away = np.abs(u) > 1e-12
        integrand[away] = (magnitude[away] - found.real) / np.sinh(u[away])
        integrand[~away] = np.gradient(magnitude, u)[~away]
        assert np.trapezoid(integrand, u) / np.pi == pytest.approx(found.imag, abs=0.003)


def test_shared_errors_are_carried_on() -> None:
    random = np.random.default_rng(3)
    points, temperatures = Material.drawn(random).sweeps(TEMPERATURES, random)
    without = fit_master_curve(points, temperatures).at(1000, REFERENCE)
    gain = [with_shared_error(each, "gain", 0.03 * each.complex_stiffness) for each in points]
    found = fit_master_curve(gain, temperatures).at(1000, REFERENCE)
    added = found.covariance[0, 0] - without.covariance[0, 0]
    assert np.sqrt(added) == pytest.approx(0.03, rel=0.05)


def test_a_lag_of_the_tester_is_found_and_not_predicted() -> None:
    random = np.random.default_rng(8)
    material = Material.drawn(random)
    points, temperatures = material.sweeps(TEMPERATURES, random)
    late = [
        replace(each, complex_stiffness=each.complex_stiffness * np.exp(2j * np.pi * each.frequency * 60e-6))
        for each in points
    ]
    curve = fit_master_curve(late, temperatures)
    assert curve.lag.low < 60e-6 < curve.lag.high
    assert curve.lag.low > 0
    true, found = material.stiffness(1000, REFERENCE), curve.at(1000, REFERENCE)
    assert found.loss_factor.low < true.imag / true.real < found.loss_factor.high


def test_one_temperature_is_refused_with_what_to_do() -> None:
    random = np.random.default_rng(4)
    points, temperatures = Material.drawn(random).sweeps([23.0], random)
    for law, constants in ((ShiftLaw.ARRHENIUS, None), (ShiftLaw.WLF, (9.0, 100.0))):
        with pytest.raises(AnalysisError, match=r"there are: 23.0 degrees.*again 10 to 20 K colder"):
            fit_master_curve(points, temperatures, law, constants=constants)


def test_two_temperatures_take_arrhenius_or_known_constants_alone() -> None:
    random = np.random.default_rng(5)
    material = Material.drawn(random)
    points, temperatures = material.sweeps([8.0, 23.0], random)
    with pytest.raises(AnalysisError, match="Take Arrhenius, give C1 and C2"):
        fit_master_curve(points, temperatures)
    by_arrhenius = fit_master_curve(points, temperatures, ShiftLaw.ARRHENIUS)
    assert 50 < by_arrhenius.shift_values["E"].value < 400
    given = fit_master_curve(points, temperatures, constants=(9.0, 100.0))
    assert given.shift_values == {}
    assert given.shift_factor(8.0) == pytest.approx(10 ** (9.0 * 15 / 85))
    true = material.stiffness(1000, 23.0)
    for curve in (by_arrhenius, given):
        found = curve.at(1000, 23.0)
        assert found.stiffness.low < true.real < found.stiffness.high


def test_what_does_not_belong_together_is_refused() -> None:
    random = np.random.default_rng(6)
    points, temperatures = Material.drawn(random).sweeps(TEMPERATURES, random)
    with pytest.raises(AnalysisError, match="47 temperatures"):
        fit_master_curve(points, temperatures[1:])
    with pytest.raises(AnalysisError, match=r"give one above -273.15 a point"):
        fit_master_curve(points, [*temperatures[1:], np.inf])
    with pytest.raises(AnalysisError, match="the reference temperature is -300"):
        fit_master_curve(points, temperatures, ShiftLaw.ARRHENIUS, -300.0)
    with pytest.raises(AnalysisError, match="asked at -1 Hz"):
        drawn(1)[1].at(-1, REFERENCE)


def test_a_temperature_that_wanders_is_one_sweep() -> None:
    assert temperature_groups(np.array([23.0, 5.1, 24.5, 4.0, 23.8])) == pytest.approx([4.55, (23 + 24.5 + 23.8) / 3])


def _relative(found: MasterPoint) -> float:
    return found.magnitude.high / found.magnitude.value - 1
