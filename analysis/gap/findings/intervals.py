"""90 % intervals of what a fitted model says: of parameters, and of functions of them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.fitted import AnyEffect, AnyModel
from analysis.gap.evidence.model_evidence import overdispersed
from analysis.gap.parameter import Parameter, ParameterEstimate
from analysis.interval import Z90

STEP = 1e-4
"""Step of the differences that linearise a function, in standard deviations of the prior."""


@dataclass(frozen=True, eq=False)
class Band:
    """A function with its 90 % band.

    Attributes:
        value: (n,).
        low, high: (n,) ends of the band.
    """

    value: Real
    low: Real
    high: Real


def estimates(model: AnyModel, calibration: Calibration) -> tuple[dict[str, ParameterEstimate], ...]:
    """Parameters of each effect with their 90 % intervals, which the model's own misfit widens.

    No bench follows a law exactly: a size is uncertain by at least a share of itself.
    """
    deviations, found = deviations_of(model, calibration), []
    for number, effect in enumerate(model.effects):
        share = form_share(effect, calibration)
        own = dict[str, ParameterEstimate]()
        for place, parameter in zip(model.places(number), effect.parameters, strict=True):
            score = float(model.fit.scores[place])
            form = share * parameter.relative(score)
            own[parameter.name] = estimate(parameter, score, float(np.hypot(deviations[place], form)))
        found.append(own)
    return tuple(found)


def deviations_of(model: AnyModel, calibration: Calibration) -> Real:
    """(unknowns,) standard deviations of a model's scores, which its own misfit widens."""
    return overdispersed(model.fit, own_overdispersion(model, calibration)).deviations


def own_overdispersion(model: AnyModel, calibration: Calibration) -> float:
    """Overdispersion for the intervals of a model, whose misfit shows how inexact it is."""
    return max(1.0, model.fit.per_datum, model.misfit.certain / calibration.patterns)


def estimate(parameter: Parameter, score: float, deviation: float) -> ParameterEstimate:
    """A parameter with its interval, from its score and the standard deviation of that."""
    reach = Z90 * deviation
    interval = parameter.value(score - reach), parameter.value(score + reach)
    return ParameterEstimate(parameter.value(score), interval, parameter.unit)


def form_share(effect: AnyEffect, calibration: Calibration) -> float:
    """Share of itself by which the size of an effect is uncertain at least, one standard deviation."""
    return calibration.least_form_error if effect.form_is_known else calibration.parameter_error


def linearised(function: Callable[[Real], Real], scores: Real, covariance: Real) -> tuple[Real, Real]:
    """A function (n,) of some scores (m,), and the standard deviation (n,) that their covariance (m, m) gives it."""
    value = function(scores)
    slopes = np.array([(function(scores + step) - value) / STEP for step in STEP * np.eye(len(scores))])
    return value, np.sqrt(np.einsum("pn,pq,qn->n", slopes, covariance, slopes))
