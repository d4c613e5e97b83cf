import math

import numpy as np
import pytest

from analysis.direct.corrections import TesterEffect, correct
from analysis.direct.cylinder_terms import CylinderLaw, CylinderTerms, cylinder_terms, fit_cylinder_law
from analysis.direct.specimen_scatter import scatter_of_laws, specimen_scatter
from analysis.errors import AnalysisError
from analysis.interval import Estimate
from tests.analysis.direct.points import from_polar, independent_corrections, measured_stiffness

A, B = 0.36e6 * (1 + 0.10j), 2.30e6 * (1 + 0.12j)
FRAME = independent_corrections({TesterEffect.FRAME_COMPLIANCE: Estimate(2e-8, 4e-9)})


def terms(scale: float, error: float = 1e-3, frequency: float = 50.0, noise: complex = 0j) -> tuple[CylinderTerms, ...]:
    series = [
        [from_polar(frequency, 1e-5, abs(value), math.atan2(value.imag, value.real), error)]
        for value in (scale * (B + noise), scale * 2 * (A + noise), scale * (A + B + 2 * noise))
    ]
    return cylinder_terms(*series)


def test_mean_scatter_and_interval_of_three_specimens_are_students() -> None:
    (found,) = specimen_scatter({"1": terms(0.98), "2": terms(1.0), "3": terms(1.02)})
    assert found.compression.mean.value == pytest.approx(B.real, rel=1e-6)
    low, high = found.compression.mean.interval()
    assert high - low == pytest.approx(2 * 4.303 * 0.02 * B.real / math.sqrt(3), rel=1e-3)
    assert found.compression.deviation == pytest.approx(0.02 * B.real, rel=0.01)
    next_low, next_high = found.compression.next_specimen.interval()
    assert next_high - next_low == pytest.approx(2 * (high - low), rel=1e-6)
    assert found.shear_loss_factor.mean.value == pytest.approx(0.1, rel=1e-6)
    assert found.specimens == ("1", "2", "3")


def test_specimens_that_differ_by_less_than_their_errors_show_no_scatter() -> None:
    (found,) = specimen_scatter({"1": terms(1.0001, error=0.01), "2": terms(0.9999, error=0.01)})
    assert found.shear.deviation == 0.0


def test_scatter_is_found_beneath_measurement_errors() -> None:
    rng = np.random.default_rng(0)
    found = []
    for _ in range(400):
        specimens = {
            str(number): terms(
                1 + 0.03 * rng.standard_normal(), 0.01, noise=0.01 * abs(A) * complex(*rng.standard_normal(2))
            )
            for number in range(6)
        }
        found.append(specimen_scatter(specimens)[0].compression.deviation ** 2)
    # 400 draws of five degrees of freedom know a variance to 3 %
    assert math.sqrt(np.mean(found)) == pytest.approx(0.03 * B.real, rel=0.06)


def corrected(scale: float, error: float = 1e-4) -> tuple[CylinderTerms, ...]:
    """Terms of a specimen that was measured in a frame whose compliance is known to a fifth."""
    series = [
        [from_polar(50.0, 1e-5, abs(seen), math.atan2(seen.imag, seen.real), error)]
        for value in (scale * B, scale * 2 * A, scale * (A + B))
        for seen in [measured_stiffness(value, 50.0, FRAME.values)]
    ]
    return cylinder_terms(*(correct(points, FRAME) for points in series))


def test_what_the_tester_is_not_known_to_widens_the_mean_and_not_the_scatter() -> None:
    (plain,) = specimen_scatter({"1": terms(0.99), "2": terms(1.01)})
    (found,) = specimen_scatter({"1": corrected(0.99), "2": corrected(1.01)})
    assert found.compression.deviation == pytest.approx(plain.compression.deviation, rel=0.02)
    assert found.compression.mean.standard_error > 1.2 * plain.compression.mean.standard_error


def test_an_error_that_is_shared_is_not_multiplied_by_students_factor_of_two_specimens() -> None:
    one, other = corrected(1.0), corrected(1.00001)
    (found,) = specimen_scatter({"1": one, "2": other})
    (common,) = (abs(error.real) for error in one[0].compression.shared_errors.values())
    assert found.compression.next_specimen.half_width() == pytest.approx(1.96 * common, rel=0.01)


def law_of(scale: float) -> CylinderLaw:
    """Of a specimen that softens by 15 % from one amplitude to the next, measured to 0.2 %."""
    points = [
        [
            from_polar(frequency, amplitude_pp, abs(value), math.atan2(value.imag, value.real), 0.002)
            for amplitude_pp, softness in ((1e-5, 1.0), (5e-5, 0.85), (1e-4, 0.72))
            for frequency in (10.0, 60.0, 200.0)
            for value in [scale * softness * share]
        ]
        for share in (B, 2 * A, A + B)
    ]
    return fit_cylinder_law(cylinder_terms(*points))


@pytest.fixture(scope="module")
def laws() -> dict[str, CylinderLaw]:
    return {str(number): law_of(scale) for number, scale in enumerate((0.97, 1.0, 1.03), start=1)}


def test_laws_are_as_far_apart_as_their_specimens_where_nothing_was_measured(laws: dict[str, CylinderLaw]) -> None:
    found = scatter_of_laws(laws, 3e-5, 100.0)
    assert found.compression.deviation == pytest.approx(0.03 * found.compression.mean.value, rel=0.1)
    assert found.shear_damping.deviation == pytest.approx(0.03 * found.shear_damping.mean.value, rel=0.2)
    assert (found.amplitude_pp, found.frequency, found.specimens) == (3e-5, 100.0, ("1", "2", "3"))


@pytest.mark.parametrize(("amplitude_pp", "frequency"), [(5e-5, 60.0), (2e-5, 100.0), (3e-6, 500.0)])
def test_a_single_specimen_is_known_no_better_than_one_that_was_measured(
    laws: dict[str, CylinderLaw], amplitude_pp: float, frequency: float
) -> None:
    found = scatter_of_laws(laws, amplitude_pp, frequency)
    for law in laws.values():
        own = law.at(amplitude_pp, frequency)
        assert found.shear.next_specimen.half_width() > own.shear.stiffness_estimate.half_width()
        assert (
            found.compression_loss_factor.next_specimen.half_width()
            > 0.9 * own.compression.loss_factor_estimate.half_width()
        )


def test_a_single_law_shows_no_scatter(laws: dict[str, CylinderLaw]) -> None:
    with pytest.raises(AnalysisError, match="no scatter"):
        scatter_of_laws({"1": laws["1"]}, 3e-5, 100.0)


def test_frequencies_that_one_specimen_lacks_are_left_out() -> None:
    found = specimen_scatter({"1": [*terms(1.0), *terms(1.0, frequency=100.0)], "2": terms(1.01, frequency=100.0)})
    assert [each.frequency for each in found] == [100.0]


def test_one_specimen_or_nothing_in_common_is_refused() -> None:
    with pytest.raises(AnalysisError, match="no scatter"):
        specimen_scatter({"1": terms(1.0)})
    with pytest.raises(AnalysisError, match="in common"):
        specimen_scatter({"1": terms(1.0), "2": terms(1.0, frequency=100.0)})
