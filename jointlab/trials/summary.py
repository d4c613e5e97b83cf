"""The figures of a trial: counts and shares over all marks, as a document and as Markdown."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from analysis.frequency_response import Real
from jointlab.diagnosis.track_record import FORMAT, TrialVerdict
from jointlab.identification.document import plain
from jointlab.trials.claims import MECHANISM_OF
from jointlab.trials.marks import RECORD_FAULTS, SURE, Mark, accepted

BINS = 10
"""Number of bins of probability, for calibration."""
LEAST_CLAIM = 0.02
"""Inclusion probabilities below it are left out of calibration, unless the effect is there and can be seen."""
NEAR_FLOOR = 1.2
NEAR_REMAINDER = 0.2
NOTHING, OUTSIDE, SEVERAL = "none", "in no catalogue", "several"
TARGETS = {
    "single_exact": "at least 90 %",
    "single_mechanism": "at least 97 %",
    "false_alarm": "at most 2 %",
    "pair_both": "at least 80 %",
    "mixture_recall": "at least 75 %",
    "mixture_spurious": "at most 5 %",
    "outside_accepted": "at most 5 %",
    "surely_wrong": "at most 2 %",
    "inclusion_calibration": "at most 0.05",
    "coverage": "85 to 95 %",
    "near_floor": "at least 90 %",
    "unseen_near_floor": "at least 90 %",
    "remainder_near": "all",
}


def summary(marks: Sequence[Mark]) -> dict[str, Any]:
    """All figures, ready for JSON; a share is null where no case counts."""
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
            "format": FORMAT,
            "cases": len(marks),
            "versions": sorted({each.version for each in marks if each.version}),
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
            "by_effect": {
                effect: _share([each for each in strong if each.truth.effects == (effect,)], lambda each: each.right)
                for effect in sorted({each.truth.effects[0] for each in strong})
            },
            "confusion": _confusion([*strong, *nothing, *outside]),
            "wrong": [_wrong(each) for each in marks if not (each.right or each.error)],
            "verdicts": [asdict(_verdict(each)) for each in marks if not each.error],
        }
    )
    return found


def _verdict(mark: Mark) -> TrialVerdict:
    return TrialVerdict(
        mark.status,
        mark.named,
        mark.strength,
        round(mark.probability, 4),
        mark.inseparable,
        claimed=len(mark.found) + len(mark.spurious),
        there=len(mark.found),
    )


def calibration(claims: Sequence[tuple[float, bool]]) -> dict[str, Any]:
    """Mean claimed probability and share of true claims, by bins, and their mean distance (ECE).

    `by_chance` is the distance to expect if each claim held with just the probability that was claimed: few claims
    have a large one.
    """
    claimed = np.array([each[0] for each in claims])
    holds = np.array([each[1] for each in claims], dtype=float)
    place = np.minimum((claimed * BINS).astype(int), BINS - 1)
    bins = [
        {"claimed": float(claimed[own].mean()), "right": float(holds[own].mean()), "cases": int(np.count_nonzero(own))}
        for own in (place == number for number in range(BINS))
        if np.any(own)
    ]
    count = max(len(claimed), 1)
    error = sum(each["cases"] * abs(each["claimed"] - each["right"]) for each in bins) / count
    by_chance = sum(_expected_distance(claimed[place == number]) for number in range(BINS)) / count
    chosen = {"error": error, "by_chance": by_chance} if bins else {"error": None, "by_chance": None}
    return {**chosen, "of": len(claimed), "bins": bins}


def _expected_distance(claimed: Real) -> float:
    """Expected |number of true claims - sum of `claimed`|, if the probabilities `claimed` (n,) are right."""
    chances = np.ones(1)
    for probability in claimed:
        chances = np.convolve(chances, (1 - probability, probability))
    return float(chances @ np.abs(np.arange(len(chances)) - claimed.sum()))


def markdown(found: dict[str, Any]) -> str:
    """The figures beside their targets, then effects, confusion and what is wrong, as tables."""
    figures = [
        (name.replace("_", " "), _text(value), TARGETS.get(name, ""))
        for name, value in found.items()
        if isinstance(value, dict) and ("share" in value or "error" in value)
    ]
    seconds = [f"{name.replace('_', ' ')} {value:.1f}" for name, value in found["seconds"].items() if value is not None]
    counts = found["confusion"]
    return "\n\n".join(
        [
            f"{found['cases']} cases, {len(found['failed'])} without an answer. Seconds: {', '.join(seconds)}. "
            f"Answered by {', '.join(found['versions']) or 'an unknown version'}.",
            _table(("figure", "found", "target"), figures),
            _table(("strong single", "named"), [(name, _text(each)) for name, each in found["by_effect"].items()]),
            _table(
                ("true mechanism", *counts["named"]),
                [
                    (there, *(str(each or "") for each in row))
                    for there, row in zip(counts["there"], counts["counts"], strict=True)
                ],
            ),
            _table(("seed", "true effects", "d", "claims"), [tuple(each.values()) for each in found["wrong"]]),
            *(f"failed: {each}" for each in found["failed"]),
        ]
    )


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ("---",) * len(head), *rows))


def _text(value: dict[str, Any]) -> str:
    if "error" in value:
        return (
            "–"
            if value["error"] is None
            else f"error {value['error']:.3f} of {value['of']}, {value['by_chance']:.3f} by chance"
        )
    return "–" if value["share"] is None else f"{100 * value['share']:.1f} % ({value['count']} of {value['of']})"


def _confusion(marks: Sequence[Mark]) -> dict[str, Any]:
    """Counts of claimed mechanisms by true mechanism, of cases with no effect or with one that can be seen."""
    pairs = [(_there(each), _claimed(each)) for each in marks]
    order = [*dict.fromkeys(MECHANISM_OF.values()), NOTHING, OUTSIDE, "unknown", "partial", SEVERAL, "failed"]
    there, named = ([name for name in order if name in {pair[side] for pair in pairs}] for side in (0, 1))
    return {"there": there, "named": named, "counts": [[pairs.count((row, name)) for name in named] for row in there]}


def _there(mark: Mark) -> str:
    if mark.truth.novel:
        return OUTSIDE
    return MECHANISM_OF[mark.truth.effects[0]] if mark.truth.effects else NOTHING


def _claimed(mark: Mark) -> str:
    return mark.status if not mark.mechanisms else mark.mechanisms[0] if len(mark.mechanisms) == 1 else SEVERAL


def _wrong(mark: Mark) -> dict[str, str]:
    odds = ", ".join(f"{effect} {sure:.2f}" for effect, sure in sorted(mark.included.items()) if sure >= LEAST_CLAIM)
    said = f"{mark.status}: {' + '.join(mark.named or mark.mechanisms) or '-'} ({odds})"
    there = " + ".join((*mark.truth.effects, *mark.truth.novel)) or NOTHING
    return {"case": mark.truth.case, "there": there, "d": f"{mark.truth.d:.0f}", "said": said}


def _share(of: Sequence[Any], holds: Callable[[Any], bool]) -> dict[str, Any]:
    count = sum(holds(each) for each in of)
    return {"count": count, "of": len(of), "share": count / len(of) if of else None}


def _recall(marks: Sequence[Mark], wanted: Callable[[Mark], Iterable[str]]) -> dict[str, Any]:
    """Share of all effects of these cases that are found."""
    every = [effect in mark.found for mark in marks for effect in wanted(mark)]
    return _share(every, bool)


def _inclusions(marks: Sequence[Mark]) -> list[tuple[float, bool]]:
    """Each probability of inclusion, and whether it is true; effects inseparable from the truth are left out."""
    return [
        (mark.included.get(effect, 0.0), effect in mark.truth.effects)
        for mark in marks
        if not mark.error
        for effect in sorted({*mark.truth.visible, *(e for e, sure in mark.included.items() if sure >= LEAST_CLAIM)})
        if effect not in mark.truth.inseparable and (effect in mark.truth.visible or effect not in mark.truth.effects)
    ]
