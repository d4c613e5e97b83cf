"""Checks refuse what the uncertainty cannot explain, and nothing that it can."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from analysis.inverse.frequency_dependent_joints import accelerance_on, joints_at
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.joint_estimate import HALF, IdentifiedJoint, joint_from_terms
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.model_error import Cause
from analysis.inverse.regression import UPPER
from analysis.inverse.tolerances import Tolerances
from analysis.inverse.undetermined_terms import reasons_array
from analysis.inverse.validity_checks import (
    MISFIT,
    ChiSquare,
    LeastLoss,
    LeastStiffness,
    StrongestCause,
    WorstDeviation,
    convergence,
    coupling_as_drawn,
    no_missing_cause,
    passivity,
    positive_stiffness,
)
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint, least_loss
from tests.analysis.inverse.laboratory import FREQUENCY, SENSOR, Laboratory, following

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

LOSSLESS = np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 1.0], [0.0, 1.0, 0.5]]) - np.diag([0.0, 0.0, 0.5 - 2 / 3])
"""Its least eigenvalue is zero."""
ERROR = 0.05
CHECKS = {"k": positive_stiffness, "h": passivity}


def joint(stiffness: Real, damping: Real) -> IdentifiedJoint:
    terms = np.array([part[place] for part in (stiffness, damping) for place in UPPER])
    covariance = ERROR**2 * np.eye(2 * HALF)
    return joint_from_terms("I", 2, terms, covariance, [(covariance, np.full(12, 1.96))], reasons_array([None] * 12))


@pytest.mark.parametrize("part", CHECKS)
def test_noise_alone_refuses_no_joint_at_the_edge_of_what_an_elastomer_can_be(part: str) -> None:
    """Of all motions the least favourable one is chosen: the 95 % interval of one motion refuses 43 of these."""
    assert np.min(np.linalg.eigvalsh(LOSSLESS)) == pytest.approx(0.0, abs=1e-12)
    rng, refused = np.random.default_rng(3), 0
    for _ in range(2000):
        noise = rng.standard_normal((3, 3))
        found = LOSSLESS + ERROR * (np.triu(noise) + np.triu(noise, 1).T)
        refused += not CHECKS[part](joint(found, 2 * np.eye(3) if part == "k" else found), np.inf).passed
    assert refused <= 2


@pytest.mark.parametrize("part", CHECKS)
def test_a_motion_that_is_given_energy_beyond_its_uncertainty_is_refused(part: str) -> None:
    wrong = LOSSLESS - 10 * ERROR * np.eye(3)
    own = joint(wrong, np.eye(3)) if part == "k" else joint(2 * np.eye(3), wrong)
    assert not CHECKS[part](own, np.inf).passed
    assert CHECKS[part](own, 3.0).passed  # four blows say too little


def cause(gain: float, size: float) -> Cause:
    return Cause("mass at joint II", 0.01, "kg", gain, size, np.array([100.0, 0.0]), ())


def test_a_cause_that_moves_a_term_within_its_interval_widens_it_and_one_beyond_is_named() -> None:
    terms = np.array([[1.0, 0.0], [0.0, 1.0]])  # a unit of size moves the first term by 100 standard errors
    harmless = no_missing_cause([cause(400.0, 0.004)], terms)
    assert harmless.passed
    assert isinstance(harmless.finding, StrongestCause)
    assert harmless.finding.together == pytest.approx(0.4)
    assert no_missing_cause([cause(400.0, 0.019)], terms).passed
    refused = no_missing_cause([cause(400.0, 0.02)], terms)
    assert not refused.passed
    assert isinstance(refused.finding, StrongestCause)
    assert refused.finding.shows
    assert refused.finding.moves == pytest.approx(2.0)
    assert refused.finding.cause is not None
    assert refused.finding.cause.gain == 400.0
    assert no_missing_cause([cause(400.0, 0.02)], terms[1:]).passed  # no term that is shown moves


def test_causes_that_move_a_term_too_far_only_together_are_refused() -> None:
    terms = np.array([[1.0, 0.0]])
    assert not no_missing_cause([cause(400.0, 0.015), cause(300.0, 0.015)], terms).passed


def test_a_cause_within_the_noise_is_no_reason_to_refuse() -> None:
    assert no_missing_cause([cause(9.0, 0.028)], np.array([[1.0, 0.0]])).passed


def test_what_the_model_cannot_explain_fails_the_gate_and_is_located(laboratory: Laboratory) -> None:
    measured = laboratory.measured(7)
    wrong = measured.accelerance.copy()
    wrong[3] *= -1  # polarity of one row
    fit = identify_from_responses(laboratory.model, replace(measured, accelerance=wrong), laboratory.joints)
    (check,) = [check for check in fit.checks if check.name == "fit"]
    assert not check.passed
    assert not fit.passed
    assert isinstance(check.finding, ChiSquare)
    assert check.finding.row == laboratory.inputs[3]
    assert fit.noise_scale > MISFIT


def test_a_joint_that_gives_energy_fails_its_gate(laboratory: Laboratory, bench: Bench) -> None:
    active = bench.joints[0].dynamic_stiffness.copy()
    active[1, 1] -= 0.2j * active[1, 1].real
    joints = (replace(bench.joints[0], dynamic_stiffness=active), bench.joints[1])
    exact = accelerance(laboratory.model, joints, FREQUENCY, SENSOR, bench.inputs).accelerance
    fit = identify_from_responses(laboratory.model, laboratory.measured(8, exact), joints)
    first, second = (fit.joints[name] for name in ("I", "II"))
    assert [check.passed for check in first.checks] == [True, False]
    assert isinstance(first.checks[1].finding, LeastLoss)
    assert first.checks[1].finding.value < 0
    assert all(check.passed for check in second.checks)


def test_a_joint_that_gives_energy_only_at_an_end_of_the_band_fails_its_check_there(laboratory: Laboratory) -> None:
    """The relaxation has most of its loss about 100 Hz, so that what is stated there as loss is gain far above."""
    laws = np.array([[0.0, 0.0], [0.8, 0.0], [-0.7, 0.0], [1.0, 0.0]])
    first, second = laboratory.joints
    weakly_damped: Complex = first.dynamic_stiffness.real * np.complex128(1 + 0.06j)
    joints = (replace(first, dynamic_stiffness=weakly_damped), second)
    at_ends = [joints_at(frequency, joints, laws)[0].dynamic_stiffness for frequency in (20.0, 100.0, 1024.0)]
    assert [least_loss(z)[0] > 0 for z in at_ends] == [True, True, False]
    bench = following(laws, len(laboratory.inputs))
    exact = accelerance_on(laboratory.finer(), joints, bench, FREQUENCY, SENSOR, laboratory.inputs).accelerance
    fit = identify_from_responses(
        laboratory.model,
        laboratory.measured(8, exact),
        joints,
        tolerances=Tolerances(joint_law=FrequencyLaw.ZENER),
    )
    assert all(check.passed for check in (*fit.checks, *fit.joints["I"].checks[:2], *fit.joints["II"].checks))
    (failed,) = (check for check in fit.all_checks if not check.passed)
    assert failed.name == "passivity of joint I at 1024 Hz"
    assert isinstance(failed.finding, LeastLoss)
    assert failed.finding.value < 0
    assert not fit.passed


def test_constant_joints_are_checked_once(fits: list[JointFit]) -> None:
    names = [check.name for check in fits[0].all_checks]
    assert len(names) == len(set(names)) == len(fits[0].checks) + 4


def test_a_bench_further_from_its_drawing_than_stated_fails_its_check(laboratory: Laboratory) -> None:
    narrow = Tolerances(density=0.0005, youngs_modulus=0.0005)
    exact = laboratory.accelerance(laboratory.finer(density=1.01))
    fit = identify_from_responses(
        laboratory.model, laboratory.measured(23, exact), laboratory.joints, tolerances=narrow
    )
    check = next(check for check in fit.checks if check.name == "tolerances")
    assert not check.passed
    assert isinstance(check.finding, WorstDeviation)
    assert check.finding.label in ("density", "Young's modulus")
    assert check.finding.tolerances > check.finding.limit


def test_a_joint_that_pushes_a_motion_on_fails_its_check(laboratory: Laboratory) -> None:
    pushing = laboratory.joints[0].dynamic_stiffness.copy()
    pushing[2, 2] = -(0.4 + 0.04j) * abs(pushing[2, 2])
    joints = (replace(laboratory.joints[0], dynamic_stiffness=pushing), laboratory.joints[1])
    exact = accelerance(laboratory.model, joints, FREQUENCY, SENSOR, laboratory.inputs).accelerance
    fit = identify_from_responses(laboratory.model, laboratory.measured(24, exact), joints)
    first, second = (fit.joints[name] for name in ("I", "II"))
    assert not first.checks[0].passed
    assert isinstance(first.checks[0].finding, LeastStiffness)
    assert first.checks[0].finding.value < 0
    assert second.checks[0].passed


@pytest.mark.parametrize(
    ("converged", "expected", "passed"),
    [
        (True, 1e-5, True),
        (False, 0.03, True),
        (False, 0.05, False),
        (False, -0.01, False),
        (False, float("nan"), False),
    ],
)
def test_a_search_that_ends_within_a_fifth_of_a_standard_error_passes(
    converged: bool, expected: float, passed: bool
) -> None:
    assert convergence(converged, expected).passed is passed


@pytest.mark.parametrize(
    ("found", "drawn", "passed"),
    [((1, 1), (1, 1), True), ((1, -1), (1, 1), True), ((-1, -1), (1, 1), False), ((-1, -1), (0, 0.01), True)],
)
def test_only_joints_that_all_couple_against_their_drawing_fail(
    found: tuple[float, float], drawn: tuple[float, float], passed: bool
) -> None:
    def coupled(sign: float) -> Real:
        return np.array([[2.0, sign, 0.0], [sign, 2.0, 0.0], [0.0, 0.0, 1.0]])

    check = coupling_as_drawn(
        [joint(coupled(sign), 0.1 * coupled(sign)) for sign in found],
        [Joint("I", 2, coupled(sign).astype(complex)) for sign in drawn],
    )
    assert check.passed is passed
