"""The scale of the smooth errors of measured curves, chosen with the model that makes the data most likely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.errors import AnalysisError
from analysis.gap.evidence.contest import Contest
from analysis.gap.evidence.model_evidence import log_evidence
from analysis.gap.structures.likelihood import CurveFit, PartSlopes, summed
from analysis.gap.structures.search import CurveModel
from analysis.gap.structures.smooth_error import SCALES
from analysis.inverse.levenberg_marquardt import Linearised


def likely_scale(contest: Contest[CurveModel]) -> float:
    """The scale that is most probable together with one of the models of a contest.

    A wrong model would hide its misfit behind smooth errors, so none is asked alone: an effect that all curves share
    costs less than an error of each. Where a smooth function in place of a law leaves no misfit, and is more probable
    than smooth errors alone, what laws leave is an error of the laws, which all curves share, and none of the curves.
    """
    weights = [(model, _log_weights(contest, model)) for model in (contest.none, *contest.models)]
    alone = max(weights[0][1], default=-np.inf)
    if any(_holds(model) and own and own[0] > alone for model, own in weights[1:]):
        return 0.0
    _, best = max(((weight, scale) for _, own in weights for weight, scale in zip(own, SCALES, strict=False)),
                  default=(0.0, 0.0))  # fmt: skip
    return best


def _holds(model: CurveModel) -> bool:
    """Whether it has a smooth function in place of a law, and leaves no misfit."""
    return any(each.law_free for each in model.effects) and model.misfit.certain == 0.0


def _log_weights(contest: Contest[CurveModel], model: CurveModel) -> list[float]:
    """Log probability of a model at each scale, up to a constant."""
    prior = contest.log_prior(model.ids) - contest.implausibility(model)
    return [evidence + prior for evidence in _evidence(model.fit)]


def _evidence(fit: CurveFit) -> Sequence[float]:
    """Log evidence at each scale, from the derivatives at the fit; none where there is no prediction beside it."""
    try:
        slopes = fit.likelihood.slopes(fit.scores)
    except AnalysisError:
        return ()
    return [_at(fit, slopes, scale) for scale in SCALES]


def _at(fit: CurveFit, slopes: Sequence[PartSlopes], scale: float) -> float:
    likelihood = replace(fit.likelihood, smooth_error=scale)
    there = summed([likelihood.equations(each) for each in slopes], fit.scores)
    step = np.linalg.solve(there.normal, there.descent)
    reached = Linearised(there.cost - float(there.descent @ step), np.zeros(step.size), there.normal)
    return log_evidence(CurveFit(likelihood, fit.scores + step, reached, True))
