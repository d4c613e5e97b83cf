"""Screening: the gain that effects promise on top of a model, before they are fitted in full."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.effect import Effect
from analysis.gap.fitting.fit import Fit, as_unknowns, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.stages import Stage
from analysis.gap.simulation.two_rigs import Simulation


@dataclass(frozen=True, eq=False)
class LinearStep:
    """A model linearised about its fit, to which further parameters can be added.

    Attributes:
        known: (unknowns, data) whitened derivatives in all unknowns, `bounded`.
        whitening: (unknowns, unknowns) W with W (known known^T + 1) W^T = 1.
        scores: (unknowns,).
        cost: chi-square with priors.
    """

    known: Real
    whitening: Real
    scores: Real
    cost: float

    @classmethod
    def about(cls, likelihood: Likelihood, scores: Real) -> LinearStep:
        """The model linearised about `scores` (unknowns,)."""
        shared, left = likelihood.columns(scores, range(len(likelihood.simulation.shared)))
        known = np.concatenate([shared, likelihood.own_columns(scores)])
        return cls.of(known, scores, float(left @ left + scores @ scores))

    @classmethod
    def of(cls, known: Real, scores: Real, cost: float) -> LinearStep:
        """A model with some derivatives in its unknowns (unknowns, data)."""
        known = bounded(known)
        values, ways = np.linalg.eigh(known @ known.T + np.eye(len(known)))
        # no value is below one but by rounding, where some columns are many times as large as others
        whitening = (ways / np.sqrt(np.maximum(values, 1.0))).T
        return cls(known, np.asarray(whitening), scores, cost)

    def with_further(self, columns: Real, start: Real, left: Real) -> tuple[float, Real]:
        """The decrease of cost by a step in all unknowns and further ones, and the (further,) scores after it.

        Args:
            columns: (further, data) whitened derivatives, `bounded`.
            start: (further,) their scores.
            left: (data,) whitened residual there.
        """
        solved = self.whitening @ (self.known @ columns.T)
        known = self.whitening @ (self.known @ left - self.scores)
        reduced = columns @ columns.T + np.eye(len(columns)) - solved.T @ solved
        along = columns @ left - start - solved.T @ known
        values, ways = np.linalg.eigh(reduced)
        values = np.maximum(values, 1.0)  # nor is any less here, where large columns say nearly the same
        lowered = known @ known + np.sum((along @ ways) ** 2 / values)
        gain = self.cost - (left @ left + self.scores @ self.scores + start @ start - lowered)
        return float(gain), np.asarray(start + ways @ ((along @ ways) / values))


LARGEST_DERIVATIVE = 1e6
"""Whitened derivative beyond which a parameter is as good as fixed."""


def bounded(columns: Real) -> Real:
    """(n, data) derivatives in n parameters, each in a unit in which none exceeds `LARGEST_DERIVATIVE`.

    Far outside of what is possible derivatives overflow in sums of squares, or are no numbers: these are left out.
    """
    largest = np.max(np.abs(columns), axis=1, keepdims=True, initial=0.0)
    finite = np.isfinite(largest)
    return np.where(finite, columns, 0.0) * np.minimum(1.0, LARGEST_DERIVATIVE / np.where(largest > 0, largest, 1.0))


INFLATIONS = (0.0, 0.01, 0.03, 0.1, 0.3)
"""Shares of |H| that are added to noise; screening takes the smallest that makes a model plausible."""
PLAUSIBLE = 2.0
"""Chi-square per datum up to which a misfit could be noise."""
MOST_STARTS = 12
"""Largest number of starting points of one candidate."""
FAR = 3.0
"""Standard deviations from the prior to which starting points are limited."""
VARIANTS = 2
"""Number of variants of a law that are fitted, such as the joint that it concerns."""
IN_TESTER = (Stage(tester_inflation=0.1), Stage(tester_inflation=0.01))
"""A law is right to about a hundredth; only a residual beyond that counts."""
TESTER_GAIN, TESTER_STEPS = 1.0, 10


@dataclass(frozen=True, eq=False)
class ExpectedGain:
    """The gain in chi-square that a candidate is expected to bring, and scores to start its fit from, best first."""

    effect: Effect
    gain: float
    starts: tuple[Real, ...]


@dataclass(frozen=True, eq=False)
class _Stepped:
    """A step of a linearised fit: scores of a candidate where it begins and ends, and its gain in chi-square."""

    start: Real
    gain: float
    end: Real


def plausible(found: Fit) -> Likelihood:
    """The likelihood of a fit with noise inflated until its misfit could be noise."""
    likelihood = found.likelihood
    for inflation in INFLATIONS:
        likelihood = replace(found.likelihood, inflation=inflation, tester_inflation=inflation)
        if likelihood.at(found.scores).cost < PLAUSIBLE * likelihood.data:
            break
    return likelihood


def gain_by_linear_step(likelihood: Likelihood, step: LinearStep, extended: Simulation) -> ExpectedGain | None:
    """The expected gain of the last effect of a simulation by one step of a linearised fit; None where none is finite.

    A second step from where the best one ends sees what a parameter changes once another one is not zero, such as the
    frequencies over which a softening is distributed. The larger gain counts.

    Args:
        likelihood: of the model without it.
        step: from that model.
        extended: with it.
    """
    candidate, shared = extended.effects[-1], len(likelihood.simulation.shared)
    whole = Likelihood(extended, likelihood.inflation, likelihood.inflation)
    own = range(shared, shared + len(candidate.parameters))

    def stepped(start: Real) -> _Stepped | None:
        with np.errstate(all="ignore"):
            columns, left = whole.columns(as_unknowns(inserted(step.scores, shared, start), whole), own)
            if not (np.all(np.isfinite(columns)) and np.isfinite(left @ left)):
                return None
            return _Stepped(start, *step.with_further(bounded(columns), start, left))

    tried = [found for start in starts(candidate) if (found := stepped(start)) is not None]
    if not tried:
        return None
    tried.sort(key=lambda each: -each.gain)
    further = stepped(np.clip(tried[0].end, -FAR, FAR)) if len(own) > 1 else None
    gains = [each.gain for each in (tried[0], further) if each is not None]
    return ExpectedGain(candidate, max(gains), tuple(each.start for each in tried))


def gain_by_tester_fit(extended: Simulation) -> ExpectedGain:
    """The expected gain of the last effect by a fit to the tester alone, which is quick and valid far from linear."""
    alone = extended.of(replace(extended.baseline.measurement, sets=()))
    candidate, own = extended.effects[-1], len(extended.effects[-1].parameters)
    without = replace(alone, effects=alone.effects[:-1])
    before, tried = _fitted(without, np.zeros(len(without.shared))), list[tuple[float, Real]]()
    for start in starts(candidate):
        found = _fitted(alone, np.concatenate([np.zeros(len(without.shared)), start]))
        tried.append((before.at.cost - found.at.cost, found.scores[-own:]))
    tried.sort(key=lambda each: -each[0])
    return ExpectedGain(candidate, tried[0][0], tuple(scores for _, scores in tried[:1]))


def _fitted(simulation: Simulation, start: Real) -> Fit:
    return fit(simulation, start, IN_TESTER, TESTER_GAIN, TESTER_STEPS)


def starts(effect: Effect, first: int = 0) -> list[Real]:
    """Scores of its parameters, from the `first` on, from which a candidate is fitted."""
    combinations = product(*(parameter.starts for parameter in effect.parameters[first:]))
    return [np.array(each) for each in combinations][:MOST_STARTS]


def inserted(scores: Real, place: int, own: Real) -> Real:
    """Scores of a model with those of a further effect among the shared."""
    return np.concatenate([scores[:place], own, scores[place:]])


def by_gain(expected: Sequence[ExpectedGain], least: float) -> list[ExpectedGain]:
    """Expected gains of effects of which any law gains more than `least`, the best first.

    A law that is far from linear gains little in one step, so it is kept with its rivals.
    """
    promising = {each.effect.id for each in expected if each.gain > least}
    return sorted((each for each in expected if each.effect.id in promising), key=lambda each: -each.gain)


def best_laws(ranked: Sequence[ExpectedGain], laws: int) -> list[ExpectedGain]:
    """The best `VARIANTS` of each of the best `laws` of one effect; if `laws` is 1, only the best variant."""
    wanted = list(dict.fromkeys(each.effect.law for each in ranked))[:laws]
    of_each = VARIANTS if laws > 1 else 1
    return [each for law in wanted for each in [one for one in ranked if one.effect.law == law][:of_each]]
