"""The figures of a trial: counts and shares over all marks, as a document and as Markdown."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from jointlab.identification.document import plain
from jointlab.trials.marks import RECORD_FAULTS, SURE, Mark, accepted

BINS = 10
"""Of probability, for calibration."""
LEAST_CLAIM = 0.02
"""Inclusion probabilities below it are left out of calibration, unless the effect is there and can be seen."""
NEAR_FLOOR = 1.2
NEAR_REMAINDER = 0.2


def summary(marks: Sequence[Mark]) -> dict[str, Any]:
    """Every figure, ready for JSON; a share is null where there is nothing to share."""
    singles = [each for each in marks if each.truth.kind == "single"]
    strong = [each for each in singles if each.truth.visible]
    nothing = [each for each in marks if each.truth.kind == "none"]
    faults = [each for each in marks if each.truth.novel and set(each.truth.novel) <= RECORD_FAULTS]
    outside = [each for each in marks if each.truth.novel and each not in faults]
    several = [each for each in marks if len(each.truth.effects) > 1]
    pairs = [each for each in several if len(each.truth.effects) == 2 and len(each.truth.visible) == 2]
    mixtures = [each for each in several if len(each.truth.effects) > 2]
    explained = [each for each in marks if each.status == "explained"]
    remaining = [each for each in marks if each.remainder is not None and each.truth.remainder_percent]
    covered = [each for mark in marks for each in mark.coverage]
    seconds = [each.seconds for each in marks]
    found: dict[str, Any] = plain(
        {
            "cases": len(marks),
            "failed": [f"{each.truth.case}: {each.error}" for each in marks if each.error],
            "single_exact": _share(strong, lambda each: each.right),
            "single_inseparable": _share(strong, lambda each: each.inseparable),
            "single_mechanism": _share(strong, lambda each: each.mechanism_right),
            "false_alarm": _share(nothing, lambda each: each.status != "none"),
            "fault_found": _share(faults, lambda each: each.right),
            "pair_both": _share(pairs, lambda each: set(each.truth.effects) <= set(each.found)),
            "pair_exact": _share(pairs, lambda each: each.right),
            "mixture_recall": _recall(mixtures, lambda each: each.truth.visible),
            "mixture_recall_all": _recall(mixtures, lambda each: each.truth.effects),
            "spurious": _share([e for e in marks if e.truth.effects], lambda each: bool(each.spurious)),
            "mixture_spurious": _share(mixtures, lambda each: bool(each.spurious)),
            "outside_accepted": _share(outside, accepted),
            "outside_accepted_surely": _share(outside, lambda each: accepted(each, SURE)),
            "surely_wrong": _share(marks, lambda each: bool(each.surely_wrong)),
            "verdict_calibration": calibration([(each.probability, each.inseparable) for each in marks]),
            "inclusion_calibration": calibration(_inclusions(marks)),
            "coverage": _share(covered, lambda each: each.inside),
            "near_floor": _share(
                [each for each in explained if each.after is not None],
                lambda each: (each.after or 0.0) <= NEAR_FLOOR * each.truth.floor_percent,
            ),
            "unseen_near_floor": _share(
                [each for each in explained if each.unseen is not None],
                lambda each: (each.unseen or 0.0) <= NEAR_FLOOR * each.truth.floor_percent,
            ),
            "worsened": _share(marks, lambda each: bool(each.worsened)),
            "remainder_near": _share(
                remaining,
                lambda each: abs((each.remainder or 0.0) / each.truth.remainder_percent - 1.0) <= NEAR_REMAINDER,
            ),
            "seconds": {
                "median": float(np.median(seconds)) if seconds else None,
                "ninth_decile": float(np.percentile(seconds, 90)) if seconds else None,
                "worst": max(seconds, default=None),
            },
        }
    )
    return found


def calibration(claims: Sequence[tuple[float, bool]]) -> dict[str, Any]:
    """Claimed probability against the share that holds, by bins, and the mean distance of both (ECE)."""
    claimed = np.array([each[0] for each in claims])
    holds = np.array([each[1] for each in claims], dtype=float)
    place = np.minimum((claimed * BINS).astype(int), BINS - 1)
    bins = [
        {"claimed": float(claimed[own].mean()), "right": float(holds[own].mean()), "cases": int(np.count_nonzero(own))}
        for own in (place == number for number in range(BINS))
        if np.any(own)
    ]
    error = sum(each["cases"] * abs(each["claimed"] - each["right"]) for each in bins) / max(len(claimed), 1)
    return {"error": error if bins else None, "of": len(claimed), "bins": bins}


def markdown(found: dict[str, Any]) -> str:
    """The figures as two columns."""
    rows = [(name, _text(value)) for name, value in found.items() if name not in ("failed", "seconds")]
    seconds = ", ".join(
        f"{name.replace('_', ' ')} {value:.1f}" for name, value in found["seconds"].items() if value is not None
    )
    lines = ["| figure | found |", "| --- | --- |", *(f"| {name.replace('_', ' ')} | {text} |" for name, text in rows)]
    return "\n".join([*lines, f"| seconds | {seconds} |", *(f"\nfailed: {each}" for each in found["failed"])])


def _text(value: Any) -> str:
    if not isinstance(value, dict):
        return str(value)
    if "error" in value:
        return "–" if value["error"] is None else f"error {value['error']:.3f} of {value['of']}"
    return "–" if value["share"] is None else f"{100 * value['share']:.1f} % ({value['count']} of {value['of']})"


def _share(of: Sequence[Any], holds: Callable[[Any], bool]) -> dict[str, Any]:
    count = sum(holds(each) for each in of)
    return {"count": count, "of": len(of), "share": count / len(of) if of else None}


def _recall(marks: Sequence[Mark], wanted: Callable[[Mark], Iterable[str]]) -> dict[str, Any]:
    """Share of all effects of these cases that are found."""
    every = [effect in mark.found for mark in marks for effect in wanted(mark)]
    return _share(every, bool)


def _inclusions(marks: Sequence[Mark]) -> list[tuple[float, bool]]:
    """Each probability that an effect is there, and whether it is; what cannot be told from the truth is left out."""
    return [
        (mark.included.get(effect, 0.0), effect in mark.truth.effects)
        for mark in marks
        if not mark.error
        for effect in sorted({*mark.truth.visible, *(e for e, sure in mark.included.items() if sure >= LEAST_CLAIM)})
        if effect not in mark.truth.inseparable and (effect in mark.truth.visible or effect not in mark.truth.effects)
    ]
