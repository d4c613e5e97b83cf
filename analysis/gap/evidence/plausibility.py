"""Sizes that effects can hardly have: beyond their plausible range, or impossible."""

from typing import Any

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.evidence.fitted import AnyModel, Fitted

CHANCE = 5.0
"""Standard deviations of a remaining misfit at which it is even odds that it is chance."""
PLAUSIBLE = 2.0
"""Standard deviations of its prior up to which a parameter is within its plausible range."""
UNEXPECTED = 2 * PLAUSIBLE
"""Standard deviations of its prior beyond which one of several parameters is outside its plausible range."""


def implausibility(model: AnyModel, scores: Real | None = None) -> float:
    """Log odds against an explanation whose effects need a size beyond their plausible range.

    The heights of a deviation from a law do not count: a large deviation shows another form of the law, not another
    effect. Exponents and other parameters of form count only if the model leaves a misfit, because they may then
    imitate another effect.

    Args:
        model: the explanation.
        scores: (unknowns,) the sizes to judge; None for those of its fit to noise alone.
    """
    judged = model.fit.scores if scores is None else scores
    beyond, leaves = 0.0, model.misfit.certain > 0.0
    for number, effect in enumerate(model.effects):
        one = effect.form_is_known or len(effect.parameters) == 1
        sizes = [effect.law_free or not (each.height or (each.form and not leaves)) for each in effect.parameters]
        largest = float(np.max(np.abs(judged[model.places(number)][sizes]), initial=0.0))
        beyond = max(beyond, largest - (PLAUSIBLE if one else UNEXPECTED))
    return beyond**2 / 2 + PLAUSIBLE * beyond


def impossibility(fit: Fitted[Any]) -> float:
    """Log odds for a cause in no catalogue, from sizes that no effect can have, such as a mass below zero.

    The evidence of an explanation holds for possible sizes alone. Where the data ask for one that is impossible, by
    more than `CHANCE`, they show something else.
    """
    deviations = fit.deviations
    below = [
        float((each.least - each.centre) / each.spread - fit.scores[place]) / float(deviations[place])
        for place, each in enumerate(fit.likelihood.parameters)
        if np.isfinite(each.least) and each.spread
    ]
    return max(0.0, max([0.0, *below]) ** 2 - CHANCE**2) / 2
