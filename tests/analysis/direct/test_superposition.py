import cmath

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.point_covariance import with_shared_error
from analysis.direct.superposition import Equivalence, SuperpositionPoint, superposition
from analysis.errors import AnalysisError
from tests.analysis.direct.points import point

A, B = 0.36e6 * (1 + 0.10j), 2.30e6 * (1 + 0.12j)


def at_one_point(excess: float, error: float = 0.005, margin: float = 0.05) -> Equivalence:
    result = superposition([point(B, error)], [point(2 * A, error)], [point(excess * (A + B), error)], margin)
    return result.points[0].verdict


@pytest.mark.parametrize(
    ("excess", "error", "verdict"),
    [
        (1.0, 0.005, Equivalence.EQUIVALENT),
        (1.02, 0.005, Equivalence.EQUIVALENT),
        (0.90, 0.005, Equivalence.DIFFERENT),
        (1.10, 0.005, Equivalence.DIFFERENT),
        (1.05, 0.005, Equivalence.INCONCLUSIVE),
        (1.0, 0.05, Equivalence.INCONCLUSIVE),
        (1.0, 0.0, Equivalence.EQUIVALENT),
    ],
)
def test_verdict_weighs_difference_error_and_margin(excess: float, error: float, verdict: Equivalence) -> None:
    assert at_one_point(excess, error) is verdict


def test_a_noisy_measurement_never_shows_equivalence() -> None:
    """What an ordinary test of difference gets wrong: more noise must not make agreement easier to claim."""
    assert at_one_point(1.0, error=0.2) is Equivalence.INCONCLUSIVE


@given(
    excess=st.floats(0.8, 1.2),
    scale=st.floats(1e-6, 1e6),
    error=st.floats(1e-4, 0.1),
)
def test_the_unit_of_force_changes_nothing(excess: float, scale: float, error: float) -> None:
    plain, scaled = (
        superposition(
            [point(unit * B, error)], [point(unit * 2 * A, error)], [point(unit * excess * (A + B), error)]
        ).points[0]
        for unit in (1.0, scale)
    )
    assert scaled.difference.value == pytest.approx(plain.difference.value, abs=1e-12)
    assert scaled.difference.standard_error == pytest.approx(plain.difference.standard_error)
    assert scaled.p_value == pytest.approx(plain.p_value, abs=1e-9)


@given(excess=st.floats(0.5, 2.0), turn=st.floats(-0.3, 0.3))
def test_difference_and_loss_angle_are_those_put_in(excess: float, turn: float) -> None:
    result = superposition(
        [point(B, 0.01)], [point(2 * A, 0.01)], [point(excess * cmath.exp(1j * turn) * (A + B), 0.01)]
    )
    (found,) = result.points
    assert found.difference.value == pytest.approx(excess - 1, abs=1e-9)


def check_of(one: DynamicStiffness, pair: DynamicStiffness, both: DynamicStiffness) -> SuperpositionPoint:
    (found,) = superposition([one], [pair], [both]).points
    return found


def shared(source: str, relative: complex, *points: DynamicStiffness) -> list[DynamicStiffness]:
    """The points with one error that they share, relative to each."""
    return [with_shared_error(each, source, relative * each.complex_stiffness) for each in points]


def test_a_gain_that_all_configurations_share_is_no_error_of_their_difference() -> None:
    points = point(B, 0.002), point(2 * A, 0.002), point(A + B, 0.002)
    alone, calibrated = check_of(*points), check_of(*shared("calibration of force", 0.05, *points))
    assert calibrated.difference.standard_error == pytest.approx(alone.difference.standard_error, rel=1e-9)
    assert alone.verdict is calibrated.verdict is Equivalence.EQUIVALENT


def test_an_error_that_compression_and_shear_share_adds_up_in_their_sum() -> None:
    """Both are off by one displacement transducer, the angled pair was measured by another."""
    one, pair = shared("displacement", 0.02, point(B, 1e-6), point(2 * A, 1e-6))
    found = check_of(one, pair, point(A + B, 1e-6))
    assert found.difference.standard_error == pytest.approx(0.02, rel=1e-3)
    assert found.computed.magnitude_estimate.standard_error == pytest.approx(0.02 * abs(A + B), rel=1e-3)
    assert found.verdict is Equivalence.EQUIVALENT


def test_shared_errors_cover_as_often_as_stated() -> None:
    """Frame compliance lowers each configuration by its own square, which cancels in part."""
    rng = np.random.default_rng(12)
    truth, error, compliance = np.array([B, 2 * A, A + B]), 1e-3, 2e-8
    covered, runs = 0, 2000
    for _ in range(runs):
        read = truth + truth**2 * compliance * rng.standard_normal()
        read = read * (1 + error * (rng.standard_normal(3) + 1j * rng.standard_normal(3)))
        points = [with_shared_error(point(each, error), "compliance", compliance * each**2) for each in read]
        low, high = check_of(*points).difference.interval()
        covered += low <= 0 <= high
    assert covered / runs == pytest.approx(0.95, abs=0.015)


def test_at_the_edge_of_the_margin_equivalence_is_claimed_no_more_often_than_stated() -> None:
    rng = np.random.default_rng(11)
    error, runs, claimed, covered = 0.01, 3000, 0, 0
    for _ in range(runs):
        truth = np.array([B, 2 * A, 1.05 * (A + B)])
        one, pair, both = truth * (1 + error * (rng.standard_normal(3) + 1j * rng.standard_normal(3)))
        (found,) = superposition([point(one, error)], [point(pair, error)], [point(both, error)]).points
        claimed += found.verdict is Equivalence.EQUIVALENT
        low, high = found.difference.interval()
        covered += low <= 0.05 <= high
    assert claimed / runs == pytest.approx(0.05, abs=0.012)  # 3000 draws know 5 % to 0.4 %
    assert covered / runs == pytest.approx(0.95, abs=0.012)


def test_the_sentence_carries_figures_and_points_without_partner_are_left_out() -> None:
    angled = [point(1.02 * (A + B), 0.001), point(0.9 * (A + B), 0.001, 55.0), point(A + B, 0.001, 60.0)]
    compression = [point(B, 0.001), point(B, 0.001, 55.0), point(B, 0.001, 60.0)]
    shear = [point(2 * A, 0.001), point(2 * A, 0.001, 55.0)]
    result = superposition(compression, shear, angled)
    assert result.text == (
        "superposition within 5 % shown at 1 of 2 points, refuted at 1, open at 0; "
        "largest difference -10.00 % at 55 Hz, 0.01 mm"
    )
    assert [each.measured for each in result.points] == angled[:2]


def test_a_margin_has_to_be_stated_as_a_positive_number() -> None:
    with pytest.raises(AnalysisError, match="margin"):
        at_one_point(1.0, margin=0.0)
