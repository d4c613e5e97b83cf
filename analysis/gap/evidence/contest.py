"""A contest of fitted models of the same data: their scores under one overdispersion, and those that may matter.

The overdispersion, which divides chi-square, is as much as laws of inexact form leave
(`analysis.gap.evidence.model_evidence`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from math import comb
from typing import Generic, TypeVar

import numpy as np

from analysis.gap.catalogue import effect_ids, mechanism_of
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.fitted import AnyModel
from analysis.gap.evidence.model_evidence import at_tolerance, log_evidence, overdispersion_of
from analysis.gap.evidence.plausibility import implausibility
from analysis.gap.outside_catalogue.local_change import LOCAL_CHANGE

TOLERANCE = 1 / 60
"""Share of an effect's range, within which every bench has a trace of the effect."""
MOST_OF_A_TRACE = 4.0
"""Multiple of `TOLERANCE` above which an effect is no trace: the Gaussian about the fit is not valid that far away."""
LAWS_PER_EXPLANATION = 3
"""Laws of one explanation that are fitted to all lines."""
MOST_CONTENDERS = 8
"""Models that are fitted to all lines and weighed."""
MARGIN = 40.0
"""Distance in log probability to the best model, from which a model cannot matter any more."""

M = TypeVar("M", bound=AnyModel)

Catalogue = Mapping[str, str]
"""Mechanism of each effect that could have been found, by id."""


@cache
def beam_rig_catalogue() -> Catalogue:
    """The catalogue of the beam rig and its tester."""
    return {effect: mechanism_of(effect) for effect in effect_ids()}


@dataclass(frozen=True, eq=False)
class Contest(Generic[M]):
    """Models of the same data, the paper's among them, to be compared with each other.

    Attributes:
        none: the paper's model.
        models: with any number of effects, of any number of laws.
        calibration: how wrong laws may be.
        catalogue: of the effects.
    """

    none: M
    models: Sequence[M]
    calibration: Calibration
    catalogue: Catalogue = field(default_factory=beam_rig_catalogue)

    @cached_property
    def _every(self) -> tuple[M, ...]:
        return (self.none, *self.models)

    @cached_property
    def _noise(self) -> float:
        """Chi-square of noise: the least of any model beside its certain misfit."""
        return min(each.fit.chi_square - each.misfit.certain for each in self._every)

    @cached_property
    def _left(self) -> dict[int, float]:
        """Misfit by identity of model, beyond noise."""
        return {id(each): max(each.fit.chi_square - self._noise, each.misfit.certain) for each in self._every}

    @cached_property
    def _best(self) -> M:
        """The explanation whose misfit counts as that of laws of inexact form.

        A further effect that leaves a large part of it only takes up the errors of the others' laws.
        """
        best = self.none
        for size in sorted({len(each.effects) for each in self.models}):
            larger = min((each for each in self.models if len(each.effects) == size), key=self.left)
            # a misfit this small counts as none, and each further unknown takes up one pattern of the errors of laws
            chance = self.calibration.patterns + max(0, _parameters(larger) - _parameters(best))
            if not best.effects or self.left(larger) + chance < self.calibration.further * (self.left(best) + chance):
                best = larger
        return best

    @cached_property
    def overdispersion(self) -> float:
        """T of all models. Noise that neighbouring lines have in common counts once."""
        known = all(effect.form_is_known for effect in self._best.effects)
        by_form = overdispersion_of(self.left(self._best), self.left(self.none), known, self.calibration)
        return max(by_form, self._best.misfit.common_noise)

    @cached_property
    def expected(self) -> Mapping[str, float]:
        """Probability, by id, of each effect about which an instrument gives information beside the data."""
        return {each.id: each.expected for model in self.models for each in model.effects if each.expected}

    def log_prior(self, ids: Sequence[str]) -> float:
        """Log prior of a combination of effects, or of a change at one place of the beam.

        Effects of which instruments show something do not count among those that are merely possible.
        """
        shown = [np.log(sure if each in ids else 1 - sure) for each, sure in self.expected.items()]
        possible = [each for each in ids if each not in self.expected]
        return _log_prior(possible, self.calibration, self.catalogue) + float(np.sum(shown))

    @cached_property
    def _scores(self) -> dict[int, float]:
        return {id(each): log_evidence(each.fit_with(self.overdispersion)) for each in self._every}

    def left(self, model: M) -> float:
        """Misfit of a model beyond noise, squared standard deviations."""
        return self._left[id(model)]

    def score(self, model: M) -> float:
        """Log evidence of one law, up to a constant."""
        return self._scores[id(model)]

    def implausibility(self, model: M) -> float:
        """Log odds against a model whose effects need sizes beyond their plausible range.

        Where data are very precise, a law of inexact form stretches its sizes to take up its own error, and whatever
        keeps them within their range seems to be needed. With overdispersion it does not. So the sizes of that fit
        count, too, where it leaves no more than laws of the right kind may.
        """
        own, again = implausibility(model), model.overdispersed_fit
        if again is None or not own:
            return own
        chi_square = (again.at.cost - float(again.scores @ again.scores)) * self.overdispersion
        right = self.calibration.form_errors(known=False)[1] ** 2 * self.left(self.none)
        return min(own, implausibility(model, again.scores)) if chi_square - self._noise <= right else own

    def predictive_density(self, model: M) -> float:
        """Log density of data that are left out."""
        return model.log_predictive_density(self.overdispersion)

    def as_trace(self, model: M, effects: Sequence[int]) -> float:
        """Log evidence if some effects were there only within their tolerances."""
        places = [place for effect in effects for place in self._zeros(model, effect)]
        tolerances = [TOLERANCE] * len(places)
        return self.score(model) + at_tolerance(model.fit_with(self.overdispersion), places, tolerances)

    def traces(self, model: M) -> list[int]:
        """Effects of a model, by index, that are within their tolerances and could as well be zero."""
        return [
            effect
            for effect in range(len(model.effects))
            if (places := self._zeros(model, effect))
            and np.max(np.abs(model.fit.scores[places])) <= MOST_OF_A_TRACE * TOLERANCE
        ]

    def _zeros(self, model: M, effect: int) -> list[int]:
        """Indices of the unknowns of an effect that are zero where it is absent."""
        parameters = model.effects[effect].parameters
        return [
            place
            for place, parameter in zip(model.places(effect), parameters, strict=True)
            if not parameter.positive and parameter.centre == 0.0
        ]


