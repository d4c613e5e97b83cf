"""The probability of each explanation: the effects of each visited model, or a cause that is in no catalogue.

The prior says little more than how many causes a gap has. Each effect is compared with itself at its tolerance, a
narrow prior, so that the trace of it in every bench explains nothing. The misfit that the best explanation leaves is
reported beside it, not weighed against it. Only where it is most of the gap is the cause likely to be in no catalogue.
"""

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from typing import Any, Generic

import numpy as np
from scipy.special import expit, log_expit, logsumexp

from analysis.gap.effect import Mechanism
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.contest import Catalogue, Contest, M, beam_rig_catalogue
from analysis.gap.evidence.fitted import AnyModel
from analysis.gap.evidence.plausibility import CHANCE, impossibility
from analysis.gap.outside_catalogue.local_change import CHANGES, LOCAL_CHANGE

UNKNOWN = ("unknown",)
NAMED_FROM = 0.5
"""Share of what a smooth function explains that a law has to explain to give the cause its name."""
OF_INSTRUMENTS = frozenset({Mechanism.BLOW, Mechanism.MEASURING_CHAIN, Mechanism.TESTER})
"""Mechanisms of instruments, whose laws are closer to what they do than those of rubber and friction are."""
TAKEN_OVER = 4.0
"""Largest log odds that left-out data take over from the evidence, as a prior: the prior log odds of one effect, or of
more effects where these are larger. Left-out data do not see an effect that tolerances of the bench can imitate, at
sizes far beyond what is stated."""
EXCLUDED = CHANCE**2 / 2
"""Log odds against no effect above which the data exclude it; they correspond to `CHANCE` standard deviations."""
NO_FIT, REPAIRED = 100.0, 0.5
"""Gap on data that were not fitted, in per cent, from which a model predicts no better than zeros would; and the share
of it that an effect may leave if the effect was the reason."""
RANKED = 5
"""Explanations that are shown."""
ALIKE = 0.8
"""Share of the highest probability from which another counts as equal: where evidence and left-out data disagree, both
explanations have about one half, and only a hundred such cases would tell 0.55 from 0.45."""
INSEPARABLE = 1 / 20
"""Share of the verdict's probability above which another explanation is confounded with it."""


class Status(StrEnum):
    """The result of a diagnosis."""

    NONE = "none"
    """Nothing beyond noise and the stated tolerances."""
    EXPLAINED = "explained"
    """The named effects explain the gap."""
    PARTIAL = "partial"
    """The named effects help, and something remains."""
    UNKNOWN = "unknown"
    """There is a gap, and nothing in the catalogue explains most of it."""


@dataclass(frozen=True, eq=False)
class Weighed(Generic[M]):
    """One explanation.

    Attributes:
        effects: ids; ("unknown",) for a cause that the catalogue does not have.
        model: with its most probable laws; for an unknown cause, the closest: a change at one place, or effects.
        score: logarithm of its probability.
        probability: all sum to one.
    """

    effects: tuple[str, ...]
    model: M
    score: float
    probability: float

    @property
    def laws(self) -> tuple[str, ...]:
        """Law of each effect, in their order; empty for an unknown cause."""
        return (
            ()
            if self.effects == UNKNOWN
            else tuple(self.model.effects[self.place_of(each)].law for each in self.effects)
        )

    def place_of(self, effect: str) -> int:
        """Index of the model's own effect that stands for one of `effects`: the same, or its smooth function."""
        ids = list(self.model.ids)
        return ids.index(effect) if effect in ids else [each.law_free for each in self.model.effects].index(True)


