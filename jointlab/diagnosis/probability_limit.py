"""Limits of probability: none beyond what the sealed trials of this catalogue can support."""

from dataclasses import replace

from analysis.gap.diagnosis import Diagnosis, Ranked
from analysis.gap.evidence.verdict import UNKNOWN


def limited(found: Diagnosis, limit: float, limit_of_effects: float) -> Diagnosis:
    """A diagnosis whose probabilities are at most what trials support.

    Probability above the limit goes from the first explanation to an unknown cause, and from an unknown cause to no
    effect: a trial with few cases like this one cannot exclude either.

    Args:
        found: the diagnosis.
        limit: of explanations, 0 to 1.
        limit_of_effects: of an effect, and of its mechanism, to be part of the explanation; 0 to 1.
    """
    excess = max(0.0, max(each.probability for each in found.ranking) - limit)
    first = max(found.ranking, key=lambda each: each.probability)
    other = UNKNOWN if first.effects != UNKNOWN else ()

    def share(each: Ranked) -> float:
        return each.probability + excess * ((each.effects == other) - (each is first))

    ranking = [replace(each, probability=share(each)) for each in found.ranking]
    return replace(
        found,
        ranking=tuple(sorted(ranking, key=lambda each: -each.probability)),
        included=tuple(replace(each, probability=min(each.probability, limit_of_effects)) for each in found.included),
        mechanisms={each: min(probability, limit_of_effects) for each, probability in found.mechanisms.items()},
    )
