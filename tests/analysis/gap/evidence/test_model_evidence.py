"""Evidence of models, against formulas that hold exactly where a model is linear and noise Gaussian."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal, norm

from analysis.frequency_response import Real
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.model_evidence import (
    OverdispersedLikelihood,
    at_tolerance,
    divided,
    log_evidence,
    overdispersed,
    overdispersion_of,
)
from analysis.gap.fitting.fit import Fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.parameter import Parameter
from analysis.inverse.levenberg_marquardt import Linearised, Trial, minimise

DATA, UNKNOWNS = 30, 4


@dataclass(frozen=True)
class Line:
    """y = J z + unit noise, z of unit variance: the linear model that Laplace's approximation is exact for."""

    columns: Real
    measured: Real

    @classmethod
    def drawn(cls, seed: int, strength: float = 1.0) -> Line:
        random = np.random.default_rng(seed)
        columns = strength * random.standard_normal((DATA, UNKNOWNS))
        return cls(columns, columns @ random.standard_normal(UNKNOWNS) + random.standard_normal(DATA))

    def log_probability(self, prior: Real) -> float:
        """Of what was measured, for prior variances (unknowns,)."""
        covariance = np.eye(DATA) + self.columns @ np.diag(prior) @ self.columns.T
        return float(multivariate_normal(np.zeros(DATA), covariance).logpdf(self.measured))

    def fitted(self, least: float = -np.inf) -> Fit:
        """The most likely scores; the first parameter has a bound."""
        normal = np.eye(UNKNOWNS) + self.columns.T @ self.columns
        scores = np.asarray(np.linalg.solve(normal, self.columns.T @ self.measured), dtype=np.float64)
        left = self.measured - self.columns @ scores
        at = Linearised(float(left @ left + scores @ scores), np.zeros(UNKNOWNS), normal)
        shared = [Parameter(str(place), "1", 0.0, 1.0, least=least if place == 0 else -np.inf) for place in range(2)]
        likelihood = SimpleNamespace(parameters=shared, data=DATA, log_normalisation=0.0)
        return Fit(cast("Likelihood", likelihood), scores, at, True)


CONSTANT = -DATA / 2 * np.log(2 * np.pi)
"""That `log_evidence` leaves out, for unit noise."""


@given(st.integers(0, 10**6))
def test_evidence_is_the_probability_of_what_was_measured(seed: int) -> None:
    line = Line.drawn(seed)
    assert log_evidence(line.fitted()) + CONSTANT == pytest.approx(line.log_probability(np.ones(UNKNOWNS)), abs=1e-6)


@given(st.integers(0, 10**6), st.floats(1e-3, 2.0), st.floats(1e-3, 2.0))
def test_a_narrower_prior_is_the_same_as_fitting_with_it(seed: int, first: float, second: float) -> None:
    line = Line.drawn(seed)
    change = at_tolerance(line.fitted(), [0, 1], [first, second])
    narrow = line.log_probability(np.array([first**2, second**2, 1.0, 1.0]))
    assert change == pytest.approx(narrow - line.log_probability(np.ones(UNKNOWNS)), rel=1e-6, abs=1e-6)


def test_a_tolerance_as_wide_as_the_range_changes_nothing() -> None:
    assert at_tolerance(Line.drawn(1).fitted(), [0, 1], [1.0, 1.0]) == pytest.approx(0.0, abs=1e-9)


@given(st.integers(0, 10**6), st.floats(1.0, 50.0))
def test_overdispersion_is_noise_inflated_by_its_root(seed: int, overdispersion: float) -> None:
    """Wherever the fit with less noise drove its unknowns."""
    line = Line.drawn(seed)
    inflated = Line(line.columns / np.sqrt(overdispersion), line.measured / np.sqrt(overdispersion))
    expected = inflated.log_probability(np.ones(UNKNOWNS)) - CONSTANT
    assert log_evidence(overdispersed(line.fitted(), overdispersion)) == pytest.approx(expected, rel=1e-6, abs=1e-6)