def weigh(
    none: M,
    models: Sequence[M],
    calibration: Calibration,
    left_out: bool = False,
    catalogue: Catalogue | None = None,
) -> tuple[Weighed[M], ...]:
    """Explanations by probability, the best first.

    Args:
        none: the paper's model, fitted to the same data as `models`.
        models: with any number of effects, of any number of laws.
        calibration: what trials say.
        left_out: whether the density of data that are left out counts beside the evidence, with the same weight.
        catalogue: of the effects; that of the beam rig by default.
    """
    contest = Contest(none, models, calibration, beam_rig_catalogue() if catalogue is None else catalogue)

    by_evidence, best = _weights(contest, contest.score, contest.as_trace, contest.log_prior)
    weights = by_evidence
    if left_out:
        highest = max(by_evidence.values())
        predictive, _ = _weights(
            contest,
            contest.predictive_density,
            lambda model, _: contest.predictive_density(model),
            lambda ids: max(
                by_evidence[ids] - highest, min(-TAKEN_OVER, contest.log_prior(ids) - contest.log_prior(()))
            ),
        )
        weights = {ids: float(np.logaddexp(each, predictive[ids])) - float(np.log(2)) for ids, each in weights.items()}
    elsewhere = float(np.exp(weights.pop((LOCAL_CHANGE,), -np.inf)))
    weights = _less_implausible(weights, best, contest)
    top = best[max(weights, key=lambda ids: weights[ids])]
    odds = outside_log_odds(none, top, calibration) + contest.implausibility(top)
    odds += impossibility(top.fit_with(contest.overdispersion))
    logs = {ids: weight + float(log_expit(-odds)) for ids, weight in weights.items()}
    result = [Weighed(ids, best[ids], score, float(np.exp(score))) for ids, score in logs.items()]
    unknown = elsewhere + (1 - elsewhere) * float(expit(odds))
    closest = best[LOCAL_CHANGE,] if 2 * elsewhere > unknown else top
    result.append(Weighed(UNKNOWN, closest, float(np.log(unknown)), unknown))
    return tuple(sorted(result, key=lambda each: -each.probability))


def unfit(model: str, before: float, after: float, check: str) -> tuple[str, ...]:
    """A sentence where a model predicts nothing and no effect repairs that; a cause cannot be found then.

    Args:
        model: its name.
        before, after: gaps on data that were not fitted, per cent, without and with the effects of the verdict.
        check: what may be wrong.
    """
    if before < NO_FIT or after < REPAIRED * NO_FIT:
        return ()
    return (
        f"{model} does not fit at all (gap {before:.4g} % on data that it did not see), so no cause can be named: "
        f"check {check}",
    )


LogWeights = dict[tuple[str, ...], float]
"""Log probability of each explanation, by ids of effects."""


def _less_implausible(weights: LogWeights, best: Mapping[tuple[str, ...], M], contest: Contest[M]) -> LogWeights:
    """Log probabilities after the odds against implausible sizes; the sum of the probabilities does not change."""
    left = {ids: weight - contest.implausibility(best[ids]) for ids, weight in weights.items()}
    lost = float(logsumexp(list(weights.values())) - logsumexp(list(left.values())))
    return {ids: weight + lost for ids, weight in left.items()}


Explanations = tuple[LogWeights, dict[tuple[str, ...], M]]
"""Log probability if the cause is in the catalogue, and best model, each by ids of effects."""


