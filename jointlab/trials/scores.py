"""The scores of a trial."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from jointlab.diagnosis.track_record import FORMAT, Verdict
from jointlab.identification.document import plain
from jointlab.trials.judgement import FALLBACK, Judgement

DETECTABLE = 5.0
"""The d from which an effect is to be found."""
SIZES = ((0.0, 0.15), (0.15, 0.4), (0.4, 1.0))
DISTANCES = {
    "below 5": (0.0, 5.0),
    "5 to 15": (5.0, 15.0),
    "15 to 100": (15.0, 100.0),
    "above 100": (100.0, float("inf")),
}
"""Ranges of d."""
BINS = 10
"""Of probability, for calibration."""
NONE, NOVEL, UNKNOWN, TWO = "none", "in no catalogue", "unknown", "two effects"
NEAR_FLOOR = 1.2
NEAR_TRUE = 0.1


def scores(judged: Sequence[Judgement]) -> dict[str, Any]:
    """Every figure of a trial, ready for JSON; a share is null where there was nothing to share."""
    singles, pairs = _of_kind(judged, "single"), _of_kind(judged, "pair")
    clean, novel = _of_kind(judged, "none"), _of_kind(judged, "novel")
    seen, seen_pairs, seen_novel = (_detectable(each) for each in (singles, pairs, novel))
    known = [*singles, *pairs]
    seconds = [each.seconds for each in judged]
    found: dict[str, Any] = plain(
        {
            "format": FORMAT,
            "cases": len(judged),
            "failed": [f"{each.number}: {each.error}" for each in judged if each.error],
            "top_1": {
                "detectable": _share(seen, lambda each: each.right),
                "detectable_or_inseparable": _share(seen, lambda each: each.inseparable),
                "all": _share(singles, lambda each: each.right),
                "by_size": {f"{a:g} to {b:g}": _right([e for e in singles if a < e.size <= b]) for a, b in SIZES},
                "by_d": {
                    name: _right([e for e in singles if low <= e.d < high]) for name, (low, high) in DISTANCES.items()
                },
            },
            "false_alarms": _share(clean, lambda each: each.status != "none"),
            "unknown_accepted_as_known": _share(seen_novel, lambda each: bool(each.named)),
            "unknown_rejected": _share(seen_novel, lambda each: each.right),
            "pairs": {
                "both": _share(seen_pairs, lambda each: each.right),
                "at_least_one": _share(seen_pairs, lambda each: bool(set(each.named) & set(each.effects))),
                "spurious_second": _share(singles, lambda each: len(each.named) > 1),
            },
            "calibration": calibration(judged),
            "held_out": {
                "near_floor": _share(
                    [each for each in known if each.reported_percent is not None],
                    lambda each: (each.reported_percent or 0.0) <= NEAR_FLOOR * each.floor_percent,
                ),
                "unseen_near_floor": _share(
                    [each for each in known if each.unseen_percent is not None],
                    lambda each: (each.unseen_percent or 0.0) <= NEAR_FLOOR * each.floor_percent,
                ),
                "reported_over_true": _quartiles(_ratios(judged)),
                "within_a_tenth": _share(_ratios(judged), lambda ratio: abs(ratio - 1) <= NEAR_TRUE),
                "before_percent": _quartiles([e.before_percent for e in known if e.before_percent is not None]),
                "after_percent": _quartiles([e.reported_percent for e in known if e.reported_percent is not None]),
                "floor_percent": _quartiles([each.floor_percent for each in known]),
            },
            "coverage": _coverage(judged),
            "without_truth": _share([e for e in judged if e.honest is not None], lambda each: bool(each.honest)),
            "seconds": {"median": np.median(seconds) if seconds else None, "worst": max(seconds, default=None)},
            "by_effect": _by_effect(singles),
            "confusion": _confusion([*clean, *seen, *seen_novel]),
            "confusions": _confusions(judged),
            "verdicts": [_verdict(each).__dict__ for each in judged if not each.error],
        }
    )
    return found


def calibration(judged: Sequence[Judgement]) -> dict[str, Any]:
    """Claimed probability against the share that was right, by bins, and the mean distance of both (ECE)."""
    claims = np.array([each.probability for each in judged])
    right = np.array([each.inseparable for each in judged], dtype=float)
    place = np.minimum((claims * BINS).astype(int), BINS - 1)
    bins = [
        {
            "claimed": float(claims[inside].mean()),
            "right": float(right[inside].mean()),
            "cases": int(np.count_nonzero(inside)),
        }
        for inside in (place == number for number in range(BINS))
        if np.any(inside)
    ]
    error = sum(each["cases"] * abs(each["claimed"] - each["right"]) for each in bins) / max(len(claims), 1)
    return {"error": error if bins else None, "bins": bins}


def _of_kind(judged: Iterable[Judgement], kind: str) -> list[Judgement]:
    return [each for each in judged if each.kind == kind]


def _detectable(judged: Iterable[Judgement]) -> list[Judgement]:
    return [each for each in judged if each.d >= DETECTABLE]


def _share(of: Sequence[Any], holds: Callable[[Any], bool]) -> dict[str, Any]:
    count = sum(holds(each) for each in of)
    return {"count": count, "of": len(of), "share": count / len(of) if of else None}


def _right(of: Sequence[Judgement]) -> dict[str, Any]:
    return _share(of, lambda each: each.right)


def _ratios(judged: Iterable[Judgement]) -> list[float]:
    """Reported gap over the true one on rows that were never shown."""
    return [e.reported_percent / e.unseen_percent for e in judged if e.reported_percent and e.unseen_percent]


def _quartiles(values: Sequence[float]) -> list[float] | None:
    return [float(value) for value in np.percentile(values, (25, 50, 75))] if values else None


def _coverage(judged: Iterable[Judgement]) -> dict[str, Any]:
    every = [each for judgement in judged for each in judgement.coverage]
    names = sorted({f"{each.effect}.{each.parameter}" for each in every})
    return _share(every, lambda each: each.inside) | {
        "by_parameter": {
            name: _share([e for e in every if f"{e.effect}.{e.parameter}" == name], lambda each: each.inside)
            for name in names
        }
    }


def _by_effect(singles: Sequence[Judgement]) -> dict[str, Any]:
    return {
        effect: {
            "cases": len(own),
            "right": sum(each.right for each in own),
            "inseparable": sum(each.inseparable for each in own),
            "smallest_d": min(each.d for each in own),
        }
        for effect in sorted({each.effects[0] for each in singles})
        for own in ([each for each in singles if each.effects == (effect,)],)
    }


def _confusion(judged: Sequence[Judgement]) -> dict[str, Any]:
    """How often what was named for what was there, of cases that could be told and have one effect at most."""
    pairs = [(_there(each), _named(each)) for each in judged]
    effects = sorted({name for pair in pairs for name in pair} - {NONE, NOVEL, UNKNOWN, TWO, FALLBACK})
    there = [name for name in (*effects, NONE, NOVEL) if any(name == pair[0] for pair in pairs)]
    named = [*effects, NONE, UNKNOWN, *(name for name in (TWO, FALLBACK) if any(name == pair[1] for pair in pairs))]
    counts = [[pairs.count((row, column)) for column in named] for row in there]
    return {"there": there, "named": named, "counts": counts}


def _there(each: Judgement) -> str:
    return {"none": NONE, "novel": NOVEL}.get(each.kind) or each.effects[0]


def _named(each: Judgement) -> str:
    return each.status if not each.named else each.named[0] if len(each.named) == 1 else TWO


def _confusions(judged: Iterable[Judgement]) -> list[dict[str, Any]]:
    """Every wrong answer."""
    return [
        {
            "case": each.number,
            "there": list(each.effects) or ["none"],
            "size": each.size,
            "d": each.d,
            "answer": [each.status, *each.named],
            "probability": each.probability,
            "inseparable": each.inseparable,
        }
        for each in judged
        if not each.right
    ]


def _verdict(each: Judgement) -> Verdict:
    return Verdict(each.status, each.named, each.strength, round(each.probability, 4), each.inseparable)
