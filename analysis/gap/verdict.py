"""Which explanation is how probable: no effect, one, a pair, or one that the catalogue does not have.

Little is known beforehand: most gaps have one cause. Each effect is compared with itself at its tolerance, a narrow
prior, so that a trace that every bench has explains nothing. All compete with the unknown effect: a residual model that
can take any smooth shape, explains all misfit beyond noise, and pays for that freedom.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import logsumexp

from analysis.gap.catalogue import effect_ids
from analysis.gap.evidence import FORM_ERROR, KNOWN_FORM, at_tolerance, log_evidence, temperature_of
from analysis.gap.model import Model

PRIOR = {"none": 0.2, "single": 0.5, "pair": 0.2, "unknown": 0.1}
TOLERANCE = 1 / 60
"""Of an effect's range, within which every bench has a trace of it."""
MOST_OF_A_TRACE = 4.0
"""Multiple of `TOLERANCE` beyond which an effect is no trace: a Gaussian about the fit is not valid so far away."""
FAINT = 1.5**2
"""Chi-square per datum of the paper's model up to which a trace may explain the whole gap."""
FREEDOM = 12.0
"""Log evidence that the unknown effect costs: as much as about six parameters over their full ranges."""
UNKNOWN = ("unknown",)
SECOND = 0.02
"""Largest share of the misfit of the best single that a pair may leave: ten times the share that right laws leave.

A second effect that leaves more only absorbs the error of the first one's law.
"""

RANKED = 5
"""Explanations that are shown."""


class Status(StrEnum):
    """The result of a diagnosis."""

    NONE = "none"
    """Nothing beyond noise and the stated tolerances."""
    EXPLAINED = "explained"
    """The named effects explain the gap."""
    PARTIAL = "partial"
    """The named effects help, and something remains."""
    UNKNOWN = "unknown"
    """There is a gap, and nothing in the catalogue explains it."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """One explanation.

    Attributes:
        effects: ids; ("unknown",) for an effect that the catalogue does not have.
        model: its most probable law; that of the best explanation for the unknown.
        score: logarithm of its probability, up to a constant.
        probability: all sum to one.
    """

    effects: tuple[str, ...]
    model: Model
    score: float
    probability: float

    @property
    def laws(self) -> tuple[str, ...]:
        """Of each effect, in their order; of an unknown one none."""
        laws = {effect.id: effect.law for effect in self.model.effects}
        return () if self.effects == UNKNOWN else tuple(laws[effect] for effect in self.effects)


def weigh(none: Model, models: Sequence[Model]) -> tuple[Weighed, ...]:
    """Explanations by probability, the best first.

    Args:
        none: the paper's model, fitted to the same data as
        models: with one or two effects, of any number of laws.
    """
    every = (none, *models)
    best = _with_right_laws(every)
    form = KNOWN_FORM if best.effects and all(effect.form_is_known for effect in best.effects) else FORM_ERROR
    temperature = temperature_of(none.misfit.certain, best.misfit.certain, form)
    evidence = {id(each): log_evidence(each.fit, temperature) for each in every}
    laws = dict[tuple[str, ...], list[Model]]()
    for each in every:
        laws.setdefault(tuple(sorted(each.ids)), []).append(each)
    scores = {ids: _averaged([evidence[id(each)] for each in of]) for ids, of in laws.items()}
    for each in models:  # a trace of one effect belongs to the explanation without it
        for place, effect in enumerate(each.effects):
            rest = tuple(sorted(other.id for other in each.effects if other is not effect))
            trace = evidence[id(each)] + _as_trace(each, place, temperature)
            if rest in scores and (rest or none.fit.per_datum < FAINT):
                scores[rest] = max(scores[rest], trace)
    top = max(every, key=lambda each: evidence[id(each)])
    weighed = {ids: score + _prior(ids) for ids, score in scores.items()}
    left = top.misfit.certain / temperature / 2
    weighed[UNKNOWN] = evidence[id(top)] + left - FREEDOM + float(np.log(PRIOR["unknown"]))
    total = logsumexp(list(weighed.values()))
    result = [
        Weighed(
            effects=ids,
            model=top if ids == UNKNOWN else max(laws[ids], key=lambda each: evidence[id(each)]),
            score=score,
            probability=float(np.exp(score - total)),
        )
        for ids, score in weighed.items()
    ]
    return tuple(sorted(result, key=lambda each: -each.score))


def listed(weighed: Sequence[Weighed]) -> list[Weighed]:
    """The first of a ranking, with no effect and the unknown one whatever their rank."""
    return [each for rank, each in enumerate(weighed) if rank < RANKED or each.effects in ((), UNKNOWN)]


def model_of_verdict(verdict: Weighed, none: Model) -> Model:
    """The model of a verdict; for an unknown effect the paper's."""
    return none if verdict.effects == UNKNOWN else verdict.model


def _with_right_laws(every: Sequence[Model]) -> Model:
    """The best explanation; the misfit that it leaves is what laws of inexact form may leave."""
    single = min((each for each in every if len(each.effects) < 2), key=lambda each: each.misfit.certain)
    pair = min((each for each in every if len(each.effects) == 2), key=lambda each: each.misfit.certain, default=single)
    return pair if pair.misfit.certain < SECOND * single.misfit.certain else single


def _averaged(evidence: Sequence[float]) -> float:
    return float(logsumexp(evidence) - np.log(len(evidence)))


def _prior(ids: tuple[str, ...]) -> float:
    if not ids:
        return float(np.log(PRIOR["none"]))
    singles = len(effect_ids())
    if len(ids) == 1:
        return float(np.log(PRIOR["single"] / singles))
    return float(np.log(PRIOR["pair"] / (singles * (singles - 1) / 2)))


def _as_trace(model: Model, effect: int, temperature: float) -> float:
    """Change of evidence if an effect were present only within its tolerance; minus infinity where it has no zero."""
    parameters = model.effects[effect].parameters
    places = [
        place
        for place, parameter in zip(model.places(effect), parameters, strict=True)
        if not parameter.positive and parameter.centre == 0.0
    ]
    if not places or np.max(np.abs(model.fit.scores[places])) > MOST_OF_A_TRACE * TOLERANCE:
        return float("-inf")
    return at_tolerance(model.fit, places, [TOLERANCE] * len(places), temperature)


INSEPARABLE = 1 / 20
"""Share of the verdict's probability above which another explanation is confounded with it."""


def confounded_effects(weighed: Sequence[Weighed]) -> tuple[tuple[str, ...], ...]:
    """Groups of effects that could replace each other in the verdict, one group for each effect of the verdict."""
    verdict = weighed[0]
    if not verdict.effects or verdict.effects == UNKNOWN:
        return ()
    groups = []
    for effect in verdict.effects:
        rest = set(verdict.effects) - {effect}
        group = [effect]
        for other in weighed[1:]:
            swapped = set(other.effects) - rest
            alike = other.probability > INSEPARABLE * verdict.probability and other.effects != UNKNOWN
            if alike and rest <= set(other.effects) and len(swapped) == 1 and not swapped & set(verdict.effects):
                group += sorted(swapped)
        if len(group) > 1:
            groups.append(tuple(group))
    return tuple(groups)
