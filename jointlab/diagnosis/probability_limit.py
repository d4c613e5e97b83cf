"""Limits of probability: none beyond what the sealed trials of this catalogue can support."""

from dataclasses import replace

from analysis.gap.diagnosis import Diagnosis, Ranked
from analysis.gap.evidence.verdict import UNKNOWN


def limited(found: Diagnosis, limit: float, limit_of_effects: float) -> Diagnosis:
    """A diagnosis whose probabilities are at most what trials support.

    Probability above the limit goes from the first explanation to an unknown cause: a trial with few cases like this
    one cannot exclude it. From an unknown cause it goes to the explanations that are known, in the ratio of their
    probabilities: where an unknown cause was claimed wrongly, known effects were there.

    Args:
        found: the diagnosis.
        limit: of explanations, 0 to 1.
        limit_of_effects: of an effect, and of its mechanism, to be part of the explanation; 0 to 1.
    """
    first = max(found.ranking, key=lambda each: each.probability)
    excess = max(0.0, first.probability - limit)
    is_unknown = first.effects == UNKNOWN
    known = sum(each.probability for each in found.ranking if each.effects != UNKNOWN)

    def of_unknown(probability: float) -> float:
        """What an explanation, or an effect, with this probability gets of an unknown cause's."""
        return excess * min(probability / known, 1.0) if is_unknown and known else 0.0

    def share(each: Ranked) -> float:
        if each is first:
            return each.probability - excess
        if is_unknown and known:
            return each.probability + of_unknown(each.probability)
        return each.probability + excess * (each.effects == (() if is_unknown else UNKNOWN))

    def part(probability: float) -> float:
        return min(probability + of_unknown(probability), limit_of_effects)

    ranking = [replace(each, probability=share(each)) for each in found.ranking]
    return replace(
        found,
        ranking=tuple(sorted(ranking, key=lambda each: -each.probability)),
        included=tuple(replace(each, probability=part(each.probability)) for each in found.included),
        mechanisms={each: part(probability) for each, probability in found.mechanisms.items()},
    )
