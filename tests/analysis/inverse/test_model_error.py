"""Causes that a model lacks: their sizes by their scores alone, and what a fit says of them."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Real
from analysis.inverse.frequency_dependent_joints import accelerance_on
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.model_error import Cause, likely_sizes
from analysis.inverse.tolerances import EXACT, Deviations, Tolerances
from analysis.inverse.validity_checks import Correlation, StrongestCause, ValidityCheck
from tests.analysis.inverse.laboratory import (
    CONSTANT,
    FREQUENCY,
    NOISE,
    SENSOR,
    STATED,
    Laboratory,
    dominant,
    power_laws,
)

ALIKE = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 4.0]])


def test_noise_speaks_of_no_cause_or_of_small_ones() -> None:
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(ALIKE)
    sizes = np.array([likely_sizes(root @ rng.standard_normal(3), ALIKE, ALIKE) for _ in range(400)])
    standard_error = 1 / np.sqrt(np.diag(ALIKE))
    assert np.all(np.mean(sizes == 0.0, axis=0) > 0.6)
    assert np.all(np.mean(sizes**2, axis=0) < 0.25 * standard_error**2)


def test_a_cause_gets_its_size_and_one_that_looks_like_it_gets_none() -> None:
    sizes = likely_sizes(ALIKE @ np.array([10.0, 0.0, 0.0]), ALIKE, ALIKE)
    np.testing.assert_allclose(sizes, [np.sqrt(99.0), 0.0, 0.0], rtol=1e-6)


def test_scores_that_scatter_more_than_their_information_speak_of_less() -> None:
    score = np.array([0.0, 0.0, 12.0])
    sure, unsure = (likely_sizes(score, ALIKE, scatter * ALIKE)[2] for scatter in (1.0, 9.0))
    assert sure == pytest.approx(np.sqrt(3.0**2 - 1 / 4), rel=1e-3)
    assert 0.0 < unsure < np.sqrt(3.0**2 - 9 / 4)  # as it may be noise altogether


@pytest.mark.parametrize("cause", [0.0, 1.0, 2.0, 4.0, 8.0])
def test_intervals_that_allow_for_the_size_hold_whatever_the_cause(cause: float) -> None:
    """A term that one unit of the cause moves by 0.4 standard errors; the cause is known to one unit."""
    rng, moves = np.random.default_rng(2), 0.4
    error = rng.standard_normal(2000) + moves * cause
    one: Real = np.eye(1)
    sizes = np.array([likely_sizes(np.array([cause + each]), one, one)[0] for each in rng.standard_normal(error.size)])
    assert (
        np.mean(np.abs(error) < 1.96 * np.hypot(1.0, moves * sizes)) > 0.92
    )  # 94 % at worst, known to half a per cent


def cause_of(check: ValidityCheck) -> Cause:
    assert isinstance(check.finding, StrongestCause)
    assert check.finding.cause is not None
    return check.finding.cause


UNMODELLED: dict[str, tuple[dict[int, float], Real]] = {  # masses (kg by node), and laws of the joints
    "mass at joint": ({2: 0.02, 10: 0.02}, CONSTANT),
    "mass of the accelerometer": ({3: 0.02}, CONSTANT),
    "power of frequency": ({}, power_laws(0.02, 0.02)),
}


@pytest.mark.parametrize("cause", UNMODELLED)
@pytest.mark.parametrize("tolerances", [EXACT, STATED], ids=["exact bench", "stated tolerances"])
def test_an_unmodelled_cause_is_named_by_a_check(laboratory: Laboratory, cause: str, tolerances: Tolerances) -> None:
    masses, laws = UNMODELLED[cause]
    measured = laboratory.measured(20, laboratory.accelerance(laboratory.finer(point_masses=masses), laws))
    fit = identify_from_responses(laboratory.model, measured, laboratory.joints, tolerances=tolerances)
    check = next(check for check in fit.checks if check.name == "no missing cause")
    assert not check.passed
    assert cause in cause_of(check).name


@pytest.mark.parametrize(
    ("name", "share_at_1_khz"), [("sensitivity that rises with frequency", 0.01), ("delay of a channel", -0.006j)]
)
def test_a_response_of_the_chain_over_frequency_is_named_and_no_law_of_the_joints(
    laboratory: Laboratory, name: str, share_at_1_khz: complex
) -> None:
    power = 2 if np.isreal(share_at_1_khz) else 1
    measured = laboratory.measured(20, laboratory.exact * (1 + share_at_1_khz * (FREQUENCY / 1e3) ** power))
    fit = identify_from_responses(laboratory.model, measured, laboratory.joints, tolerances=STATED)
    check = next(check for check in fit.checks if check.name == "no missing cause")
    assert not check.passed
    assert name in cause_of(check).name


def test_a_wrong_modulus_that_passes_the_check_of_tolerances_widens_intervals_so_that_they_hold(
    laboratory: Laboratory,
) -> None:
    """Gain and density take their share of it, so that none of the three is far off."""
    measured = laboratory.measured(25, laboratory.accelerance(laboratory.finer(modulus=1.02)))
    fit = identify_from_responses(laboratory.model, measured, laboratory.joints, tolerances=STATED)
    checks = {check.name: check for check in fit.checks}
    assert checks["tolerances"].passed
    cause = cause_of(checks["no missing cause"])
    assert (cause.name, cause.unit) == ("wrong statement of the Young's modulus", "tolerances")
    assert cause.value == pytest.approx(4, abs=0.5)
    found = dominant(laboratory, fit)
    assert np.all(np.abs(found[:, 0]) < 1.96 * found[:, 1])


def test_a_small_cause_widens_intervals_so_that_they_hold(laboratory: Laboratory) -> None:
    measured = laboratory.measured(26, laboratory.accelerance(laboratory.finer(point_masses={10: 0.01})))
    fit = identify_from_responses(laboratory.model, measured, laboratory.joints, tolerances=STATED)
    assert fit.passed
    check = next(check for check in fit.checks if check.name == "no missing cause")
    cause = cause_of(check)
    assert cause.name == "mass at joint II"
    assert 0.009 < cause.value < 0.02
    found = dominant(laboratory, fit)
    assert np.all(np.abs(found[:, 0]) < 1.96 * found[:, 1])


def test_without_stated_noise_a_mass_that_the_model_lacks_fails_the_checks(laboratory: Laboratory) -> None:
    measured = laboratory.measured(21, laboratory.accelerance(laboratory.finer(point_masses={6: 0.2})))
    fit = identify_from_responses(laboratory.model, replace(measured, variance=None), laboratory.joints)
    failed = {check.name for check in fit.all_checks if not check.passed}
    assert {"fit", "independent residual", "no missing cause"} <= failed


@pytest.mark.parametrize("spacing", [0.5, 2.0])
def test_noise_under_an_exponential_window_is_no_sign_of_a_wrong_model(laboratory: Laboratory, spacing: float) -> None:
    """The window makes neighbouring lines of noise alike, the more the shorter it is beside the record."""
    decay, lines = 4.0, np.arange(20.0, 1000.0, spacing)
    bench = Deviations.none(2, len(laboratory.inputs))
    clean = accelerance_on(laboratory.model, laboratory.joints, bench, lines, SENSOR, laboratory.inputs, decay)
    samples = round(2048 / spacing)
    time = np.arange(samples) / 2048
    white = np.random.default_rng(5).standard_normal((len(laboratory.inputs), samples))
    windowed = np.fft.rfft(white * np.exp(-decay * time))[:, np.round(lines / spacing).astype(int)]
    noise = NOISE * windowed / np.sqrt(np.mean(np.abs(windowed) ** 2) / 2)
    measured = replace(
        clean, accelerance=clean.accelerance + noise, variance=np.full(clean.accelerance.shape, NOISE**2)
    )
    fit = identify_from_responses(laboratory.model, measured, laboratory.joints)
    check = next(check for check in fit.checks if check.name == "independent residual")
    assert check.passed
    assert isinstance(check.finding, Correlation)
    assert abs(check.finding.deviations) < 2.5