@given(st.integers(0, 10**6), st.floats(1.0, 50.0))
def test_a_likelihood_divided_twice_by_reciprocals_is_the_same(seed: int, overdispersion: float) -> None:
    found = Line.drawn(seed).fitted()
    there = divided(divided(found.at, found.scores, overdispersion), found.scores, 1 / overdispersion)
    assert there.cost == pytest.approx(found.at.cost)
    assert there.descent == pytest.approx(found.at.descent, abs=1e-6)
    assert there.normal == pytest.approx(found.at.normal)


@dataclass(frozen=True)
class Growth:
    """y = exp(z) with noise of 0.01, and z of unit variance."""

    measured: float
    data: int = 1

    def at(self, values: Real) -> Trial:
        there = float(np.exp(values[0]))
        left, slope = (self.measured - there) / 0.01, np.array([there / 0.01])
        return Trial(
            left**2 + float(values @ values),
            lambda: Linearised(
                left**2 + float(values @ values), slope * left - values, np.eye(1) + np.outer(slope, slope)
            ),
        )


@given(st.floats(2.0, 30.0), st.floats(1e2, 1e5))
def test_a_curved_likelihood_is_fitted_again_with_overdispersion(measured: float, overdispersion: float) -> None:
    near = minimise(Growth(measured), np.zeros(1), 1e-8)
    target = OverdispersedLikelihood(Growth(measured), near.values, near.at, overdispersion)
    assert target.at(near.values).cost == pytest.approx(target.at(near.values.copy()).cost)
    found = minimise(target, near.values, 1e-8)
    grid = np.linspace(-1.0, 4.0, 100_001)
    costs = ((measured - np.exp(grid)) / 0.01) ** 2 / overdispersion + grid**2
    assert found.at.cost == pytest.approx(np.min(costs), abs=1e-3)
    assert found.values[0] == pytest.approx(grid[np.argmin(costs)], abs=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_half_a_prior_is_twice_the_half_above_its_bound(seed: int) -> None:
    line = Line.drawn(seed, strength=0.1)
    others = np.eye(DATA) + line.columns[:, 1:] @ line.columns[:, 1:].T
    above = np.linspace(0.0, 8.0, 2001)
    misfits = line.measured - np.outer(above, line.columns[:, 0])
    density = multivariate_normal(np.zeros(DATA), others).pdf(misfits) * 2 * norm.pdf(above)
    expected = np.log(np.trapezoid(density, above)) - CONSTANT
    assert log_evidence(line.fitted(least=0.0)) == pytest.approx(expected, abs=1e-4)
    assert abs(log_evidence(line.fitted(least=0.0)) - log_evidence(line.fitted())) > 1e-3


def test_a_bound_far_below_changes_nothing() -> None:
    line = Line.drawn(3)
    assert log_evidence(line.fitted(least=-40.0)) == pytest.approx(log_evidence(line.fitted()))


@given(st.floats(0.0, 1e8), st.floats(0.0, 1e8), st.booleans())
def test_overdispersion_is_at_least_one_and_as_laws_may_be_wrong(gap: float, left: float, known: bool) -> None:
    found = overdispersion_of(left, gap, known, UNCALIBRATED)
    least, most = UNCALIBRATED.form_errors(known)
    explained = max(0.0, gap - left) / UNCALIBRATED.patterns
    assert found >= 1.0
    assert found == 1.0 or least**2 * explained * 0.999 <= found <= most**2 * explained * 1.001


def test_a_mass_that_leaves_nothing_needs_no_overdispersion_and_no_other_law_is_exact() -> None:
    assert overdispersion_of(0.0, 1e9, True, UNCALIBRATED) == 1.0
    assert overdispersion_of(0.0, 1e9, False, UNCALIBRATED) > 1e3
    assert overdispersion_of(500.0, 1e5, False, UNCALIBRATED) == pytest.approx(500.0 / UNCALIBRATED.patterns, rel=0.9)


def test_a_fit_that_ended_where_derivatives_overflow_has_no_evidence() -> None:
    found = Line.drawn(1).fitted()
    astray = replace(found, at=replace(found.at, normal=np.full((UNKNOWNS, UNKNOWNS), np.nan)))
    assert log_evidence(astray) == -np.inf
    assert max((astray, found, astray), key=log_evidence) is found
