"""The diagnosis of any structure as JSON, and in a few sentences."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from math import isfinite
from typing import Any

from analysis.gap.evidence.verdict import UNKNOWN, Status
from analysis.gap.parameter import ParameterEstimate
from analysis.gap.structures.diagnosis import CurveDiagnosis, Explanation
from analysis.gap.structures.effect import PLACE, StructureEffect, Variant, lacking

FORMAT = "jointlab-structure-gap/1"
"""Name and version of the document."""
UNTRIED = 0.95
"""Highest probability that is told of a simulator of which no trial is known."""
NO_RECORD = "these probabilities were not checked by a trial of this simulator: run `jointlab gap trial --model` on it"
"""Where nobody tried how often such a verdict is right."""


def structure_document(
    found: CurveDiagnosis, simulator: str, data: str, record: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """A diagnosis of any structure.

    Args:
        found: the diagnosis.
        simulator: its name.
        data: what was diagnosed.
        record: scores of a trial of this simulator; None where there are none.
    """
    limit = UNTRIED if record is None else resolved_by(record)
    ranking = with_limited_probability(found.ranking, limit)
    best = next((each for each in ranking if each.effects == found.effects), None)
    return {
        "format": FORMAT,
        "simulator": simulator,
        "data": data,
        "verdict": {
            "status": found.status.value,
            "effects": [
                {
                    "id": effect,
                    "title": title_of(found, effect),
                    "law": law,
                    "fields": {} if best is None else best.variants[effect],
                    "parameters": {} if best is None else _parameters(best.parameters[effect]),
                    "not_applied": _not_applied(found, effect),
                }
                for effect, law in zip(found.effects, () if best is None else best.laws, strict=False)
            ],
            "probability": 0.0 if best is None else best.probability,
            "confounded": [list(each) for each in found.confounded],
            "alike": {effect: list(each) for effect, each in found.alike.items()},
            "remainder_significant": found.remainder_significant,
            "pulls": [asdict(each) for each in found.pulls],
            "does_not_fit": list(found.does_not_fit),
        },
        "gap_percent": {
            "left_out_in_turn": {"before": _finite(found.before), "after": _finite(found.after)},
            "never_shown": None
            if found.never_shown is None
            else {"before": _finite(found.never_shown[0]), "after": _finite(found.never_shown[1])},
            "by_part": {
                part: {"before": _finite(own[0]), "after": _finite(own[1])} for part, own in found.by_part.items()
            },
        },
        "ranking": [
            {
                "effects": list(each.effects),
                "laws": list(each.laws),
                "probability": each.probability,
                "gap_percent": _finite(each.percent),
                "fields": each.variants,
                "parameters": {effect: _parameters(own) for effect, own in each.parameters.items()},
            }
            for each in ranking
        ],
        "included": {effect: min(each, limit) for effect, each in found.included.items()},
        "failures": [{"effect": each.effect, "reason": each.reason} for each in found.failures],
        "track_record": NO_RECORD if record is None else record_sentence(record),
        "seconds": found.seconds,
    }


def resolved_by(record: Mapping[str, Any]) -> float:
    """Highest probability that a trial can support: the share of right answers that it leaves possible (Laplace)."""
    strong = record["strong"]
    return float((strong["named"] + 1) / (strong["cases"] + 2))


def record_sentence(record: Mapping[str, Any]) -> str:
    """Scores of a trial in a sentence."""
    strong, none = record["strong"], record["none"]
    return (
        f"in a trial of this simulator {strong['named']} of {strong['cases']} clear effects were named, with "
        f"{none['false_alarms']} false alarms in {none['cases']} cases without an effect; it took "
        f"{record['longest_seconds']:.0f} s at most"
    )


def with_limited_probability(ranking: Sequence[Explanation], limit: float) -> list[Explanation]:
    """A ranking in which no probability exceeds a limit; the rest goes to an unknown cause, or to none."""
    first = max(ranking, key=lambda each: each.probability)
    excess, heir = max(0.0, first.probability - limit), UNKNOWN if first.effects != UNKNOWN else ()
    changed = [
        replace(each, probability=each.probability + excess * ((each.effects == heir) - (each is first)))
        for each in ranking
    ]
    return sorted(changed, key=lambda each: -each.probability)


def title_of(found: CurveDiagnosis, effect: str) -> str:
    """A few words about an effect of the verdict."""
    return _effect_named(found, effect).title


def _effect_named(found: CurveDiagnosis, effect: str) -> StructureEffect:
    """An effect of the verdict; a smooth function stands for the effect that is closest."""
    own: tuple[StructureEffect, ...] = found.model.effects
    return next(each for each in sorted(own, key=lambda each: each.id != effect) if each.id == effect or each.law_free)


def _not_applied(found: CurveDiagnosis, effect: str) -> dict[str, Any] | None:
    """On how many curves an effect of the verdict does not act, and what it needs there; None if it acts on all."""
    own, curves = _effect_named(found, effect), found.model.fit.likelihood.curves
    count = lacking(own, curves)
    return {"curves": count, "of": len(curves), "needs": sorted(own.needs)} if count else None


def _finite(percent: float | None) -> float | None:
    """A gap; null where nothing could be predicted."""
    return None if percent is None or not isfinite(percent) else percent


def _text(percent: float | None) -> str:
    return "no prediction" if percent is None else f"{percent:.3g} %"


def _where(title: str, variant: Variant) -> str:
    """A title with the place and the other fields of an effect: "a spring at c", "a softer part, part link"."""
    at = f" at {_told(variant[PLACE])}" if PLACE in variant else ""
    return title + at + "".join(f", {name} {_told(value)}" for name, value in variant.items() if name != PLACE)


def _told(value: str | float) -> str:
    return f"{value:g} m" if isinstance(value, float) else str(value)


def _parameters(own: dict[str, ParameterEstimate]) -> dict[str, Any]:
    return {name: {"value": each.value, "ci90": list(each.ci90), "unit": each.unit} for name, each in own.items()}


def _pull(own: Mapping[str, Any]) -> str:
    unit = "" if own["unit"] == "1" else f" {own['unit']}"
    part = "" if own["part"] is None else f" of part {own['part']!r}"
    return (
        f"The simulation fits only with its own parameter {own['parameter']}{part} at {own['value']:.4g}{unit}, "
        f"{abs(own['deviations']):.1f} standard deviations from its centre, {own['centre']:.4g}{unit}: check "
        "centre and spread"
    )


def sentences(document: dict[str, Any]) -> Iterator[str]:
    """A diagnosis in sentences."""
    verdict, gaps = document["verdict"], document["gap_percent"]
    names = " and ".join(
        f"{_where(each['title'], each['fields'])} ({each['id']}, {each['law']})" for each in verdict["effects"]
    )
    yield {
        Status.NONE.value: "NONE: nothing beyond the stated deviations",
        Status.UNKNOWN.value: "UNKNOWN: there is a gap, and no effect that was tried explains most of it",
        Status.PARTIAL.value: f"PARTIAL: {names} explains part of the gap",
        Status.EXPLAINED.value: f"EXPLAINED: {names}",
    }[verdict["status"]]
    yield from verdict["does_not_fit"]
    yield from map(_pull, verdict["pulls"])
    left = gaps["left_out_in_turn"]
    yield f"Gap on data that were left out of the fit: {_text(left['before'])} before, {_text(left['after'])} after"
    if gaps["never_shown"] is not None:
        never = gaps["never_shown"]
        yield f"Gap on parts that nothing has seen: {_text(never['before'])} before, {_text(never['after'])} after"
    if verdict["effects"]:
        yield f"Probability {verdict['probability']:.2f}; {document['track_record']}"
    if verdict["remainder_significant"]:
        yield "What remains is more than the stated deviations leave"
    for each in verdict["effects"]:
        for name, own in each["parameters"].items():
            low, high = own["ci90"]
            unit = "" if own["unit"] == "1" else f" {own['unit']}"
            yield f"  {each['id']}: {name} = {own['value']:.4g}{unit}, 90 % [{low:.4g}, {high:.4g}]"
        if (left := each["not_applied"]) is not None:
            needs = ", ".join(left["needs"])
            yield (
                f"  {each['id']}: not applied to {left['curves']} of {left['of']} curves, which lack a condition that "
                f"it needs ({needs})"
            )
    for each in verdict["confounded"]:
        yield f"These data cannot tell apart: {', '.join(each)}"
    for effect, variants in verdict["alike"].items():
        yield f"These data cannot tell apart: {'; '.join(_where(effect, each) for each in variants)}"
    for each in document["failures"]:
        yield f"NOT TRIED: {each['effect']}: {each['reason']}"
