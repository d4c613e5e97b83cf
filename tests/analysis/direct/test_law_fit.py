import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from analysis.direct.constitutive import LawParameter, dynamic_stiffness
from analysis.direct.corrections import TesterEffect, correct
from analysis.direct.cylinder_terms import JointLaw, cylinder_terms, fit_cylinder_law
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.elastomer_law import ElastomerLaw
from analysis.direct.law_fit import fit_elastomer_law
from analysis.direct.point_covariance import with_shared_error
from analysis.errors import AnalysisError
from analysis.interval import Estimate
from tests.analysis.direct.points import from_polar, independent_corrections, measured_stiffness

TRUE = np.log([0.8e6, 1.3, 0.06, 0.2, 2e-5, 0.55, 0.3, 0.8, 1e-2, 0.4])
AMPLITUDES_PP, FREQUENCIES = (1e-5, 5e-5, 1e-4), (5.0, 10.0, 20.0, 35.0, 60.0, 90.0, 130.0, 200.0)


def truth(amplitude_pp: float, frequency: float, other: float = 0.0) -> complex:
    """Kraus and fractional Zener, and as much of something `other` than them."""
    law, _ = dynamic_stiffness(TRUE, np.array([amplitude_pp / 2]), np.array([frequency]), 50.0)
    bump = other * math.exp(-((math.log(amplitude_pp / 3e-5) / 0.8) ** 2))
    return complex(law[0]) * (1 + bump * (1 - 0.2j) - 0.3 * other * math.exp(-frequency / 15))


def sweep(
    rng: np.random.Generator | None,
    error: float = 1e-3,
    other: float = 0.0,
    frequencies: Sequence[float] = FREQUENCIES,
) -> list[DynamicStiffness]:
    points = []
    for amplitude_pp in AMPLITUDES_PP:
        for frequency in frequencies:
            value = truth(amplitude_pp, frequency, other)
            noise = 0j if rng is None else complex(*rng.standard_normal(2)) * error * abs(value)
            point = from_polar(frequency, amplitude_pp, abs(value), 0.0, error)
            points.append(replace(point, complex_stiffness=value + noise))
    return points


@pytest.fixture(scope="module")
def law() -> ElastomerLaw:
    return fit_elastomer_law(sweep(np.random.default_rng(0)))


def test_points_that_follow_the_law_are_predicted_between_and_beyond_them(law: ElastomerLaw) -> None:
    for amplitude_pp, frequency, within in ((2e-5, 15.0, 0.02), (7e-5, 50.0, 0.01), (1e-5, 100.0, 0.002)):
        found = law.at(amplitude_pp, frequency)
        assert found.complex_stiffness == pytest.approx(truth(amplitude_pp, frequency), rel=within)
    assert 0.5 < law.chi_square / law.degrees_of_freedom < 2


@pytest.mark.parametrize("turn", [-0.2, 1.55])
def test_points_that_no_material_has_do_not_overflow(turn: float) -> None:
    points = [
        replace(each, complex_stiffness=each.magnitude * complex(math.cos(turn), math.sin(turn)))
        for each in sweep(np.random.default_rng(3))
    ]
    assert np.all(np.isfinite(fit_elastomer_law(points).at(1e-9, 1e6).covariance))


def test_numbers_that_are_none_end_in_one_sentence() -> None:
    (first, *others) = sweep(None)
    unknown = replace(first, covariance=np.full((2, 2), math.nan))
    with pytest.raises(AnalysisError, match=r"no law goes through these 24 points \("):
        fit_elastomer_law([unknown, *others])


def test_shared_errors_far_above_a_points_own_leave_a_law() -> None:
    points = [
        with_shared_error(with_shared_error(each, "gain", 1e3 * each.complex_stiffness), "lean", 1e3j * each.stiffness)
        for each in sweep(None, error=1e-12)
    ]
    assert fit_elastomer_law(points).at(7e-5, 50.0).stiffness == pytest.approx(truth(7e-5, 50.0).real, rel=2e-3)


