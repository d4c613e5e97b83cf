"""What a prior does to an estimate: against the closed form in one dimension, and against a fit without it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses, Real
from analysis.interval import Z95
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.joint_fit import degrees_of_freedom, prior_effect
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.joint_parameters import held_terms
from analysis.inverse.response_jacobian import deviation_columns
from analysis.inverse.response_model import ResponseModel
from analysis.inverse.tolerances import EXACT, FREEHAND_LEAN, Deviations, Tolerances, law_places
from analysis.modal.response_variance import smoothed_variance
from analysis.structure.forward import accelerance

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

NOISE = 0.003


def test_data_and_prior_share_a_term_by_their_information() -> None:
    data, prior, off = 3.0, 1.0, 2.0
    one = np.ones((1, 1))
    independent_covariance = one / (data + prior)
    found = prior_effect(one, independent_covariance, independent_covariance, prior * one, np.array([off]))
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
    expected = prior_effect(
        np.eye(24), pulled.independent_covariance, pulled.covariance, weight, free.values - held.mean
    ).bias
    moved = pulled.values - free.values
    deviation = np.sqrt(np.diag(pulled.covariance))
    assert np.max(np.abs(moved) / deviation) > 1
    np.testing.assert_allclose(moved / deviation, expected / deviation, atol=0.1)
    assert np.all(np.diag(pulled.independent_covariance) <= np.diag(free.independent_covariance))


SENSOR = Dof.parse("3y")
LINES = np.arange(20.0, 1025.0, 2.0)
BLOWS = 10
LEVEL = 0.003  # of the average, (m/s^2)/N
OBSERVABLE = [1, 3, 7, 9, 13, 15, 19, 21]  # k12, k22, h12, h22 of both joints


def measured(bench: Bench, seed: int, place: float, lean: float = 0.0) -> FrequencyResponses:
    """Averages of ten blows with noise, each normal numbers times `place` off its mark, m, and `lean` aslant, rad."""
    rng = np.random.default_rng(seed)
    model = ResponseModel(bench.free_beam, (2, 10), SENSOR, bench.inputs, LINES)
    on_joints = model.condensed(Deviations.none(2, len(bench.inputs)))
    response = on_joints.evaluate_on(np.array([joint.dynamic_stiffness for joint in bench.joints]))
    rows, first = len(bench.inputs), law_places(2).stop
    of_rows = deviation_columns(response, np.arange(first + 2 * rows) >= first)
    slopes = np.sum(of_rows.reshape(2, rows, rows, -1), axis=1)  # (m/s^2)/N a metre and a radian; each row moves alone
    off = np.array([place, lean])[:, None, None] * rng.standard_normal((2, rows, BLOWS))
    noise = rng.standard_normal((2, len(bench.inputs), BLOWS, LINES.size)) * LEVEL * np.sqrt(BLOWS)
    beside = np.einsum("drb,drl->rbl", off, slopes)
    single = response.accelerance[:, None] + beside + noise[0] + 1j * noise[1]
    mean = np.mean(single, axis=1)
    scatter = (single - mean[:, None]) / BLOWS * np.sqrt(BLOWS / (BLOWS - 1))
    variance = smoothed_variance(np.sum(np.abs(scatter) ** 2, axis=1) / 2)
    return FrequencyResponses(LINES, mean, SENSOR, bench.inputs, variance=variance, scatter=scatter)


def error(bench: Bench, responses: FrequencyResponses, tolerances: Tolerances = EXACT) -> Real:
    """(8,) errors of the observable terms over their standard deviations."""
    fit = identify_from_responses(bench.free_beam, responses, bench.joints, tolerances=tolerances)
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
    fit = identify_from_responses(bench.free_beam, measured(bench, 1, 1e-3), bench.joints)
    ratio = (np.diag(fit.covariance) / np.diag(fit.independent_covariance)).reshape(2, -1)[:, 1:6]
    assert np.sqrt(np.median(ratio)) > 2  # of all stiffnesses but k11, of which only the sum is observable


def test_blows_that_lean_are_found_out_and_joints_known_the_better_for_it(bench: Bench) -> None:
    by_hand = Tolerances(blow_lean=FREEHAND_LEAN)
    leaning = [measured(bench, seed, 0.0, np.radians(1.0)) for seed in range(15)]
    found = [error(bench, each, by_hand) for each in leaning]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(1.06, abs=0.25)
    upright, aslant = (
        identify_from_responses(bench.free_beam, leaning[0], bench.joints, tolerances=tolerances).joints["I"]
        for tolerances in (EXACT, by_hand)
    )
    k11, k12 = 0, 1
    for term, gain in ((k11, 2.0), (k12, 1.2)):
        assert upright.covariance[term, term] > gain**2 * aslant.covariance[term, term]


def test_a_term_has_the_degrees_of_freedom_of_the_blows_that_it_hangs_on() -> None:
    scatter = np.ones((2, 10, 3), complex)
    scatter[1, 4:] = 0.0  # a point with four blows
    of_rows = np.array([np.diag([1.0, 0.0]), np.diag([0.0, 1.0])])
    terms = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    found = degrees_of_freedom(terms, of_rows, np.sum(of_rows, axis=0), scatter)
    np.testing.assert_allclose(found, [9, 3, 2**2 / (1 / 9 + 1 / 3)])
    with_tolerances = degrees_of_freedom(terms, of_rows, np.sum(of_rows, axis=0) + 9 * np.eye(2), scatter)
    np.testing.assert_allclose(with_tolerances[:2], [100 * 9, 100 * 3])
    assert np.all(np.isinf(degrees_of_freedom(terms, 0 * of_rows, np.eye(2), scatter)))


def test_joints_have_wider_intervals_the_fewer_blows_they_hang_on(bench: Bench) -> None:
    responses = measured(bench, 1, 1e-3)
    fit = identify_from_responses(bench.free_beam, responses, bench.joints)
    for joint in fit.joints.values():
        half = np.diff(joint.k_ci95[1, 1])[0] / 2
        assert 9 < joint.degrees_of_freedom[3] < 110
        assert half / np.sqrt(joint.covariance[3, 3]) > 1.96
    lines = identify_from_responses(bench.free_beam, replace(responses, scatter=None), bench.joints)
    assert np.all(np.isinf(lines.joints["I"].degrees_of_freedom))


@pytest.mark.parametrize("peak_over_noise", [1e6, 1e8])
def test_a_common_scale_that_no_response_tells_keeps_the_width_of_its_prior(
    bench: Bench, peak_over_noise: float
) -> None:
    """Joints, E, density and gain times one number give the same accelerances."""
    frequency = np.arange(20.0, 1025.0, 8.0)
    exact = accelerance(bench.free_beam, bench.joints, frequency, Dof.parse("3y"), bench.inputs).accelerance
    variance = np.full(exact.shape, (np.max(np.abs(exact)) / peak_over_noise) ** 2)
    measured = FrequencyResponses(frequency, exact, Dof.parse("3y"), bench.inputs, variance=variance)
    stated = replace(EXACT, sensor_gain=0.005, youngs_modulus=0.005, density=0.003)
    fit = identify_from_responses(bench.free_beam, measured, bench.joints, tolerances=stated)
    scale = (2 / 0.005**2 + 1 / 0.003**2) ** -0.5
    for joint in fit.joints.values():
        half = np.ptp(joint.k_ci95, axis=-1)[1, 1] / 2
        assert half / joint.stiffness[1, 1] == pytest.approx(1.96 * scale, rel=0.05)


def test_laws_leans_and_sums_have_students_intervals_where_blows_tell_their_errors(bench: Bench) -> None:
    tolerances = Tolerances(blow_lean=FREEHAND_LEAN, joint_law=FrequencyLaw.POWER)
    responses = measured(bench, 1, 1e-3)
    fit = identify_from_responses(bench.free_beam, responses, bench.joints, tolerances=tolerances)
    estimates = [each for law in fit.law_parameters.values() for each in law.values()] + list(fit.leans.values())
    assert len(estimates) == 2 + len(bench.inputs)
    for each in estimates:
        assert BLOWS - 1 <= each.degrees_of_freedom < np.inf
        assert each.half_width() > 1.0001 * Z95 * each.standard_error
    # the terms, from the freedom of the parameters that they are
    joints = list(fit.joints.values())
    own = np.concatenate([joint.degrees_of_freedom for joint in joints])
    np.testing.assert_allclose(fit.degrees_of_freedom[: own.size], own)
    k11, h11 = 0, 6
    _, _, freedom = fit.sum_of(0, 0)
    assert freedom == min(joint.degrees_of_freedom[[k11, h11]].min() for joint in joints)
    alone = identify_from_responses(
        bench.free_beam, replace(responses, scatter=None), bench.joints, tolerances=tolerances
    )
    assert np.all(np.isinf(alone.degrees_of_freedom))
    assert np.isinf(alone.sum_of(0, 0)[2])
