"""The mark of a sealed case after its seal was opened, from its data and its predictions."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from analysis.frequency_response import Complex
from jointlab.trials.detectability import Detectability
from jointlab.trials.marks import VISIBLE, Mark, Truth, marked
from simlab.case.bundle import percent
from simlab.case.campaign import ASKED_FOR, ROWS
from simlab.case.draw import Case
from simlab.case.simulate import simulate


def judged(truth: Mapping[str, Any], answer: Mapping[str, Any], detectability: Detectability) -> Mark:
    """Compare an answer with its truth.

    Args:
        truth: from the opened seal.
        answer: a diagnosis document, with ``predicted`` and ``fitted`` as a worker answers, or an ``error``.
        detectability: of the effects of the same case.
    """
    there = _truth(truth, detectability)
    left = None if "error" in answer else left_percent(detectability.case, answer.get("predicted"))
    unseen = None if left is None else float(np.hypot(left, there.floor_percent))
    remainder = None if "error" in answer else remainder_percent(detectability.case, answer.get("fitted"))
    mark = marked(replace(there, remainder_percent=remainder), answer, unseen)
    if mark.right or not mark.named or there.novel or detectability.beside(mark.named) >= VISIBLE:
        return mark
    return marked(replace(mark.truth, inseparable=mark.named), answer, unseen)


def _truth(truth: Mapping[str, Any], detectability: Detectability) -> Truth:
    d_each = {effect: detectability.of(effect) for effect in (*truth["effects"], *truth["novel"])}
    return Truth(
        case=str(truth["seed"]),
        kind=truth["kind"],
        effects=tuple(truth["effects"]),
        novel=tuple(truth["novel"]),
        size=truth["size"],
        parameters=truth["parameters"],
        d=min(d_each.values(), default=0.0),
        d_each=d_each,
        floor_percent=truth["floor_percent"],
    )


def left_percent(case: Case, predicted: Mapping[str, Any] | None) -> float | None:
    """True gap of predictions on the rows asked for, without noise; None where not all were predicted."""
    if predicted is None:
        return None
    inputs = [str(name) for name in predicted["input"]]
    if not {row.name for row in ASKED_FOR} <= set(inputs):
        return None
    rows = [inputs.index(row.name) for row in ASKED_FOR]
    simulated = simulate(case.without_error())
    lines = np.searchsorted(simulated.frequency, np.asarray(predicted["frequency"]) - 1e-6)
    true: Complex = simulated.accelerance[0][[ROWS.index(row) for row in ASKED_FOR]][:, lines]
    return percent(np.asarray(predicted["after"])[rows], true)


def remainder_percent(case: Case, fitted: Mapping[str, Any] | None) -> float | None:
    """True gap of what was fitted on the rows that were measured, as its blows fell; None where no row was fitted.

    Noise and errors of accelerances are not in it: a remainder does not count them.
    """
    if fitted is None:
        return None
    simulated = simulate(case.without_error())
    names = [row.name for row in simulated.rows]
    rows = np.array([names.index(str(name)) for name in fitted["input"]])
    lines = np.searchsorted(simulated.frequency, np.asarray(fitted["frequency"]) - 1e-6)
    return percent(np.asarray(fitted["accelerance"]), simulated.accelerance[np.asarray(fitted["set"]), rows, lines])
