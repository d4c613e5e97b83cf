"""Checks refuse what the uncertainty cannot explain, and nothing that it can."""

import numpy as np
import pytest

from analysis.frequency_response import Real
from analysis.inverse.joint_estimate import HALF, IdentifiedJoint, joint_from_terms
from analysis.inverse.model_error import Cause
from analysis.inverse.regression import UPPER
from analysis.inverse.validity_checks import no_missing_cause, passivity, positive_stiffness

LOSSLESS = np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 1.0], [0.0, 1.0, 0.5]]) - np.diag([0.0, 0.0, 0.5 - 2 / 3])
"""Its least eigenvalue is zero."""
ERROR = 0.05
CHECKS = {"k": positive_stiffness, "h": passivity}


def joint(stiffness: Real, damping: Real) -> IdentifiedJoint:
    terms = np.array([part[place] for part in (stiffness, damping) for place in UPPER])
    covariance = ERROR**2 * np.eye(2 * HALF)
    return joint_from_terms("I", 2, terms, covariance, [(covariance, np.full(12, 1.96))], np.full(12, ""))


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
    return Cause("mass at joint II", 0.01, "kg", gain, size, np.array([100.0, 0.0]))


def test_a_cause_that_moves_a_term_within_its_interval_widens_it_and_one_beyond_is_named() -> None:
    terms = np.array([[1.0, 0.0], [0.0, 1.0]])  # a unit of size moves the first term by 100 standard errors
    harmless = no_missing_cause([cause(400.0, 0.004)], terms)
    assert harmless.passed
    assert "intervals allow for 0.4 standard deviations" in harmless.text
    assert no_missing_cause([cause(400.0, 0.019)], terms).passed
    refused = no_missing_cause([cause(400.0, 0.02)], terms)
    assert not refused.passed
    assert "mass at joint II of 0.01 kg would lower chi-square by 400" in refused.text
    assert no_missing_cause([cause(400.0, 0.02)], terms[1:]).passed  # no term that is shown moves


def test_causes_that_move_a_term_too_far_only_together_are_refused() -> None:
    terms = np.array([[1.0, 0.0]])
    assert not no_missing_cause([cause(400.0, 0.015), cause(300.0, 0.015)], terms).passed


def test_a_cause_within_the_noise_is_no_reason_to_refuse() -> None:
    assert no_missing_cause([cause(9.0, 0.028)], np.array([[1.0, 0.0]])).passed
