"""Intervals of joints when blows land beside their mark: as wide as repeated tests scatter."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses, Real
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.response_jacobian import deviation_columns
from analysis.inverse.response_model import ResponseModel
from analysis.inverse.tolerances import Deviations
from analysis.modal.response_variance import smoothed_variance

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

SENSOR = Dof.parse("3y")
LINES = np.arange(20.0, 1025.0, 2.0)
BLOWS = 10
NOISE = 0.003  # of the average, (m/s^2)/N
OBSERVABLE = [1, 3, 7, 9, 13, 15, 19, 21]  # k12, k22, h12, h22 of both joints


def measured(bench: Bench, seed: int, place: float) -> FrequencyResponses:
    """Averages of ten blows with noise, each blow `place` times a normal number off its mark, m."""
    rng = np.random.default_rng(seed)
    model = ResponseModel(bench.free_beam, (2, 10), SENSOR, bench.inputs, LINES)
    on_joints = model.condensed(Deviations.none(2, len(bench.inputs)))
    response = on_joints.on(np.array([joint.dynamic_stiffness for joint in bench.joints]))
    of_rows = np.arange(8 + len(bench.inputs)) >= 8
    slopes = np.sum(deviation_columns(response, of_rows), axis=0)  # (m/s^2)/N a metre; each row moves alone
    off = place * rng.standard_normal((len(bench.inputs), BLOWS, 1))
    noise = rng.standard_normal((2, len(bench.inputs), BLOWS, LINES.size)) * NOISE * np.sqrt(BLOWS)
    single = response.accelerance[:, None] + off * slopes[:, None] + noise[0] + 1j * noise[1]
    mean = np.mean(single, axis=1)
    scatter = (single - mean[:, None]) / BLOWS * np.sqrt(BLOWS / (BLOWS - 1))
    variance = smoothed_variance(np.sum(np.abs(scatter) ** 2, axis=1) / 2)
    return FrequencyResponses(LINES, mean, SENSOR, bench.inputs, variance=variance, scatter=scatter)


def error(bench: Bench, responses: FrequencyResponses) -> Real:
    """(8,) errors of the observable terms over their standard deviations."""
    fit = identify_from_responses(bench.free_beam, responses, bench.joints)
    true, found = (
        np.concatenate([np.concatenate([z.real, z.imag]) for z in upper])
        for upper in (
            [joint.dynamic_stiffness[np.triu_indices(3)] for joint in bench.joints],
            [each.joint.dynamic_stiffness[np.triu_indices(3)] for each in fit.joints.values()],
        )
    )
    return np.asarray((found - true) / np.sqrt(np.diag(fit.terms_covariance)))[OBSERVABLE]


@pytest.mark.parametrize("place", [0.0, 1e-3])
def test_standard_deviations_are_those_of_repeated_tests(bench: Bench, place: float) -> None:
    found = [error(bench, measured(bench, seed, place)) for seed in range(25)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(1.06, abs=0.2)


def test_lines_by_themselves_would_be_trusted_far_too_much(bench: Bench) -> None:
    responses = measured(bench, 1, 1e-3)
    with_blows, without = (
        identify_from_responses(bench.free_beam, each, bench.joints).joints.values()
        for each in (responses, replace(responses, scatter=None))
    )
    ratio = [
        np.diag(one.covariance)[1:6] / np.diag(two.covariance)[1:6]
        for one, two in zip(with_blows, without, strict=True)
    ]
    assert np.sqrt(np.median(ratio)) > 2  # of all stiffnesses but k11, of which only the sum is observable
