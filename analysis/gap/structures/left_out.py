"""Predictions of data that were left out of a fit, and the gap that they leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.evidence.residual_structure import CHANCE_LIMIT
from analysis.gap.structures.curve import Curve, parts_of
from analysis.gap.structures.likelihood import CurveFit, fit_curves
from analysis.gap.structures.search import CLOSE, CurveModel

FOLDS = 8
"""Number of folds into which the values of a single part are divided."""


@dataclass(frozen=True, eq=False)
class LeftOutPrediction:
    """A prediction of data that the fit did not use.

    Attributes:
        curve: the measured curve, of which only the values that were left out count.
        values: (n,) predicted.
    """

    curve: Curve
    values: Complex


def predicted(found: CurveFit, curve: Curve) -> LeftOutPrediction:
    """A part that a fit has not seen, with local parameters at their centres; nan if there is no prediction."""
    try:
        return LeftOutPrediction(curve, found.likelihood.predict(found.scores, curve))
    except AnalysisError:  # such as no steady state: then the explanation fails, not the diagnosis
        return _not_predicted(curve)


def _not_predicted(curve: Curve) -> LeftOutPrediction:
    return LeftOutPrediction(curve, np.full(curve.values.size, np.nan, dtype=complex))


def left_out(model: CurveModel) -> list[LeftOutPrediction]:
    """Every part predicted by a fit to all others; of a single part, every eighth of its values."""
    found, curves = list[LeftOutPrediction](), model.fit.likelihood.curves
    for rest, left in _folds(curves):
        likelihood = replace(model.fit.likelihood, curves=rest)
        start = np.concatenate(
            [model.fit.scores[: len(likelihood.parameters)], *(model.fit.local_of(part) for part in likelihood.parts)]
        )
        try:
            again = fit_curves(likelihood, start, CLOSE[-1:])
        except AnalysisError:  # there is no prediction beside the start
            found += [_not_predicted(each) for each in left]
        else:
            found += [predicted(again, each) for each in left]
    return found


def _folds(curves: tuple[Curve, ...]) -> list[tuple[tuple[Curve, ...], list[Curve]]]:
    parts = parts_of(curves)
    if len(parts) > 1:
        return [
            (tuple(each for each in curves if each.part != part), [each for each in curves if each.part == part])
            for part in parts
        ]
    return [
        (tuple(_only(each, turn, False) for each in curves), [_only(each, turn, True) for each in curves])
        for turn in range(FOLDS)
    ]


def _only(curve: Curve, turn: int, kept: bool) -> Curve:
    """A curve of which every eighth value alone counts, or all but these."""
    own = (np.arange(curve.values.size) % FOLDS == turn) == kept
    return replace(curve, deviation=np.where(own, curve.deviation, np.inf))


def percent_of(found: Sequence[LeftOutPrediction]) -> float:
    """100 sqrt(sum |y - f|^2 / sum |y|^2) over values that count; 0 without any, inf where a prediction is missing."""
    off = sum(float(np.sum(np.abs(_kept(each, each.curve.values - each.values)) ** 2)) for each in found)
    size = sum(float(np.sum(np.abs(_kept(each, each.curve.values)) ** 2)) for each in found)
    if np.isnan(off):
        return float("inf")
    return 100 * float(np.sqrt(off / size)) if size else 0.0


def _kept(found: LeftOutPrediction, values: Complex | Real) -> Complex:
    return np.asarray(values[found.curve.counted])


def by_part(found: Sequence[LeftOutPrediction]) -> dict[str, float]:
    """`percent_of` for each part."""
    return {
        part: percent_of([each for each in found if each.curve.part == part])
        for part in parts_of([each.curve for each in found])
    }


def share_left(before: Sequence[LeftOutPrediction], after: Sequence[LeftOutPrediction]) -> float:
    """Share of the gap on left-out data that remains beyond noise; inf without a prediction.

    It is 0 where noise alone may explain what remains.
    """
    noise = percent_of([_noise(each) for each in before]) ** 2
    count = max(1, sum(each.curve.data for each in before))
    may_be = noise * (1 + CHANCE_LIMIT * np.sqrt(2 / count))
    gap, left = percent_of(before) ** 2 - noise, percent_of(after) ** 2
    if not (np.isfinite(gap) and np.isfinite(left)):
        return float("inf")
    if left <= may_be:
        return 0.0
    return float(np.sqrt((left - noise) / gap)) if gap > 0 else float("inf")


def _noise(found: LeftOutPrediction) -> LeftOutPrediction:
    """As if a prediction were off by the standard deviation of each value."""
    size = np.where(found.curve.counted, found.curve.deviation, 0.0) * (np.sqrt(2) if found.curve.is_complex else 1.0)
    return LeftOutPrediction(found.curve, np.asarray(found.curve.values - size, dtype=complex))
