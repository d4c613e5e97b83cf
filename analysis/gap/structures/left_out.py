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
from analysis.gap.structures.smooth_error import error_shapes

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
    """Root mean square of the relative gaps 100 sqrt(sum |y - f|^2 / sum |y|^2) of observables, by numbers of values.

    Values that do not count are left out. It is 0 without any value, and inf where a prediction is missing.
    """
    total, count = 0.0, 0
    for own in _by_observable(found).values():
        size = sum(float(np.sum(np.abs(_kept(each, each.curve.values)) ** 2)) for each in own)
        data = sum(each.curve.data for each in own)
        total += data * _off(own) / size if size else 0.0
        count += data
    return 100 * float(np.sqrt(total / count)) if count else 0.0


def squares_of(found: Sequence[LeftOutPrediction]) -> float:
    """Sum of |y - f|^2, each over the mean square of the deviations of its observable, so that units do not matter.

    It is about the number of real values where noise alone is left, and inf where a prediction is missing.
    """
    return sum(_off(own) / _mean_square(own) for own in _by_observable(found).values())


def is_worse(after: Sequence[LeftOutPrediction], before: Sequence[LeftOutPrediction], smooth_error: float) -> bool:
    """Whether one prediction of the same values is worse than another one by more than chance.

    Chance is noise and the smooth errors of each curve, of the scale `smooth_error`.
    """
    change = squares_of(after) - squares_of(before)
    if not np.isfinite(change):
        return not np.isfinite(squares_of(after))
    variance = 0.0  # of the change, where the mean of both predictions is right
    pairs = {id(each.curve): other for each, other in zip(after, before, strict=True)}
    for own in _by_observable(after).values():
        apart = [(each.curve, each.values - pairs[id(each.curve)].values) for each in own]
        parts = sum(_variance_along(curve, values, smooth_error) for curve, values in apart)
        variance += 4 * parts / _mean_square(own) ** 2
    return bool(change > CHANCE_LIMIT * np.sqrt(variance))


def _variance_along(curve: Curve, apart: Complex, smooth_error: float) -> float:
    """Variance of the error of a curve along `apart` (n,), by noise and smooth errors."""
    kept = curve.counted
    noise = float(np.sum((curve.deviation[kept] * np.abs(apart[kept])) ** 2))
    return noise + smooth_error**2 * float(np.sum(np.abs(error_shapes(curve)[:, kept].conj() @ apart[kept]) ** 2))


def _by_observable(found: Sequence[LeftOutPrediction]) -> dict[str, list[LeftOutPrediction]]:
    """Predictions by observable, of which some value counts: each may have another unit."""
    own = dict[str, list[LeftOutPrediction]]()
    for each in found:
        if each.curve.data:
            own.setdefault(each.curve.observable, []).append(each)
    return own


def _off(found: Sequence[LeftOutPrediction]) -> float:
    """Sum of |y - f|^2; inf where a prediction is missing."""
    off = sum(float(np.sum(np.abs(_kept(each, each.curve.values - each.values)) ** 2)) for each in found)
    return float("inf") if np.isnan(off) else off


def _mean_square(found: Sequence[LeftOutPrediction]) -> float:
    """Mean square of the deviations of values of one observable."""
    return float(np.mean(np.concatenate([_kept(each, each.curve.deviation) for each in found]) ** 2))


def _kept(found: LeftOutPrediction, values: Complex | Real) -> Complex:
    return np.asarray(values[found.curve.counted])


def by_part(found: Sequence[LeftOutPrediction]) -> dict[str, float]:
    """`percent_of` for each part."""
    return {
        part: percent_of([each for each in found if each.curve.part == part])
        for part in parts_of([each.curve for each in found])
    }


def share_left(before: Sequence[LeftOutPrediction], after: Sequence[LeftOutPrediction], smooth_error: float) -> float:
    """Share of the gap on left-out data that remains beyond noise and smooth errors; inf without a prediction.

    It is 0 where noise alone may explain what remains.
    """
    count = max(1, sum(each.curve.data for each in before))
    noise = squares_of([_noise(each, smooth_error) for each in before])
    gap, left = squares_of(before) - noise, squares_of(after)
    if not (np.isfinite(gap) and np.isfinite(left)):
        return float("inf")
    if left <= noise * (1 + CHANCE_LIMIT * np.sqrt(2 / count)):
        return 0.0
    return float(np.sqrt((left - noise) / gap)) if gap > 0 else float("inf")


def _noise(found: LeftOutPrediction, smooth_error: float) -> LeftOutPrediction:
    """As if a prediction were off by the standard deviation of each value."""
    curve = found.curve
    size = np.hypot(np.where(curve.counted, curve.deviation, 0.0), smooth_error * np.abs(curve.values))
    return LeftOutPrediction(
        curve, np.asarray(curve.values - size * (np.sqrt(2) if curve.is_complex else 1.0), complex)
    )