def test_points_that_state_no_error_have_a_law_as_well() -> None:
    found = fit_elastomer_law(sweep(None, error=0.0)).at(7e-5, 50.0)
    assert found.complex_stiffness == pytest.approx(truth(7e-5, 50.0), rel=2e-3)


def test_many_points_that_are_known_closely_have_a_law() -> None:
    """As a linear specimen they have a large discrepancy in common, beside which their errors were lost in rounding."""
    close = np.arange(5.0, 201.0, 5.0).tolist()
    found = fit_elastomer_law(sweep(np.random.default_rng(0), error=1e-6, frequencies=close)).at(7e-5, 50.0)
    assert found.complex_stiffness == pytest.approx(truth(7e-5, 50.0), rel=2e-3)


def test_parameters_lie_within_their_errors(law: ElastomerLaw) -> None:
    for parameter in LawParameter:
        off = law.logarithms[parameter] - TRUE[parameter]
        assert abs(off) < 3 * math.sqrt(law.covariance[parameter, parameter]), parameter


def held(point: DynamicStiffness, true: complex) -> list[bool]:
    """Whether the 95 % intervals of k and of the loss factor hold."""
    estimates = (point.stiffness_estimate, true.real), (point.loss_factor_estimate, true.imag / true.real)
    return [low <= value <= high for estimate, value in estimates for low, high in [estimate.interval()]]


@pytest.mark.parametrize("other", [0.0, 0.05])
def test_intervals_hold_between_the_measured_amplitudes_even_of_another_law(other: float) -> None:
    rng = np.random.default_rng(7)
    asked = [(amplitude_pp, frequency) for amplitude_pp in (7e-6, 2e-5, 3e-5, 7e-5) for frequency in (8.0, 50.0, 170.0)]
    inside = list[bool]()
    for _ in range(5):
        found = fit_elastomer_law(sweep(rng, other=other))
        for amplitude_pp, frequency in asked:
            inside += held(found.at(amplitude_pp, frequency), truth(amplitude_pp, frequency, other))
    assert np.mean(inside) > 0.9


def test_a_specimen_of_another_law_is_said_to_be_one() -> None:
    found = fit_elastomer_law(sweep(np.random.default_rng(1), other=0.1))
    own = fit_elastomer_law(sweep(np.random.default_rng(1)))
    assert found.chi_square > 10 * found.degrees_of_freedom
    error, honest = (each.at(3e-5, 50.0).stiffness_estimate.standard_error for each in (found, own))
    assert error > 1.5 * honest


def test_the_interval_opens_away_from_what_was_measured(law: ElastomerLaw) -> None:
    errors = [law.at(amplitude_pp, 50.0).stiffness_estimate for amplitude_pp in (1e-5, 7e-6, 4e-6, 1e-6)]
    relative = [estimate.standard_error / estimate.value for estimate in errors]
    assert relative == sorted(relative)
    assert relative[-1] > 5 * relative[0]


def constant(amplitudes_pp: tuple[float, ...], softening: float = 0.0) -> ElastomerLaw:
    """The law of a specimen whose stiffness hardly changes: by `softening` for each e-fold of amplitude."""
    rng, value = np.random.default_rng(2), 2.7e6 * (1 + 0.1j)
    points = []
    for amplitude_pp in amplitudes_pp:
        for frequency in FREQUENCIES:
            own = value * (1 - softening * math.log(amplitude_pp / 1e-5))
            noise = complex(*rng.standard_normal(2)) * 1e-3 * abs(value)
            points.append(
                replace(from_polar(frequency, amplitude_pp, abs(own), 0.0, 1e-3), complex_stiffness=own + noise)
            )
    return fit_elastomer_law(points)


def test_a_specimen_that_no_amplitude_changes_is_known_below_the_smallest_one() -> None:
    found = constant(AMPLITUDES_PP).at(4e-6, 60.0)
    assert found.stiffness_estimate.standard_error < 2e-3 * found.stiffness
    assert found.loss_factor_estimate.standard_error < 2e-2 * found.loss_factor
    assert abs(found.stiffness - 2.7e6) < 3 * found.stiffness_estimate.standard_error
    assert abs(found.loss_factor - 0.1) < 3 * found.loss_factor_estimate.standard_error


