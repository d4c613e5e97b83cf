"""One answer beside its truth, once the seal is open."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from analysis.frequency_response import Complex
from jointlab.diagnosis.document import probability
from jointlab.diagnosis.track_record import strength
from jointlab.trials.detectability import Detectability
from simlab.case.bundle import percent
from simlab.case.campaign import ASKED_FOR
from simlab.case.draw import Case
from simlab.case.simulate import simulate

TOLD_APART = 5.0
"""Standard deviations that must remain with a wrong effect in the model for the data to speak against it."""
FALLBACK = "failed"
"""Status of an answer that is an error."""


@dataclass(frozen=True)
class Coverage:
    """Whether the 90 % interval of one parameter holds its truth."""

    effect: str
    parameter: str
    truth: float
    value: float
    inside: bool


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """How good an answer was; one that is an error has the defaults.

    Attributes:
        number, kind: of the case.
        effects: of the case; for a novel case its name, which no catalogue has.
        size: largest fraction of a plausible range.
        d: smallest d of the case's effects; 0 without effects.
        status, named, probability: of the verdict.
        strength: of the gap.
        right: whether the verdict names the effects that are there, or says that there is none or none that is known.
        inseparable: right, or named effects that these data cannot tell from it.
        listed_twin: whether the answer itself listed the truth among its twins.
        floor_percent: how far an honest new measurement would be off.
        reported_percent: held-out gap after, as reported.
        unseen_percent: true gap of the prediction on rows never shown, floor included; None without prediction.
        unseen_before_percent: the same of the paper's model.
        before_percent: held-out gap before, as reported.
        coverage: of parameters, where the names agree.
        without_truth: status and names with the true effect missing from the catalogue; None where it was not tried.
        honest: whether that answer was unknown, or cannot be told from the truth by these data.
        seconds: of the diagnosis.
        error: of a diagnosis that failed.
    """

    number: int
    kind: str
    effects: tuple[str, ...]
    size: float
    d: float
    status: str = FALLBACK
    named: tuple[str, ...] = ()
    probability: float = 0.0
    strength: str = ""
    right: bool = False
    inseparable: bool = False
    listed_twin: bool = False
    floor_percent: float
    reported_percent: float | None = None
    unseen_percent: float | None = None
    before_percent: float | None = None
    unseen_before_percent: float | None = None
    seconds: float
    coverage: tuple[Coverage, ...] = ()
    without_truth: tuple[str, ...] | None = None
    honest: bool | None = None
    error: str = ""


JUDGEMENT = TypeAdapter(Judgement)


def judged(
    number: int,
    truth: Mapping[str, Any],
    answer: Mapping[str, Any],
    standing: Detectability,
    without_truth: Mapping[str, Any] | None = None,
) -> Judgement:
    """Set an answer beside its truth.

    Args:
        number: of the case.
        truth: from the opened seal.
        answer: a diagnosis document, with what was predicted in ``predicted``, or an ``error``.
        standing: of the same case.
        without_truth: the answer with the true effect missing from the catalogue.
    """
    there = tuple(truth["effects"] or truth["novel"])
    each = {effect: standing.of(effect) for effect in there}
    d = min(each.values(), default=0.0)
    common: dict[str, Any] = {
        "number": number,
        "kind": truth["kind"],
        "effects": there,
        "size": max(truth["size"].values(), default=0.0),
        "d": d,
        "floor_percent": truth["floor_percent"],
        "seconds": answer["seconds"],
    }
    if "error" in answer:
        return Judgement(**common, error=answer["error"])
    verdict, gap = answer["verdict"], answer["gap"]
    named = tuple(verdict["effects"])
    right = _is_right(truth, verdict["status"], named)
    unseen = _unseen(standing.case, answer.get("predicted"), truth["floor_percent"])
    twins = [set(group) for group in verdict["twins"]]
    others = None if without_truth is None or "error" in without_truth else without_truth["verdict"]
    return Judgement(
        **common,
        status=verdict["status"],
        named=named,
        probability=probability(answer),
        strength=strength(answer),
        right=right,
        inseparable=right or _cannot_be_told(truth, verdict["status"], named, standing),
        listed_twin=bool(named) and set(there) != set(named) and any({*there, *named} <= group for group in twins),
        before_percent=gap["before"]["percent"],
        reported_percent=gap["after"]["percent"],
        unseen_before_percent=unseen.get("before"),
        unseen_percent=unseen.get("after"),
        coverage=_coverage(truth, answer),
        without_truth=None if others is None else (others["status"], *others["effects"]),
        honest=None if others is None else _is_honest(others, standing),
    )


def _is_right(truth: Mapping[str, Any], status: str, named: Sequence[str]) -> bool:
    if truth["novel"]:
        return status == "unknown" and not named
    if not truth["effects"]:
        return status == "none"
    return set(named) == set(truth["effects"])


def _cannot_be_told(truth: Mapping[str, Any], status: str, named: Sequence[str], standing: Detectability) -> bool:
    """Whether a wrong answer leaves nothing that the data could speak against it with."""
    if truth["novel"] and named:
        return False
    if not truth["effects"] and not truth["novel"]:
        return False
    if status == "unknown":
        return False
    return standing.beside(named) < TOLD_APART


def _is_honest(verdict: Mapping[str, Any], standing: Detectability) -> bool:
    if verdict["status"] in ("unknown", "partial"):
        return True
    return standing.beside(verdict["effects"]) < TOLD_APART


def _unseen(case: Case, predicted: Mapping[str, Any] | None, floor: float) -> dict[str, float]:
    """Gap of predictions on the rows asked for as an honest new measurement would show it: truth and floor together."""
    if predicted is None:
        return {}
    simulated = simulate(case)
    inputs = [str(name) for name in predicted["input"]]
    rows = [inputs.index(row.name) for row in ASKED_FOR if row.name in inputs]
    if len(rows) < len(ASKED_FOR):
        return {}
    frequency = np.asarray(predicted["frequency"])
    lines = np.searchsorted(simulated.frequency, frequency - 1e-6)
    places = [simulated.rows.index(row) for row in ASKED_FOR]
    true: Complex = simulated.accelerance[0][places][:, lines]
    return {
        moment: float(np.hypot(percent(np.asarray(predicted[moment])[rows], true), floor))
        for moment in ("before", "after")
    }


def _coverage(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> tuple[Coverage, ...]:
    named = answer["verdict"]["effects"]
    entry = next((each for each in answer["ranking"] if sorted(each["effects"]) == sorted(named)), None)
    if entry is None:
        return ()
    found = []
    for effect in set(named) & set(truth["effects"]):
        true = truth["parameters"][effect]
        for name, estimate in entry["parameters"].get(effect, {}).items():
            value, (low, high) = estimate["value"], estimate["ci90"]
            if isinstance(true.get(name), int | float) and None not in (value, low, high):
                found.append(Coverage(effect, name, float(true[name]), value, low <= true[name] <= high))
    return tuple(found)
