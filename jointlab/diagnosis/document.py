"""A diagnosis as the JSON document `jointlab-diagnosis/1`, which other programs read."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from analysis.gap.diagnosis import Diagnosis, Ranked
from analysis.gap.evidence.verdict import Status
from analysis.gap.findings.effects_found import EffectFound, Remainder
from analysis.gap.findings.law_found import LawFound
from analysis.gap.findings.location import GapMap, GapPlace
from analysis.gap.fitting.held_out import Gap, HeldOut
from analysis.gap.outside_catalogue.shape import FoundShape
from analysis.gap.simulation.scales import NAMES
from jointlab.diagnosis.catalogue import title_of
from jointlab.diagnosis.experiment_text import sentence
from jointlab.diagnosis.probability_limit import limited
from jointlab.diagnosis.track_record import TrackRecord, shipped_record, strength
from jointlab.identification.document import plain

FORMAT = "jointlab-diagnosis/1"
UNKNOWN = "unknown"


def diagnosis_document(found: Diagnosis, record: TrackRecord | None = None) -> dict[str, Any]:
    """The whole document; unknown numbers are null.

    Beyond the contract: significance and place in the tester in ``where``, sigmas by rig, ``laws`` and ``explained`` of
    each explanation, parameters out of range, mechanism and ``law_found`` of each effect, the ``experiment`` of the
    verdict by its id, ``set_up_changes`` of joints between hammer sets, the corrected ``model``, ``titles`` of effects,
    ``maps``, ``faults``, missing evidence in ``lost``, and in ``trial`` how often this catalogue was right on sealed
    cases like this one; None where it was never tried.

    Args:
        found: the diagnosis.
        record: of sealed trials; by default the one that is shipped.
    """
    record = shipped_record() if record is None else record
    gap = gap_document(found.before, found.after, found.floor_percent)
    strong = strength({"gap": gap})
    count = len(found.effects)
    found = limited(found, record.limit(strong, count), record.limit_of_effects(strong, count))
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
            "set_up_changes": [asdict(each) for each in found.set_up_changes],
            "model": asdict(found.model),
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


def location_document(places: Sequence[GapPlace], maps: Sequence[GapMap], faults: Sequence[str]) -> dict[str, Any]:
    """Places, maps and faults alone, in the form that they have in a diagnosis."""
    document: dict[str, Any] = plain(
        {"where": [_place(each) for each in places], "maps": [_map(each) for each in maps], "faults": list(faults)}
    )
    return document


def probability(document: Mapping[str, Any]) -> float:
    """Probability of a document's verdict: that of the ranking's entry with the same effects, or of "unknown"."""
    verdict = document["verdict"]
    wanted = [UNKNOWN] if verdict["status"] == Status.UNKNOWN.value else verdict["effects"]
    return float(sum(each["probability"] for each in document["ranking"] if sorted(each["effects"]) == sorted(wanted)))


def gap_document(before: HeldOut, after: HeldOut, floor_percent: float) -> dict[str, Any]:
    """The key ``gap``: gaps on held-out data, of the rig that counts and of each rig."""
    rigs = {rig: _rig(before, after, rig) for rig in ("inverse", "direct") if getattr(before, rig) is not None}
    return {
        "before": _gap(before.overall),
        "after": _gap(after.overall),
        "after_ci90_percent": after.ci90_percent,
        "floor_percent": floor_percent,
        "held_out": True,
        "by_rig": rigs,
    }


def _gap(found: Gap) -> dict[str, float]:
    return {"percent": found.percent, "sigma": found.sigma}


def _rig(before: HeldOut, after: HeldOut, rig: str) -> dict[str, float | None]:
    gaps: dict[str, Gap | None] = {"before": getattr(before, rig), "after": getattr(after, rig)}
    percents = {name: None if gap is None else gap.percent for name, gap in gaps.items()}
    return percents | {f"{name}_sigma": None if gap is None else gap.sigma for name, gap in gaps.items()}


def _place(place: GapPlace) -> dict[str, Any]:
    return {
        "rig": place.rig,
        **place.where,
        "band_hz": place.band,
        "part": place.part,
        "share": place.share,
        "significance": place.significance,
    }


def _remainder(found: Remainder) -> dict[str, Any]:
    document: dict[str, Any] = {
        "percent": found.percent,
        "sigma": found.sigma,
        "significant": found.significant,
        "where": [_place(each) for each in found.where],
    }
    if found.acts_at is not None:
        document["acts_at"] = asdict(found.acts_at)
    return document if found.curve is None else document | {"curve": _curve(found.curve)}


def _curve(found: FoundShape) -> dict[str, Any]:
    """A function with its place; the real and the imaginary part with the ends of their band."""
    document: dict[str, Any] = {name: getattr(found, name) for name in ("place", "quantity", "unit", "over", "at")}
    for name, part in (("real", np.real), ("imaginary", np.imag)):
        document |= {name: part(found.value), f"{name}_ci90": [part(found.low), part(found.high)]}
    return document | {"gap_percent": {"before": found.before, "after": found.after}, "resembles": found.resembles}


def _effect(found: EffectFound) -> dict[str, Any]:
    return {
        "id": found.id,
        "probability": found.probability,
        "mechanism": found.mechanism,
        "law": found.law,
        "law_is_known": found.law_is_known,
        "parameters": {name: asdict(estimate) for name, estimate in found.parameters.items()},
        "out_of_range": found.out_of_range,
        "law_found": None if found.law_found is None else _law(found.law_found),
    }


def _law(found: LawFound) -> dict[str, Any]:
    """A law of the joints over what it depends on, with the ends of its band, along both axes of the cylinders."""
    axes = {
        name: {
            quantity: {"value": band.value, "ci90": [band.low, band.high]}
            for quantity in ("stiffness", "loss_factor", "loss_ratio")
            for band in (getattr(axis, quantity),)
        }
        for name, axis in (("compression", found.compression), ("shear", found.shear))
    }
    return {"over": found.over, "unit": found.unit, "at": found.at, **axes, "closest_law": found.closest}


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
