"""Effects that these data cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.gap.verdict import UNKNOWN, Weighed

INSEPARABLE = 1 / 20
"""Of the verdict's probability, above which another explanation is its twin."""


def twins(weighed: Sequence[Weighed]) -> tuple[tuple[str, ...], ...]:
    """Groups of effects that could each stand in the verdict's place, one group for each effect of the verdict."""
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
