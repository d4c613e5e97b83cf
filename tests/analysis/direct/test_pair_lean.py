import math
from dataclasses import replace

import numpy as np
import pytest

from analysis.direct.cylinder_terms import cylinder_terms, joint_terms, match_configurations
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.pair_lean import PairLean, Triple, lean_of
from analysis.direct.point_covariance import shared_covariance
from tests.analysis.direct.points import point

A, B = 0.36e6 * (1 + 0.10j), 2.30e6 * (1 + 0.12j)
TOLERANCE = math.radians(0.5)
Levels = list[tuple[Triple, ...]]


def measured(
    delta: float,
    rng: np.random.Generator,
    error: float = 2e-3,
    count: int = 10,
    off: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> Levels:
    """Triples of three amplitudes, the larger the softer; `off`: by how much superposition fails at each."""
    found = []
    more = math.sin(2 * delta)
    for amplitude_pp, softness, excess in zip((1e-5, 5e-5, 1e-4), (1.0, 0.7, 0.5), off, strict=True):
        series: list[list[DynamicStiffness]] = [[], [], []]
        for frequency in np.linspace(10.0, 200.0, count).tolist():
            for own, value in zip(series, (B, 2 * A, ((1 - more) * A + (1 + more) * B) * (1 + excess)), strict=True):
                noise = 1 + error * complex(*rng.standard_normal(2))
                own.append(point(softness * value * noise, error, frequency, amplitude_pp))
        found.append(match_configurations(*series))
    return found


def test_the_lean_is_found_within_its_error() -> None:
    rng = np.random.default_rng(3)
    off = []
    for _ in range(60):
        delta = TOLERANCE * rng.standard_normal()
        found = lean_of(measured(delta, rng), TOLERANCE)
        assert found.standard_error < TOLERANCE / 10
        off.append((found.angle - delta) / found.standard_error)
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.35)  # 60 draws know it to 9 %


def test_without_a_tolerance_the_frame_stands_as_drawn() -> None:
    assert lean_of(measured(0.01, np.random.default_rng(0)), 0.0) == PairLean()


def test_points_that_do_not_tell_the_lean_leave_its_tolerance() -> None:
    found = lean_of(measured(0.0, np.random.default_rng(0), error=0.5, count=2), TOLERANCE)
    assert found.standard_error > 0.95 * TOLERANCE
    assert abs(found.angle) < 0.3 * TOLERANCE


def test_cylinders_as_stiff_across_as_along_tell_nothing_of_the_lean() -> None:
    """Their pair has the same stiffness in every direction, whatever its frame."""
    equal = [(Triple(point(B), point(2 * B), point(2 * B)),), (Triple(point(B), point(2 * B), point(2.02 * B)),)]
    assert lean_of(equal, TOLERANCE, "lean of joint I") == PairLean(0.0, TOLERANCE, "lean of joint I")


def test_a_level_of_such_cylinders_leaves_the_lean_and_its_scatter_to_the_others() -> None:
    levels = measured(0.0, np.random.default_rng(1), off=(0.02, 0.0, -0.02))
    found = lean_of([*levels, (Triple(point(B), point(2 * B), point(2 * B)),)], TOLERANCE)
    alone = lean_of(levels, TOLERANCE)
    assert found.angle == pytest.approx(alone.angle, rel=1e-12)
    assert found.standard_error == pytest.approx(alone.standard_error, rel=1e-12)


def test_superposition_that_fails_by_amplitude_widens_the_error_of_the_lean() -> None:
    fair, failing = (
        lean_of(measured(0.0, np.random.default_rng(1), off=off), TOLERANCE) for off in ((0.0,) * 3, (0.02, 0.0, -0.02))
    )
    assert failing.standard_error > 3 * fair.standard_error


def with_gain(point: DynamicStiffness, gain: float) -> DynamicStiffness:
    errors = {"gain": gain * point.complex_stiffness}
    return replace(point, covariance=point.covariance + shared_covariance(errors), shared_errors=errors)


def test_gains_of_configurations_do_not_average_out_of_the_lean() -> None:
    levels = measured(0.0, np.random.default_rng(1))
    gained = [tuple(replace(triple, angled=with_gain(triple.angled, 0.01)) for triple in triples) for triples in levels]
    own, found = lean_of(levels, 1.0), lean_of(gained, 1.0)
    by_gain = 0.01 * abs(A + B) / abs(B - A) / 2
    assert found.standard_error == pytest.approx(math.hypot(own.standard_error, by_gain), rel=0.02)


def test_k22_is_what_the_angled_pair_reads_and_does_not_widen_by_the_lean() -> None:
    delta = math.radians(0.8)
    (triples, *_) = measured(delta, np.random.default_rng(0), error=1e-5, count=3)
    lean = lean_of([triples], TOLERANCE, "lean of joint I")
    series = (
        [each.compression for each in triples],
        [each.shear for each in triples],
        [each.angled for each in triples],
    )
    terms = cylinder_terms(*series, lean=lean)[1]
    joint = joint_terms(terms, -math.pi / 4, lean)
    assert terms.compression.complex_stiffness == pytest.approx(B, rel=1e-4)
    assert terms.misfit < 10
    assert joint.k22.complex_stiffness == pytest.approx(series[2][1].complex_stiffness, rel=1e-4)
    assert joint.k11.complex_stiffness == pytest.approx(2 * (A + B) - series[2][1].complex_stiffness, rel=1e-4)
    assert joint.k12.complex_stiffness == pytest.approx((B - A) * math.cos(2 * delta), rel=1e-4)
    assert joint.k22.stiffness_estimate.standard_error < 1e-3 * joint.k22.stiffness
    assert set(joint.k12.shared_errors) == {"lean of joint I"}


@pytest.mark.parametrize("upper", [None, math.pi / 4, -math.pi / 6])
@pytest.mark.parametrize("inclination", [-math.pi / 4, math.pi / 4, 3 * math.pi / 4])
def test_the_error_of_the_lean_reaches_every_term_of_the_joint(inclination: float, upper: float | None) -> None:
    (terms,) = cylinder_terms(*([point(value, 1e-6, 50.0, 1e-5)] for value in (B, 2 * A, A + B)))
    step = 1e-4
    lean = PairLean(0.02, step)
    found = joint_terms(terms, inclination, lean, upper)
    moved = [joint_terms(terms, inclination, PairLean(0.02 + half * step), upper) for half in (-0.5, 0.5)]
    for name in ("k11", "k22", "k12"):
        before, after = (getattr(each, name).complex_stiffness for each in moved)
        assert getattr(found, name).shared_errors["lean"] == pytest.approx(after - before, rel=1e-5, abs=1e-6)
