"""Curves for pictures: the rows of the reference set and the tester's series, as measured, before and after."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from analysis.dof import Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.diagnosis import Predicted
from analysis.gap.evidence.residual_structure import series
from analysis.gap.measurement import Configuration, HammerSet, Indices, Measurement, TesterPoints

LINES = 600
"""Largest number of lines of a row that are kept; where there are more, extremes are kept."""
CLOSE_UP = 0.1
"""Share of the lines of a row in which every line is kept: the band where measured and before differ most."""
DIGITS = 4
CURVES = ("measured", "before", "after")
Curve = dict[str, Any]
Readings = tuple[Complex, Complex]
"""Readings of the tester, (points,) each, N/m: without the effects in the model, and with them."""


def with_rows_predicted(measurement: Measurement) -> Measurement:
    """A measurement that also asks for predictions of the rows of its reference set, after those that it already asks
    for."""
    if not measurement.sets:
        return measurement
    own = measurement.drawing.accelerometer
    return replace(measurement, predict=(*measurement.predict, *((own, point) for point in measurement.sets[0].inputs)))


def split_predictions(predicted: Predicted, asked: int) -> tuple[Predicted | None, Predicted]:
    """The first `asked` predictions, None where there are none; and the rest, for rows of the reference set."""
    parts = [
        Predicted(predicted.frequency, predicted.before[which], predicted.after[which])
        for which in (slice(asked), slice(asked, None))
    ]
    return (parts[0] if asked else None), parts[1]


def curves_of(measurement: Measurement, rows: Predicted | None, readings: Readings | None = None) -> list[Curve]:
    """Every row and every series as measured and as modelled, those with the largest gap first.

    A curve has its place in the keys of a diagnosis's ``where``, ``gap`` with per cent and sigma over all of its lines
    before and after, ``frequency_hz``, and by `CURVES` ``magnitude`` ((m/s^2)/N) and ``phase_deg`` of a row, or
    ``stiffness`` (N/m) and ``loss_factor`` of a series of the tester. ``close_up_hz`` of a row is the band in which all
    lines are kept. The model was fitted to these data, so these gaps are not the held-out ones.

    Args:
        measurement: as it was read.
        rows: predictions for the rows of its reference set at its lines; others are ignored.
        readings: predictions for the tester's points.
    """
    found = list[Curve]()
    if rows is not None and measurement.sets and rows.frequency.size == measurement.sets[0].frequency.size:
        found += _rows(measurement.drawing.accelerometer, measurement.sets[0], rows)
    if readings is not None and measurement.points is not None:
        names = [joint.name for joint in measurement.drawing.joints]
        found += _series(names, measurement.points, readings)
    return sorted(found, key=lambda curve: -curve["gap"]["before"]["sigma"])


def kept_lines(size: Real) -> Indices:
    """Indices of at most `LINES` lines that keep the extremes of (curves, lines) `size`, in order."""
    curves, lines = size.shape
    if lines <= LINES:
        return np.arange(lines)
    pieces = np.array_split(np.arange(lines), LINES // (2 * curves))
    keep = {int(piece[end]) for piece in pieces for row in size[:, piece] for end in (row.argmin(), row.argmax())}
    return np.array(sorted(keep))


def band_of_largest_gap(difference: Real) -> slice:
    """The band of `CLOSE_UP` of the lines that holds most of the square of a difference (lines,)."""
    width = max(1, round(CLOSE_UP * difference.size))
    sums = np.convolve(difference**2, np.ones(width), mode="valid")
    first = int(np.argmax(sums))
    return slice(first, first + width)


def _rows(response: Dof, measured: HammerSet, rows: Predicted) -> list[Curve]:
    found = list[Curve]()
    for point, *curves, deviation in zip(
        measured.inputs, measured.accelerance, rows.before, rows.after, measured.deviation, strict=True
    ):
        values = np.array(curves)
        if not np.any(values[0]):
            continue  # a dead row, which is among the faults
        close = band_of_largest_gap(np.abs(values[0] - values[1]))
        keep = np.union1d(kept_lines(np.abs(values)), np.arange(close.start, close.stop))
        shown, band = values[:, keep], measured.frequency[close]
        found.append(
            {"rig": "inverse", "input": str(point), "response": str(response), "level": 1}
            | _compared(values, deviation, measured.frequency[keep])
            | {"close_up_hz": _rounded(band[[0, -1]], 6)}
            | {"magnitude": _by_curve(np.abs(shown)), "phase_deg": _by_curve(np.degrees(np.angle(shown)))}
        )
    return found


def _series(names: list[str], points: TesterPoints, readings: Readings) -> list[Curve]:
    """One curve for each specimen, configuration and amplitude."""
    found = list[Curve]()
    for (specimen, configuration, _), own in series(points).items():
        amplitude = float(points.amplitude[own[0]])
        values = np.array([points.stiffness[own], *(each[own] for each in readings)])
        place = {
            "rig": "direct",
            "specimen": names[int(specimen)],
            "configuration": Configuration(int(configuration)).name.lower(),
            "amplitude_pp_mm": float(f"{2e3 * amplitude:.6g}"),
        }
        compared = _compared(values, points.deviation[own], points.frequency[own])
        parts = {"stiffness": _by_curve(values.real), "loss_factor": _by_curve(values.imag / values.real)}
        found.append(place | compared | parts)
    return found


def _compared(values: Complex, deviation: Real, frequency: Real) -> dict[str, Any]:
    """Gap and frequencies; the first of `values` is what was measured, the others the model before and after."""
    measured, *models = values
    gaps = {
        name: {
            "percent": 100 * float(np.linalg.norm(measured - model) / np.linalg.norm(measured)),
            "sigma": float(np.sqrt(np.mean(np.abs(measured - model) ** 2 / deviation**2) / 2)),
        }
        for name, model in zip(CURVES[1:], models, strict=True)
    }
    return {"gap": gaps, "frequency_hz": _rounded(frequency, 6)}


def _by_curve(values: Real) -> Mapping[str, list[float | None]]:
    return {name: _rounded(row, DIGITS) for name, row in zip(CURVES, values, strict=True)}


def _rounded(values: Real, digits: int) -> list[float | None]:
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values.tolist()]
