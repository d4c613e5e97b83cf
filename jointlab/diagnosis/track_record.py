"""Results of sealed trials of this catalogue: the score that is shown with each verdict."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

FILE = "trial_scores.json"
FORMAT = "jointlab-trial-scores/1"
STRENGTHS = (("faint", 1.5), ("clear", 5.0), ("strong", float("inf")))
"""Names of gaps, with their largest rms over noise by the model without effects."""
EVEN = 0.5
"""Probability at even odds: only a verdict above it counts as claimed, and no limit is lower."""
FEW = 8
"""Number of similar verdicts below which their share alone says too little."""
PROBABILITY_RANGE = 0.1
"""Difference of claimed probability up to which a verdict counts in ``confidence``."""


@dataclass(frozen=True)
class TrialVerdict:
    """One verdict of a sealed trial.

    Attributes:
        status, effects: of the verdict.
        strength: of the gap.
        probability: the probability that it claimed.
        right: whether it was right; naming an effect that the data cannot tell from the true one counts.
        claimed: number of effects that it claimed with more than even odds; 0 also where that was not kept.
        there: how many of these were there.
    """

    status: str
    effects: tuple[str, ...]
    strength: str
    probability: float
    right: bool
    claimed: int = 0
    there: int = 0


@dataclass(frozen=True)
class TrackRecord:
    """All verdicts of the trial that was published.

    Attributes:
        cases: their number; 0 where there never was a trial.
        verdicts: one for each case.
        versions: of the software that answered.
    """

    cases: int = 0
    verdicts: tuple[TrialVerdict, ...] = ()
    versions: tuple[str, ...] = ()

    def similar(self, status: str, effects: Sequence[str], strength: str, probability: float) -> dict[str, Any] | None:
        """How often verdicts like this one were right; None where there never was a trial.

        Verdicts on the same effects at a gap of the same strength are similar; ``named`` is their number. A pair is
        compared with all pairs, as hardly any was tried twice; ``confidence`` holds all verdicts with about the same
        probability.
        """
        if not self.cases:
            return None
        alike = [each for each in self.verdicts if each.strength == strength and _alike(each, status, effects)]
        as_sure = [each for each in self.verdicts if abs(each.probability - probability) <= PROBABILITY_RANGE]
        return {
            "cases": self.cases,
            "versions": list(self.versions),
            "strength": strength,
            "named": len(alike),
            "right": sum(each.right for each in alike),
            "confidence": {"named": len(as_sure), "right": sum(each.right for each in as_sure)},
        }

    def limit(self, strength: str, count: int) -> float:
        """Largest probability that trials support for explanations of `count` effects at gaps of this strength.

        It is (right + 1) / (all + 2) of the verdicts on similar cases, by the rule of succession. If fewer than `FEW`
        are similar, all verdicts with effects count, or all without. It is 1 where there never was a trial, as is then
        said beside the probability.
        """
        tried = [each for each in self.verdicts if each.probability >= EVEN and bool(each.effects) == bool(count)]
        alike = [each for each in tried if each.strength == strength and len(each.effects) == count]
        counted = [each.right for each in (alike if len(alike) >= FEW else tried)]
        return max(EVEN, (sum(counted) + 1) / (len(counted) + 2)) if self.cases else 1.0

    def limit_of_effects(self, strength: str, count: int) -> float:
        """Largest probability that trials support for an effect to be part of an explanation of `count` effects.

        A verdict with one effect too many is wrong, and its other effects are there all the same. So claimed effects
        are counted, of similar verdicts as `limit` has them; where these are too few, the limit is that of verdicts.
        """
        counted = [each for each in self.verdicts if each.claimed]
        alike = [each for each in counted if each.strength == strength and len(each.effects) == count]
        chosen = alike if sum(each.claimed for each in alike) >= FEW else counted
        claimed, there = sum(each.claimed for each in chosen), sum(each.there for each in chosen)
        return max(EVEN, (there + 1) / (claimed + 2)) if claimed >= FEW else self.limit(strength, count)


def _alike(verdict: TrialVerdict, status: str, effects: Sequence[str]) -> bool:
    if len(effects) == 1:
        return verdict.effects == tuple(effects)
    if effects:
        return len(verdict.effects) == len(effects)
    return not verdict.effects and verdict.status == status


def strength(document: Mapping[str, Any]) -> str:
    """Strength of the gap of a diagnosis document: faint, clear or strong."""
    sigmas = [rig["before_sigma"] for rig in document["gap"]["by_rig"].values() if rig["before_sigma"] is not None]
    largest = max(sigmas, default=document["gap"]["before"]["sigma"])
    return next(name for name, most in STRENGTHS if largest <= most)


@cache
def shipped_record() -> TrackRecord:
    """The record that comes with this version; an empty one where no trial was published."""
    file = resources.files("jointlab.diagnosis") / FILE
    return record_from(json.loads(file.read_text(encoding="utf-8"))) if file.is_file() else TrackRecord()


def record_from(document: Mapping[str, Any]) -> TrackRecord:
    """A record as it is kept in `FILE`."""
    verdicts = [TrialVerdict(**(each | {"effects": tuple(each["effects"])})) for each in document["verdicts"]]
    return TrackRecord(document["cases"], tuple(verdicts), tuple(document.get("versions", ())))
