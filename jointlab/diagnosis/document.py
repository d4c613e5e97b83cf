"""A diagnosis as the JSON document `jointlab-diagnosis/1`, which other programs read."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from analysis.gap.diagnosis import Diagnosis, Ranked
from analysis.gap.findings import EffectFound, Remainder
from analysis.gap.held_out import Gap
from analysis.gap.location import GapMap, Place
from analysis.gap.scales import NAMES
from analysis.gap.verdict import Status
from jointlab.diagnosis.catalogue import title_of
from jointlab.diagnosis.experiment_text import sentence
from jointlab.diagnosis.modesty import within
from jointlab.diagnosis.track_record import TrackRecord, shipped_record, strength
from jointlab.identification.document import plain

FORMAT = "jointlab-diagnosis/1"
UNKNOWN = "unknown"


def diagnosis_document(found: Diagnosis, record: TrackRecord | None = None) -> dict[str, Any]:
    """The whole document; unknown numbers are null.

    Beyond the contract: significance and place in the tester in ``where``, sigmas by rig, ``laws`` and ``explained`` of
    each explanation, parameters out of range and the mechanism of each effect, the ``experiment`` of the verdict by its
    id, ``titles`` of effects, ``maps``, ``faults``, missing evidence in ``lost``, and in ``trial`` how often this
    catalogue was right on sealed cases like this one; None where it was never tried.

    Args:
        found: the diagnosis.
        record: of sealed trials; by default the one that is shipped.
    """
    record = shipped_record() if record is None else record
    rigs = {rig: _rig(found, rig) for rig in ("inverse", "direct") if getattr(found.before, rig) is not None}
    gap = {
        "before": _gap(found.before.overall),
        "after": _gap(found.after.overall),
        "after_ci90_percent": found.after.ci90_percent,
        "floor_percent": found.floor_percent,
        "held_out": True,
        "by_rig": rigs,
    }
    strong = strength({"gap": gap})
    found = within(found, record.limit(strong, len(found.effects)))
    document: dict[str, Any] = plain(
        {
            "format": FORMAT,
            "gap": gap,
            "where": [_place(each) for each in found.where],
            "ranking": [_ranked(each) for each in found.ranking],
            "verdict": {
                "status": found.status.value,
                "effects": found.effects,
                "twins": found.confounded,
                "next_experiment": sentence(found.next_experiment),
                "experiment": asdict(found.next_experiment),
            },
            "effects": [_effect(each) for each in found.included],
            "mechanisms": [{"mechanism": each, "probability": sure} for each, sure in found.mechanisms.items()],
            "remainder": _remainder(found.remainder),
            "nuisances": {name: getattr(found.nuisances, name) for name in NAMES},
            "titles": _titles(found),
            "maps": [_map(each) for each in found.maps],
            "faults": found.faults,
            "lost": found.missing_evidence,
            "seconds": round(found.seconds, 3),
        }
    )
    sure = probability(document)
    document["trial"] = record.similar(found.status.value, found.effects, strong, sure)
    return document


def location_document(places: Sequence[Place], maps: Sequence[GapMap], faults: Sequence[str]) -> dict[str, Any]:
    """Places, maps and faults alone, in the form that they have in a diagnosis."""
    document: dict[str, Any] = plain(
        {"where": [_place(each) for each in places], "maps": [_map(each) for each in maps], "faults": list(faults)}
    )
    return document


def probability(document: Mapping[str, Any]) -> float:
    """Of a document's verdict: that of the entry in the ranking with the same effects, or of "unknown"."""
    verdict = document["verdict"]
    wanted = [UNKNOWN] if verdict["status"] == Status.UNKNOWN.value else verdict["effects"]
    return float(sum(each["probability"] for each in document["ranking"] if sorted(each["effects"]) == sorted(wanted)))


def _gap(found: Gap) -> dict[str, float]:
    return {"percent": found.percent, "sigma": found.sigma}


def _rig(found: Diagnosis, rig: str) -> dict[str, float | None]:
    gaps: dict[str, Gap | None] = {"before": getattr(found.before, rig), "after": getattr(found.after, rig)}
    percents = {name: None if gap is None else gap.percent for name, gap in gaps.items()}
    return percents | {f"{name}_sigma": None if gap is None else gap.sigma for name, gap in gaps.items()}


def _place(place: Place) -> dict[str, Any]:
    return {
        "rig": place.rig,
        **place.where,
        "band_hz": place.band,
        "part": place.part,
        "share": place.share,
        "significance": place.significance,
    }


def _remainder(found: Remainder) -> dict[str, Any]:
    document = {
        "percent": found.percent,
        "sigma": found.sigma,
        "significant": found.significant,
        "where": [_place(each) for each in found.where],
    }
    return document if found.acts_at is None else document | {"acts_at": asdict(found.acts_at)}


def _effect(found: EffectFound) -> dict[str, Any]:
    return {
        "id": found.id,
        "probability": found.probability,
        "mechanism": found.mechanism,
        "law": found.law,
        "law_is_known": found.law_is_known,
        "parameters": {name: asdict(estimate) for name, estimate in found.parameters.items()},
        "out_of_range": found.out_of_range,
    }


def _ranked(ranked: Ranked) -> dict[str, Any]:
    known = ranked.held_out
    return {
        "effects": ranked.effects,
        "laws": dict(zip(ranked.effects, ranked.laws, strict=False)),
        "probability": ranked.probability,
        "held_out_gap_percent": None if known is None else known.overall.percent,
        "held_out_ci90_percent": None if known is None else known.ci90_percent,
        "explained": ranked.explained,
        "parameters": {
            effect: {name: asdict(estimate) for name, estimate in estimates.items()}
            for effect, estimates in ranked.parameters.items()
        },
    }


def _map(drawn: GapMap) -> dict[str, Any]:
    return {
        "title": drawn.title,
        "rig": drawn.rig,
        "rows": drawn.rows,
        "edges_hz": drawn.edges,
        "energy": drawn.energy,
        "significance": drawn.significance,
        "in_phase": drawn.in_phase,
    }


def _titles(found: Diagnosis) -> dict[str, str]:
    named = {effect for ranked in found.ranking for effect in ranked.effects}
    named |= {effect for group in found.confounded for effect in group} | set(found.effects)
    named |= {each.id for each in found.included}
    return {effect: title_of(effect) for effect in sorted(named - {UNKNOWN})}