def wavy(frequency: float, wave: float, phases: Sequence[float]) -> complex:
    """A constant stiffness that a `wave` over the logarithm of frequency leaves, in its size and in its angle."""
    in_size, in_angle = (math.sin(2 * math.log(frequency) + phase) for phase in phases)
    return complex(2.7e6 * (1 + 0.1j) * np.exp(wave * (in_size + 1j * in_angle)))


@pytest.mark.parametrize("wave", [0.0, 5e-4, 4e-3])
def test_intervals_of_a_linear_specimen_hold_whether_it_follows_its_law_exactly_nearly_or_roughly(wave: float) -> None:
    rng, inside, relative = np.random.default_rng(5), list[bool](), list[float]()
    for _ in range(6):
        phases, points = rng.uniform(0, 2 * np.pi, 2).tolist(), []
        for amplitude_pp in AMPLITUDES_PP:
            for frequency in np.geomspace(5, 200, 14).tolist():
                true = wavy(frequency, wave, phases)
                value = true + 1e-3 * abs(true) * complex(*rng.standard_normal(2))
                plain = from_polar(frequency, amplitude_pp, abs(value), 0.0, 1e-3)
                points.append(replace(plain, complex_stiffness=value))
        found = fit_elastomer_law(points)
        for frequency in (12.0, 33.0, 60.0, 110.0, 170.0):
            true, point = wavy(frequency, wave, phases), found.at(1e-5, frequency)
            relative.append(point.stiffness_estimate.standard_error / true.real)
            inside += held(point, true)
    assert np.mean(inside) >= 0.9
    assert np.mean(relative) < 3.3e-4 + 0.1 * wave  # points are known to 1e-3, and 42 of them tell a mean to 1.5e-4


@pytest.mark.parametrize(
    ("amplitudes_pp", "softening"), [((1e-5,), 0.0), ((1e-5, 1.05e-5), 0.0), (AMPLITUDES_PP, 0.02)]
)
def test_amplitudes_that_do_not_show_a_linear_specimen_leave_the_interval_wide(
    amplitudes_pp: tuple[float, ...], softening: float
) -> None:
    found = constant(amplitudes_pp, softening).at(4e-6, 60.0)
    assert found.stiffness_estimate.standard_error > 5e-3 * found.stiffness


def test_a_question_outside_of_the_measured_range_is_called_so(law: ElastomerLaw) -> None:
    assert law.beyond(1e-5, 200.0) == ()
    assert law.beyond(2e-5, 7.0) == ()
    assert law.beyond(4e-6, 469.0) == (
        "0.004 mm is below the measured 0.01 mm",
        "469 Hz is above the measured 200 Hz",
    )


def test_the_unit_of_force_changes_nothing_but_the_unit() -> None:
    points = sweep(np.random.default_rng(3))
    scaled = [
        replace(point, complex_stiffness=1e3 * point.complex_stiffness, covariance=1e6 * point.covariance)
        for point in points
    ]
    plain, other = (fit_elastomer_law(each).at(2e-5, 30.0) for each in (points, scaled))
    assert other.complex_stiffness == pytest.approx(1e3 * plain.complex_stiffness, rel=1e-3)
    np.testing.assert_allclose(np.sqrt(np.diag(other.covariance)), 1e3 * np.sqrt(np.diag(plain.covariance)), rtol=0.05)


def test_what_points_share_is_shared_by_predictions() -> None:
    frame = independent_corrections({TesterEffect.FRAME_COMPLIANCE: Estimate(2e-8, 5e-9)})
    seen = [
        replace(point, complex_stiffness=measured_stiffness(point.complex_stiffness, point.frequency, frame.values))
        for point in sweep(None)
    ]
    found = fit_elastomer_law(correct(seen, frame))
    point = found.at(1e-5, 60.0)
    (shared,) = point.shared_errors.values()
    assert shared.real == pytest.approx((truth(1e-5, 60.0) ** 2).real * 5e-9, rel=0.05)
    assert point.stiffness_estimate.standard_error >= abs(shared.real)
    assert [record.effect for record in point.corrections] == ["frame_compliance"]


