"""The mark of one answer by its truth."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import TypeAdapter

from jointlab.diagnosis.track_record import strength
from jointlab.trials.claims import CLAIMED, MECHANISM_OF, Claims

VISIBLE = 5.0
"""Standard deviations d from which a diagnosis is expected to find an effect."""
RECORD_FAULTS = {"polarity", "label_swap"}
"""Faults of a record; to find and repair them, and to say that no effect is there, is right."""
FAILED = "failed"
"""Status of an answer that is an error."""
SURE = 0.9


@dataclass(frozen=True, kw_only=True)
class Truth:
    """The truth of a case.

    Attributes:
        case: seed of the case, or name of a labelled bundle.
        kind: none, single, pair, triple, five, mixture or novel.
        effects, novel: true effects of the catalogue, and in no catalogue.
        size: fraction of each effect's plausible range.
        parameters: by effect and name.
        d: least of `d_each`; 0 without effects.
        d_each: standard deviations that each effect leaves after the baseline has been fitted; 0 or absent where they
            are not known.
        inseparable: effects that these data cannot distinguish from the true ones.
        floor_percent: gap that a new measurement of the same article would have.
        remainder_percent: true gap that the verdict leaves on the rows that were measured; None where it is not known.
    """

    case: str
    kind: str
    effects: tuple[str, ...]
    novel: tuple[str, ...]
    size: dict[str, float]
    parameters: dict[str, dict[str, Any]]
    d: float
    d_each: dict[str, float] = field(default_factory=dict)
    inseparable: tuple[str, ...] = ()
    floor_percent: float
    remainder_percent: float | None = None

    @property
    def visible(self) -> tuple[str, ...]:
        """Effects of the catalogue that these data show."""
        if len(self.effects) == 1:
            return self.effects if self.d >= VISIBLE else ()
        return tuple(effect for effect in self.effects if self.d_each.get(effect, 0.0) >= VISIBLE)


@dataclass(frozen=True)
class Coverage:
    """One parameter of an answer beside its truth.

    Attributes:
        effect, parameter: ids.
        truth, value: true and found.
        low, high: ends of its 90 % interval.
    """

    effect: str
    parameter: str
    truth: float
    value: float
    low: float
    high: float

    @property
    def inside(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.truth <= self.high


@dataclass(frozen=True, kw_only=True)
class Mark:
    """How good an answer is; an answer that is an error has the defaults.

    Attributes:
        truth: of the case.
        status, named, probability: of the verdict.
        included: probability of each effect.
        mechanisms: what the verdict claims.
        right: whether exactly the true effects are named or, in a case without any, the right status is given.
        inseparable: whether it is right, or names only effects that these data cannot distinguish from the true ones.
        mechanism_right: whether exactly the true mechanisms are claimed.
        found, spurious: true and false effects that are claimed with more than even odds.
        surely_wrong: false effects with a probability of 0.9 or more.
        before, after, unseen: held-out gap as reported, and the true one on rows that were never shown, floor
            included; percent.
        worsened: rigs whose gap grows with the verdict.
        remainder: remainder beyond noise as the verdict states it, percent.
        strength: of the gap.
        coverage: of parameters with the same name in truth and answer.
        seconds, error: of the diagnosis.
        version: of the software that answered.
    """

    truth: Truth
    status: str = FAILED
    named: tuple[str, ...] = ()
    probability: float = 0.0
    included: dict[str, float] = field(default_factory=dict)
    mechanisms: tuple[str, ...] = ()
    right: bool = False
    inseparable: bool = False
    mechanism_right: bool = False
    found: tuple[str, ...] = ()
    spurious: tuple[str, ...] = ()
    surely_wrong: tuple[str, ...] = ()
    before: float | None = None
    after: float | None = None
    unseen: float | None = None
    worsened: tuple[str, ...] = ()
    remainder: float | None = None
    strength: str = ""
    coverage: tuple[Coverage, ...] = ()
    seconds: float = 0.0
    error: str = ""
    version: str = ""


MARK = TypeAdapter(Mark)


def marked(truth: Truth, answer: Mapping[str, Any], unseen: float | None = None) -> Mark:
    """Compare an answer with its truth.

    Args:
        truth: of the case.
        answer: a diagnosis document, or an ``error``; both with ``seconds``.
        unseen: true gap of the predictions on rows that were never shown, percent.
    """
    if "error" in answer:
        return Mark(truth=truth, seconds=answer["seconds"], error=answer["error"], version=answer.get("version", ""))
    claims = Claims.of(answer)
    said, allowed = claims.said, {*truth.effects, *truth.inseparable}
    right = _right(truth, claims)
    mechanisms = {MECHANISM_OF[effect] for effect in truth.effects}
    return Mark(
        truth=truth,
        status=claims.status,
        named=claims.named,
        probability=claims.probability,
        included=claims.included,
        mechanisms=tuple(sorted(claims.said_mechanisms)),
        right=right,
        inseparable=right or (bool(claims.named) and set(claims.named) <= allowed and bool(truth.inseparable)),
        mechanism_right=claims.said_mechanisms == mechanisms if truth.effects else right,
        found=tuple(sorted(said & set(truth.effects))),
        spurious=tuple(sorted(said - allowed)),
        surely_wrong=tuple(sorted(effect for effect in said - allowed if claims.included.get(effect, 0.0) >= SURE)),
        before=claims.before,
        after=claims.after,
        unseen=unseen,
        worsened=tuple(rig for rig, (before, after) in claims.rigs.items() if _grows(before, after)),
        remainder=claims.remainder,
        strength=strength(answer),
        coverage=_coverage(truth, claims),
        seconds=answer["seconds"],
        version=answer.get("version", ""),
    )


def _right(truth: Truth, claims: Claims) -> bool:
    if truth.novel and set(truth.novel) <= RECORD_FAULTS:
        return claims.status == "none" and claims.faults > 0
    if truth.novel:
        return claims.status in ("unknown", "partial") and not claims.said
    if not truth.effects:
        return claims.status == "none"
    return set(claims.named) == set(truth.effects)


def _grows(before: float | None, after: float | None) -> bool:
    return before is not None and after is not None and after > before


def _coverage(truth: Truth, claims: Claims) -> tuple[Coverage, ...]:
    found = []
    for effect in sorted(set(claims.named) & set(truth.effects)):
        own = truth.parameters.get(effect, {})
        for name, interval in claims.intervals.get(effect, {}).items():
            if isinstance(true := own.get(name), int | float) and not isinstance(true, bool):
                found.append(Coverage(effect, name, float(true), interval.value, interval.low, interval.high))
    return tuple(found)


def accepted(mark: Mark, least: float = CLAIMED) -> bool:
    """Whether an effect in no catalogue got a known name with a probability of at least `least`."""
    return any(mark.included.get(effect, 0.0) >= least for effect in mark.spurious)
