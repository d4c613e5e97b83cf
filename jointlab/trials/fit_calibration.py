"""Fit of the calibration to the marks of trials: how inexact laws are, and how often a cause is in no catalogue.

The share of a gap that the best explanation leaves tells whether it is the cause. Its logarithm enters a logistic
regression of two parameters, with a weak prior about the figures before; left-out folds say whether it is better.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from analysis.frequency_response import Real
from analysis.gap.catalogue import laws
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.verdict import share_per_effect
from analysis.gap.findings.intervals import TWO_SIDED
from jointlab.trials.marks import VISIBLE, Mark

KNOWN_FORM = frozenset(law.id for law in laws() if law.form_is_known)
FOLDS = 5
PRIOR_SPREAD = 1.0
"""Standard deviation of the prior of ln of both parameters, about the figures before."""
LEAST_SHARE = 1e-8
FEW = 2
"""Number of cases beyond a quantile, below which that figure is not changed."""


@dataclass(frozen=True)
class FittedCalibration:
    """A calibration with the evidence for it.

    Attributes:
        calibration: the new figures.
        cases: number of cases in the regression for causes in no catalogue.
        outside: number of these whose cause is in no catalogue.
        loss_before, loss_after: mean negative log likelihood of in or outside the catalogue, with the figures before
            and, on folds that a fit did not see, with new ones.
        known_forms, other_forms: numbers of cases that gave the form error of known and of other forms.
        parameters: number of parameters that gave their error.
    """

    calibration: Calibration
    cases: int
    outside: int
    loss_before: float
    loss_after: float
    known_forms: int
    other_forms: int
    parameters: int


def fit_calibration(marks: Sequence[Mark], before: Calibration, provenance: str) -> FittedCalibration:
    """New figures from the marks of trials.

    Args:
        marks: of cases that are not used to judge the result.
        before: figures to begin with; figures that these marks cannot tell are kept.
        provenance: source of the new figures.
    """
    known, other = _form_errors(marks)
    sizes = _parameter_errors(marks, before.parameter_error)
    calibration = replace(
        before,
        known_form_error=_exceeded_by(0.25, known, before.known_form_error),
        form_error=_exceeded_by(0.25, other, before.form_error),
        parameter_error=_exceeded_by(0.1, sizes, before.parameter_error),
        provenance=provenance,
    )
    counted = [each for each in marks if each.shares and each.truth.d >= VISIBLE and each.truth.kind != "none"]
    shares = np.array([_log_share(each, calibration) for each in counted])
    outside = np.array([bool(each.truth.novel) for each in counted], dtype=float)
    start = np.log([calibration.outside_share, calibration.outside_slope])
    fold = np.arange(len(counted)) % FOLDS
    unseen = [
        _loss(_fitted(shares[fold != each], outside[fold != each], start), shares[fold == each], outside[fold == each])
        for each in range(FOLDS)
        if np.any(fold == each)
    ]
    after = sum(unseen) / max(len(counted), 1)
    share, slope = np.exp(_fitted(shares, outside, start))
    return FittedCalibration(
        calibration=replace(calibration, outside_share=float(share), outside_slope=float(slope)),
        cases=len(counted),
        outside=int(outside.sum()),
        loss_before=_loss(start, shares, outside) / max(len(counted), 1),
        loss_after=float(after),
        known_forms=len(known),
        other_forms=len(other),
        parameters=len(sizes),
    )


def _form_errors(marks: Sequence[Mark]) -> tuple[list[float], list[float]]:
    """Rms shares that the true effects leave of gaps that noise does not limit, by whether all forms are known."""
    found: tuple[list[float], list[float]] = ([], [])
    for mark in marks:
        left = mark.shares.get("+".join(sorted(mark.truth.effects)))
        if mark.truth.effects and left is not None and mark.truth.d >= 20 * VISIBLE:
            found[not set(mark.truth.effects) <= KNOWN_FORM].append(float(np.sqrt(left)))
    return found


def _parameter_errors(marks: Sequence[Mark], before: float) -> list[float]:
    """Share of itself by which each parameter in a law of unknown form had to be uncertain for its 90 % interval to
    hold, where the intervals allow for a share of `before`."""
    found = list[float]()
    for each in (each for mark in marks for each in mark.coverage):
        if each.effect not in KNOWN_FORM and each.value:
            end = each.high if each.truth > each.value else each.low
            off, half = ((other - each.value) / each.value / TWO_SIDED for other in (each.truth, end))
            found.append(float(np.sqrt(max(0.0, before**2 + off**2 - half**2))))
    return found


def _exceeded_by(share: float, errors: Sequence[float], before: float) -> float:
    """The error that a share of all exceeds; the one before where there are too few for that."""
    enough = len(errors) * share >= FEW
    return float(np.clip(np.quantile(errors, 1 - share), 1e-3, 0.5)) if enough else before


def _log_share(mark: Mark, calibration: Calibration) -> float:
    """Logarithm of the share that each effect of the best explanation leaves, as the verdict computes it."""
    names, left = min(mark.shares.items(), key=lambda each: each[1] if each[0] else 2.0)
    effects = names.split("+") if names else []
    most = calibration.form_errors(bool(effects) and set(effects) <= KNOWN_FORM)[1]
    return float(np.log10(share_per_effect(left, len(effects), max(most**2, LEAST_SHARE))))


def _log_odds(logarithms: Real, shares: Real) -> Real:
    share, slope = np.exp(logarithms)
    return np.asarray(slope * (shares - np.log10(share)))


def _loss(logarithms: Real, shares: Real, outside: Real) -> float:
    sure = np.clip(expit(_log_odds(logarithms, shares)), 1e-9, 1 - 1e-9)
    return float(-np.sum(outside * np.log(sure) + (1 - outside) * np.log(1 - sure)))


def _fitted(shares: Real, outside: Real, start: Real) -> Real:
    def cost(logarithms: Real) -> float:
        return _loss(logarithms, shares, outside) + float(np.sum(((logarithms - start) / PRIOR_SPREAD) ** 2)) / 2

    return np.asarray(minimize(cost, start, method="Nelder-Mead").x)
