"""Rows of accelerances in a wrong unit, dead, of wrong polarity or swapped: taken out or put right, and named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.gap.measurement import Measurement
from analysis.gap.rough_fit import RoughFit, rough_fit, size_of
from analysis.gap.row_units import in_right_units
from analysis.gap.swapped_rows import exchanged

REVERSED = -0.6
"""Correlation of a row with what is expected of it, below which its polarity is wrong."""
SILENT, DEAD = 1e-3, 0.02
"""Size of a dead row over that of the others of its set, before anything is expected, and over what is expected."""
MOST = 8
"""Faults that are put right, of one measurement; what has more needs a look at its cables."""


def rows_put_right(measurement: Measurement) -> tuple[Measurement, tuple[str, ...]]:
    """Without dead rows, with others put right, and a sentence for each fault; the same object where there is none.

    Raises:
        AnalysisError: every row is dead.
    """
    # a row without any signal would draw a fit of relative errors to zero
    measurement, silent = _without_dead(
        measurement, [_share(size_of(each.accelerance)) for each in measurement.sets], SILENT
    )
    rough, units = in_right_units(rough_fit(measurement))
    measurement, dead = _without_dead(
        rough.measurement, [_share(rough.size(number)) for number in range(len(rough.thin))], DEAD
    )
    if dead:
        rough = rough_fit(measurement)
    faults = [*silent, *units, *dead]
    for _ in range(MOST):
        found = _exchanged(rough) or _turned(rough)
        if found is None:
            break
        rough, fault = found
        faults.append(fault)
    return rough.measurement, tuple(faults)


def _share(size: Real) -> Real:
    """(rows,) of the size that is usual."""
    return np.asarray(size / max(float(np.median(size)), float(np.finfo(float).tiny)))


def _without_dead(measurement: Measurement, sizes: Sequence[Real], least: float) -> tuple[Measurement, list[str]]:
    """Without rows below the least size (rows,) of each set, and a sentence for each of them."""
    alive = [size > least for size in sizes]
    if all(np.all(rows) for rows in alive):
        return measurement, []
    if not any(np.any(rows) for rows in alive):
        raise AnalysisError("all rows of all hammer sets are dead; check the accelerometer and its cable")
    faults = [
        f"hammer set {number + 1}: row {dof} is dead (it has {100 * size:.2g} % of the size expected); left out"
        for number, each in enumerate(measurement.sets)
        for dof, size in zip(each.inputs, sizes[number], strict=True)
        if not size > least
    ]
    kept = [each.rows(rows) for each, rows in zip(measurement.sets, alive, strict=True) if np.any(rows)]
    return replace(measurement, sets=tuple(kept)), faults


def _turned(rough: RoughFit) -> tuple[RoughFit, str] | None:
    """With the rows turned that have the wrong polarity in the first set that has any."""
    for number, each in enumerate(rough.measurement.sets):
        wrong = rough.correlation(number) < REVERSED
        if np.any(wrong):
            turned = replace(each, accelerance=np.where(wrong[:, None], -each.accelerance, each.accelerance))
            sets = (*rough.measurement.sets[:number], turned, *rough.measurement.sets[number + 1 :])
            names = [dof for dof, is_wrong in zip(each.inputs, wrong, strict=True) if is_wrong]
            said = f"row {names[0]} has" if len(names) == 1 else f"rows {_listed(names)} have"
            again = rough_fit(replace(rough.measurement, sets=sets))
            return again, f"hammer set {number + 1}: {said} the wrong polarity; put right"
    return None


def _exchanged(rough: RoughFit) -> tuple[RoughFit, str] | None:
    """With two rows exchanged that were swapped."""
    found = exchanged(rough)
    if found is None:
        return None
    again, exchange = found
    number, rows = next(iter(exchange.places.items()))
    where = _listed([number + 1 for number in exchange.places])
    said = f"hammer set{'s' if len(exchange.places) > 1 else ''} {where}"
    names = _listed([rough.measurement.sets[number].inputs[row] for row in rows])
    return again, f"{said}: rows {names} are swapped; put right"


def _listed(names: Sequence[Dof | int]) -> str:
    *first, last = map(str, names)
    return f"{', '.join(first)} and {last}" if first else last