def _weights(
    contest: Contest[M],
    score: Callable[[M], float],
    as_trace: Callable[[M, Sequence[int]], float],
    prior: Callable[[tuple[str, ...]], float],
) -> Explanations[M]:
    every = (contest.none, *contest.models)
    by_law = [each for each in every if not any(effect.law_free for effect in each.effects)]
    laws = dict[tuple[str, ...], list[tuple[float, M]]]()
    for each in by_law:
        laws.setdefault(tuple(sorted(each.ids)), []).append((score(each), each))
    named = {ids: max(found, key=lambda each: each[0]) for ids, found in laws.items()}
    for each in every:
        for ids, share in _closest(each, named, contest).items():
            laws.setdefault(ids, []).append((score(each) + share, each))
    scores = {
        ids: _averaged([of for of, _ in found], CHANGES if ids == (LOCAL_CHANGE,) else 1) for ids, found in laws.items()
    }
    for each in by_law:  # traces of effects belong to the explanation without them
        found = contest.traces(each)
        for traces in (some for size in range(1, len(found) + 1) for some in combinations(found, size)):
            rest = tuple(sorted(effect.id for place, effect in enumerate(each.effects) if place not in traces))
            if rest in scores and (rest or contest.none.misfit.certain == 0.0):
                scores[rest] = max(scores[rest], as_trace(each, traces))
    weights = {ids: of + prior(ids) for ids, of in scores.items()}
    total = float(logsumexp(list(weights.values())))
    # of laws that fit alike, one within its range stands for the explanation
    best = {
        ids: max(found, key=lambda each: each[0] - contest.implausibility(each[1]))[1] for ids, found in laws.items()
    }
    return {ids: weight - total for ids, weight in weights.items()}, best


def _closest(
    model: M, named: Mapping[tuple[str, ...], tuple[float, M]], contest: Contest[M]
) -> dict[tuple[str, ...], float]:
    """Explanations that a smooth function in a model stands for: ids with an effect in its place, and its log share.

    A smooth function says which mechanism acts; the fits of the laws say which of its effects it is. An effect is not
    there if its laws need sizes far beyond their range, or if it has a known form, as a mass or an instrument has, and
    explains little of what the function explains. Where this holds for all effects, the cause is in no catalogue.
    """
    free = [each for each in model.effects if each.law_free]
    if not free:
        return {}
    rest = {each.id for each in model.effects} - {free[0].id}
    own = [effect for effect, mechanism in contest.catalogue.items() if mechanism == free[0].mechanism]
    fits = {ids: named[ids] for effect in own if (ids := tuple(sorted({*rest, effect}))) in named}
    _, without = named.get(tuple(sorted(rest)), (0.0, contest.none))
    most = without.misfit.certain - NAMED_FROM * (without.misfit.certain - model.misfit.certain)
    of_instrument = free[0].mechanism in OF_INSTRUMENTS
    known = {
        ids: score
        for ids, (score, law) in fits.items()
        if contest.implausibility(law) < EXCLUDED
        and (
            law.misfit.certain <= most
            or not (of_instrument or all(each.form_is_known for each in law.effects if each.id not in rest))
        )
    }
    if fits and not known:
        return {(LOCAL_CHANGE,): 0.0}
    return {ids: score - float(logsumexp(list(known.values()))) for ids, score in known.items()}


def outside_log_odds(none: AnyModel, best: AnyModel, calibration: Calibration) -> float:
    """Log odds that the cause of a gap is in no catalogue, from what the best explanation leaves of it.

    An effect whose form is known leaves less where it is the true one; what remains then says more.
    """
    gap, left = none.misfit, best.misfit
    known = bool(best.effects) and all(effect.form_is_known for effect in best.effects)
    least = calibration.form_errors(known)[1] ** 2  # smaller shares are what right laws leave
    whole = min(1.0, left.certain / gap.certain) if gap.certain else 0.0
    share = share_per_effect(whole, len(best.effects), least)
    odds = calibration.outside_slope * np.log10(share / calibration.outside_share)
    return float(min(odds, (left.significance**2 - CHANCE**2) / 2))


def share_per_effect(left: float, effects: int, least: float) -> float:
    """Share of its own part of the misfit that each effect of an explanation leaves, in the geometric mean.

    Args:
        left: share of the whole misfit that the explanation leaves.
        effects: their number.
        least: share that right laws may leave; a smaller one says no more.
    """
    return float(max(least, min(1.0, left) ** (1 / max(1, effects))))


