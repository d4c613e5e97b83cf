"""Claims of a diagnosis document, in one form, with or without `effects`, `mechanisms` and `remainder`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from analysis.gap.catalogue import effect_ids, laws
from analysis.gap.effect import Mechanism
from jointlab.diagnosis.document import probability

KNOWN = frozenset(effect_ids())
MECHANISM_OF = {each.value: each.value for each in Mechanism} | {law.id: law.mechanism.value for law in laws()}
"""Mechanism of each effect; a smooth function in place of a law has the mechanism's name."""
CLAIMED = 0.5
"""Probability above which an effect or a mechanism counts as claimed."""


@dataclass(frozen=True)
class Interval:
    """A parameter's value with its 90 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Claims:
    """The claims of one diagnosis.

    Attributes:
        status, probability: of the verdict.
        named: effects of the catalogue in the verdict; smooth functions in place of a law do not count.
        included: probability of each effect that it is part of the explanation.
        mechanisms: probability of each mechanism.
        acting: mechanisms of the verdict.
        intervals: by effect and parameter.
        before, after, floor: held-out gap, percent; None where it was not computed.
        rigs: gaps before and after by rig.
        remainder: misfit that the verdict leaves, percent; None where it is not significant.
        faults: of the measurement.
    """

    status: str
    named: tuple[str, ...]
    probability: float
    included: dict[str, float]
    mechanisms: dict[str, float]
    acting: frozenset[str]
    intervals: dict[str, dict[str, Interval]]
    before: float | None
    after: float | None
    floor: float | None
    rigs: dict[str, tuple[float | None, float | None]]
    remainder: float | None
    faults: int

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> "Claims":
        """The claims of a document."""
        verdict, gap = document["verdict"], document["gap"]
        named = tuple(sorted(KNOWN & set(verdict["effects"])))
        return cls(
            status=verdict["status"],
            named=named,
            probability=probability(document),
            included=_included(document),
            mechanisms=_mechanisms(document),
            acting=frozenset(MECHANISM_OF[each] for each in verdict["effects"]),
            intervals=_intervals(document, named),
            before=gap["before"]["percent"],
            after=gap["after"]["percent"],
            floor=gap["floor_percent"],
            rigs={rig: (each["before"], each["after"]) for rig, each in gap["by_rig"].items()},
            remainder=_remainder(document),
            faults=len(document["faults"]),
        )

    @property
    def said(self) -> set[str]:
        """Effects that are named, or included with more than even odds."""
        return {*self.named, *(effect for effect, sure in self.included.items() if sure > CLAIMED)}

    @property
    def said_mechanisms(self) -> set[str]:
        """Mechanisms that are claimed with more than even odds, and those of the verdict."""
        return {*self.acting, *(each for each, sure in self.mechanisms.items() if sure > CLAIMED)}


def _remainder(document: Mapping[str, Any]) -> float | None:
    found = document.get("remainder")
    return float(found["percent"]) if found and found["significant"] else None


def _included(document: Mapping[str, Any]) -> dict[str, float]:
    if "effects" in document:
        return {each["id"]: float(each["probability"]) for each in document["effects"] if each["id"] in KNOWN}
    found = dict[str, float]()
    for entry in document["ranking"]:
        for effect in KNOWN & set(entry["effects"]):
            found[effect] = found.get(effect, 0.0) + entry["probability"]
    return found


def _mechanisms(document: Mapping[str, Any]) -> dict[str, float]:
    if "mechanisms" in document:
        return {each["mechanism"]: float(each["probability"]) for each in document["mechanisms"]}
    found = dict[str, float]()
    for entry in document["ranking"]:
        for mechanism in {MECHANISM_OF[effect] for effect in entry["effects"] if effect in MECHANISM_OF}:
            found[mechanism] = found.get(mechanism, 0.0) + entry["probability"]
    return found


def _intervals(document: Mapping[str, Any], named: tuple[str, ...]) -> dict[str, dict[str, Interval]]:
    """Intervals of the named effects, from the explanation with the same effects, else from the list of effects."""
    entries = [each["parameters"] for each in document["ranking"] if sorted(each["effects"]) == sorted(named)]
    listed = {each["id"]: each["parameters"] for each in document.get("effects", ())}
    source: Mapping[str, Any] = entries[0] if entries else listed
    return {
        effect: {
            name: Interval(each["value"], *each["ci90"])
            for name, each in source[effect].items()
            if None not in (each["value"], *each["ci90"])
        }
        for effect in named
        if effect in source
    }