def _parameters(model: AnyModel) -> int:
    return sum(len(each.parameters) for each in model.effects)


def contenders(contest: Contest[M]) -> list[M]:
    """The models that may matter, the best first: at most `LAWS_PER_EXPLANATION` laws of one explanation."""
    scores = {id(each): contest.score(each) + contest.log_prior(each.ids) for each in contest.models}
    ranked = sorted(contest.models, key=lambda each: -scores[id(each)])
    chosen = list[M]()
    for each in ranked:
        alike = [other for other in chosen if set(other.ids) == set(each.ids)]
        known = any(set(other.effects) == set(each.effects) for other in alike)
        if not known and len(alike) < LAWS_PER_EXPLANATION and scores[id(each)] > scores[id(ranked[0])] - MARGIN:
            chosen.append(each)
    chosen = chosen[:MOST_CONTENDERS]
    return [*chosen, *(each for each in _with_laws_in_place(chosen, ranked, contest.catalogue) if each not in chosen)]


def _with_laws_in_place(chosen: Sequence[M], ranked: Sequence[M], catalogue: Catalogue) -> list[M]:
    """The best model with a law in place of each smooth function: however far behind, it gives the name."""
    found = list[M]()
    for model in chosen:
        free = next((each for each in model.effects if each.law_free), None)
        if free is not None:
            rest = set(model.ids) - {free.id}
            own = [{*rest, effect} for effect, mechanism in catalogue.items() if mechanism == free.mechanism]
            found += [each for each in ranked if set(each.ids) in own][:1]
    return list({id(each): each for each in found}.values())


def _log_prior(ids: Sequence[str], calibration: Calibration, catalogue: Catalogue) -> float:
    """Log prior of a combination of effects, or of a change at one place of the beam."""
    if LOCAL_CHANGE in ids:
        return float(np.log(calibration.counts[1] * calibration.local_share))
    return float(np.log(calibration.counts[len(ids)] / comb(len(catalogue), len(ids))))