def test_a_joints_law_has_the_terms_of_its_cylinders() -> None:
    compression = sweep(None)
    pair = [replace(point, complex_stiffness=0.4 * point.complex_stiffness) for point in compression]
    angled = [replace(point, complex_stiffness=1.2 * point.complex_stiffness) for point in compression]
    joint = JointLaw(fit_cylinder_law(cylinder_terms(compression, pair, angled)), -math.pi / 4)
    terms, b = joint.at(1e-5, 60.0), truth(1e-5, 60.0)
    assert terms.k11.complex_stiffness == pytest.approx(1.2 * b, rel=5e-3)
    assert terms.k12.complex_stiffness == pytest.approx(0.8 * b, rel=5e-3)
    assert joint.frequencies == (5.0, 200.0)
    assert joint.beyond(1e-5, 60.0) == ()


def test_too_few_points_are_refused() -> None:
    with pytest.raises(AnalysisError, match="5 points do not determine a law"):
        fit_elastomer_law(sweep(None)[:5])


def test_what_is_no_spring_is_refused() -> None:
    points = sweep(None)
    with pytest.raises(AnalysisError, match="needs it positive"):
        fit_elastomer_law([replace(points[0], complex_stiffness=-1e6 + 0j), *points])


@pytest.mark.parametrize(("amplitude_pp", "frequency"), [(0.0, 50.0), (1e-5, -1.0), (math.nan, 50.0)])
def test_asking_at_no_amplitude_or_frequency_is_refused(
    law: ElastomerLaw, amplitude_pp: float, frequency: float
) -> None:
    with pytest.raises(AnalysisError, match="has to be positive"):
        law.at(amplitude_pp, frequency)


def relaxing(rng: np.random.Generator, frequency: float) -> complex:
    """Thirty relaxations over six decades and a constant loss: no fractional Zener model."""
    times = np.logspace(-5, 1, 30)
    strengths = 0.03 * np.interp(np.linspace(0, 4, 30), np.arange(5), rng.uniform(0, 1, 5))
    phase = 2j * math.pi * frequency * times
    return complex(1e6 * (1 + np.sum(strengths * phase / (1 + phase))) * (1 + 0.03j))


def test_what_no_measured_frequency_shows_lies_within_the_interval_beyond_them() -> None:
    frequencies, error, held = (5.0, 10.0, 20.0, 35.0, 60.0, 90.0, 130.0, 200.0), 5e-4, []
    for seed in range(12):
        points = []
        for number, frequency in enumerate(frequencies):
            value = relaxing(np.random.default_rng(seed), frequency)
            noise = error * complex(*np.random.default_rng([seed, number]).standard_normal(2))
            points.append(
                replace(from_polar(frequency, 5e-5, abs(value), 0.0, error), complex_stiffness=value * (1 + noise))
            )
        law = fit_elastomer_law(points)
        for asked in (400.0, 900.0):
            found, true = law.at(5e-5, asked), relaxing(np.random.default_rng(seed), asked)
            low, high = found.loss_factor_estimate.interval()
            held.append(low <= true.imag / true.real <= high)
            low, high = found.stiffness_estimate.interval()
            held.append(low <= true.real <= high)
    assert np.mean(held) >= 0.9


def test_inside_of_the_measured_frequencies_nothing_is_added(law: ElastomerLaw) -> None:
    inside, edge = (np.diag(law._unseen(0.1, frequency)) for frequency in (50.0, 200.0))
    assert not np.any(inside)
    assert not np.any(edge)
    assert np.diag(law._unseen(0.1, 200.0 * math.e))[1] == pytest.approx(0.005**2)