def leading(weighed: Sequence[Weighed[M]]) -> Weighed[M]:
    """The verdict: an unknown cause where that is more likely than not, else the best explanation by the catalogue.

    Among explanations that trials cannot tell apart by their probability (`ALIKE`), it is the one with fewest effects.
    """
    unknown = next((each for each in weighed if each.effects == UNKNOWN), None)
    if unknown is not None and unknown.probability > 0.5:
        return unknown
    known = sorted((each for each in weighed if each is not unknown), key=lambda each: -each.probability)
    return min(
        (each for each in known if each.probability >= ALIKE * known[0].probability), key=lambda each: len(each.effects)
    )


def with_refuted(
    weighed: Sequence[Weighed[M]], refuted: Set[tuple[str, ...]], none: AnyModel
) -> tuple[Weighed[M], ...]:
    """Explanations with no probability for those that data refute.

    The probability of refuted effects goes to an unknown cause. Where no misfit is certain, it goes to no effect; if
    the data exclude no effect, the other explanations share it in proportion instead. They also share the probability
    of a refuted unknown cause, because that refutation is no evidence about any of them.

    Args:
        weighed: explanations.
        refuted: ids of those that lose it.
        none: the model without effects; it leaves a misfit where a cause is to be looked for.
    """
    heir = UNKNOWN if none.misfit.certain and UNKNOWN not in refuted else ()
    kept = [each for each in weighed if each.effects not in refuted]
    rest = sum(each.probability for each in kept)
    lost = 1 - rest
    if rest and (refuted == {UNKNOWN} or (heir == () and excludes_no_effect(kept))):
        shares = {each.effects: each.probability / rest for each in weighed}
    else:
        shares = {each.effects: each.probability + lost * (each.effects == heir) for each in weighed}
    changed = [replace(each, probability=0.0 if each.effects in refuted else shares[each.effects]) for each in weighed]
    return tuple(sorted(changed, key=lambda each: -each.probability))


def excludes_no_effect(weighed: Sequence[Weighed[Any]]) -> bool:
    """Whether the best explanation is so much more probable than no effect that no effect is excluded (`EXCLUDED`)."""
    scores = {each.effects: each.score for each in weighed}
    return scores[()] < max(scores.values()) - EXCLUDED


def included(weighed: Sequence[Weighed[Any]]) -> Mapping[str, float]:
    """Probability of each effect that it is part of the explanation, the largest first."""
    found = dict[str, float]()
    for each in weighed:
        for effect in each.effects if each.effects != UNKNOWN else ():
            found[effect] = found.get(effect, 0.0) + each.probability
    return dict(sorted(found.items(), key=lambda each: -each[1]))


def listed(weighed: Sequence[Weighed[M]]) -> list[Weighed[M]]:
    """The first `RANKED` explanations, and no effect and the unknown cause whatever their rank."""
    return [each for rank, each in enumerate(weighed) if rank < RANKED or each.effects in ((), UNKNOWN)]


def model_of_verdict(verdict: Weighed[M], none: M) -> M:
    """The model of a verdict; for an unknown cause, the paper's."""
    return none if verdict.effects == UNKNOWN else verdict.model


def _averaged(evidence: Sequence[float], hypotheses: int) -> float:
    """Log of the mean evidence of some hypotheses; those that were not fitted have none."""
    return float(logsumexp(evidence) - np.log(max(len(evidence), hypotheses)))


def confounded_effects(weighed: Sequence[Weighed[Any]]) -> tuple[tuple[str, ...], ...]:
    """Groups of effects that could replace each other in the verdict, one group for each effect of the verdict."""
    verdict = leading(weighed)
    if not verdict.effects or verdict.effects == UNKNOWN:
        return ()
    groups = []
    for effect in verdict.effects:
        rest = set(verdict.effects) - {effect}
        group = [effect]
        for other in weighed:
            swapped = set(other.effects) - rest
            alike = other.probability > INSEPARABLE * verdict.probability and other.effects != UNKNOWN
            if alike and rest <= set(other.effects) and len(swapped) == 1 and not swapped & set(verdict.effects):
                group += sorted(swapped)
        if len(group) > 1:
            groups.append(tuple(group))
    return tuple(groups)
