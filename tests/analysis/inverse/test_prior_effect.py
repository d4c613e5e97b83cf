"""What a prior does to an estimate: against the closed form in one dimension, and against a fit without it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.joint_parameters import held_terms
from analysis.inverse.prior_effect import prior_effect
from analysis.structure.forward import accelerance

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

NOISE = 0.003


def test_data_and_prior_share_a_term_by_their_information() -> None:
    data, prior, off = 3.0, 1.0, 2.0
    one = np.ones((1, 1))
    curvature = one / (data + prior)
    found = prior_effect(one, curvature, curvature, prior * one, np.array([off]))
    assert found.share == pytest.approx([prior / (data + prior)])
    assert found.bias == pytest.approx([-prior / (data + prior) * off])


def test_the_bias_stated_is_by_how_much_a_fit_moves_under_its_prior(bench: Bench) -> None:
    frequency = np.arange(20.0, 1025.0, 4.0)
    clean = accelerance(bench.free_beam, bench.joints, frequency, Dof.parse("3y"), bench.inputs).accelerance
    parts = np.random.default_rng(3).standard_normal((2, *clean.shape))
    measured = FrequencyResponses(
        frequency,
        clean + NOISE * (parts[0] + 1j * parts[1]),
        Dof.parse("3y"),
        bench.inputs,
        variance=np.full(clean.shape, NOISE**2),
    )
    mean = [replace(joint, dynamic_stiffness=1.02 * joint.dynamic_stiffness) for joint in bench.joints]
    held = held_terms(mean, 0.01)
    free = identify_from_responses(bench.free_beam, measured, bench.joints)
    pulled = identify_from_responses(bench.free_beam, measured, bench.joints, parameters=held)
    weight = np.diag(1 / held.deviation**2)
    expected = prior_effect(np.eye(24), pulled.curvature, pulled.covariance, weight, free.values - held.mean).bias
    moved = pulled.values - free.values
    deviation = np.sqrt(np.diag(pulled.covariance))
    assert np.max(np.abs(moved) / deviation) > 1
    np.testing.assert_allclose(moved / deviation, expected / deviation, atol=0.1)
    assert np.all(np.diag(pulled.covariance) <= np.diag(free.covariance))
