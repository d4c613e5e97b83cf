"""The evidence of models that are not exact, with noise that is not exactly known.

Laplace's approximation, log Z = -(chi-square + z^t z) / 2 - log |I + J^t P J| / 2, with unknown scores z of unit prior
variance, is exact for a law that is exact. A real effect follows none of our laws exactly: what its law leaves is
smooth, many times noise, and of unknown size. So chi-square is divided by an overdispersion T. T is as large as the
misfit of the best model requires, but no larger than laws that are roughly right would require.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from scipy.stats import norm

from analysis.frequency_response import Real
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.fitted import Fitted
from analysis.inverse.levenberg_marquardt import Linearised, SumOfSquares, Trial

F = TypeVar("F", bound=Fitted[Any])


def divided(at: Linearised, scores: Real, overdispersion: float) -> Linearised:
    """The normal equations at `scores` (unknowns,) with chi-square divided by T; the prior is not divided."""
    unit, square = np.eye(len(scores)), float(scores @ scores)
    return Linearised(
        cost=(at.cost - square) / overdispersion + square,
        descent=np.asarray((at.descent + scores) / overdispersion - scores),
        normal=np.asarray(unit + (at.normal - unit) / overdispersion),
    )


@dataclass(frozen=True, eq=False)
class OverdispersedLikelihood:
    """The sum of squares of a likelihood and its prior, with chi-square divided by T.

    Attributes:
        likelihood: with its prior.
        start: (unknowns,) scores at which its normal equations are known.
        at_start: those.
        overdispersion: T.
    """

    likelihood: SumOfSquares
    start: Real
    at_start: Linearised
    overdispersion: float

    @property
    def data(self) -> int:
        """Number of squares."""
        return self.likelihood.data

    def at(self, values: Real) -> Trial:
        """The sum of squares at `values` (unknowns,)."""
        known = values is self.start
        trial = Trial(self.at_start.cost, lambda: self.at_start) if known else self.likelihood.at(values)
        square = float(values @ values)
        return Trial(
            (trial.cost - square) / self.overdispersion + square,
            lambda: divided(trial.linearised(), values, self.overdispersion),
        )


def overdispersed(found: F, overdispersion: float = 1.0) -> F:
    """The fit that chi-square over T would give, to second order about the fit with noise alone, which is a maximum.

    With noise alone, a law that is not quite right shifts tolerances far, so that they take up its misfit.
    That is expensive in the prior, and gains almost nothing in chi-square over T.
    """
    there = divided(replace(found.at, descent=np.zeros(len(found.scores))), found.scores, overdispersion)
    step = np.linalg.solve(there.normal, there.descent)
    cost = there.cost - float(there.descent @ step)
    return replace(found, scores=found.scores + step, at=Linearised(cost, np.zeros(len(step)), there.normal))


def log_evidence(found: Fitted[Any]) -> float:
    """Log evidence of a fitted model, up to a constant that all models of the same data share.

    It is minus infinity for a fit that ended where its derivatives overflow: far outside of what is possible.
    A parameter that cannot lie below a bound has half a Gaussian for its prior: the share of the other half in the
    evidence is subtracted, and the prior of the remaining half is doubled.
    """
    if not np.all(np.isfinite(found.at.normal)):
        return -np.inf
    _, logarithm = np.linalg.slogdet(found.at.normal)
    total = -(found.at.cost + logarithm) / 2 + found.likelihood.log_normalisation
    deviations = found.deviations
    for place, parameter in enumerate(found.likelihood.parameters):
        if np.isfinite(parameter.least):
            least = (parameter.least - parameter.centre) / parameter.spread
            total += norm.logcdf((found.scores[place] - least) / deviations[place]) - norm.logcdf(-least)
    return float(total)


def at_tolerance(found: Fitted[Any], places: Sequence[int], tolerances: Sequence[float]) -> float:
    """Change of the log evidence if some shared parameters had a prior as narrow as their tolerance.

    Args:
        found: a fit in which these parameters have their full range.
        places: indices of these parameters among the shared ones.
        tolerances: standard deviations of the narrow prior, relative to those of the full one.
    """
    covariance = found.covariance[np.ix_(places, places)]
    mean, narrow = found.scores[list(places)], np.square(np.asarray(tolerances, dtype=float))
    likelihood = np.linalg.inv(covariance) - np.eye(len(narrow))
    pull = np.linalg.solve(covariance, mean)
    wide = pull @ covariance @ pull / 2 - np.linalg.slogdet(likelihood + np.eye(len(narrow)))[1] / 2
    precision = likelihood + np.diag(1 / narrow)
    close = pull @ np.linalg.solve(precision, pull) / 2
    close -= (np.linalg.slogdet(precision)[1] + float(np.sum(np.log(narrow)))) / 2
    return float(close - wide)


def overdispersion_of(left: float, gap: float, form_is_known: bool, calibration: Calibration) -> float:
    """T of a contest: as large as the best model's misfit requires, but limited by the error that its laws may have.

    Args:
        left: misfit of the best model beyond noise, squared standard deviations.
        gap: misfit of the paper's model beyond noise, squared standard deviations.
        form_is_known: whether the form of all effects of the best model is known.
        calibration: how wrong laws may be.
    """
    least, most = calibration.form_errors(form_is_known)
    explained = max(0.0, gap - left)
    return max(1.0, float(np.clip(left, least**2 * explained, most**2 * explained)) / calibration.patterns)
