"""Faults of hammer sets that an identification would take for physics: put right, and named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.gap.measurement import HammerSet
from analysis.gap.row_faults import rows_put_right
from api.errors import ApiError
from api.gap.source import gap_measurement
from api.identification.measurement import Measurement, dof
from store.blow_window import stated_window
from store.frequency_responses import FrequencyResponseSet


def put_right(measurement: Measurement) -> Measurement:
    """Its sets in the right unit, without dead rows, with rows of the right polarity and in the right order.

    Every fault is a sentence in `faults`, and so is a window that cannot be corrected for. A set that was changed has
    lost the scatter and the forces of its single blows, which are named by the wrong points; one in which nothing was
    wrong is left as it is.

    Raises:
        AnalysisError: all rows are dead.
        ApiError: all rows of one of several sets are.
    """
    before = gap_measurement(measurement)
    after, faults = rows_put_right(before)
    windows = _unknown_windows(measurement)
    if not faults:
        return replace(measurement, faults=windows) if windows else measurement
    if len(after.sets) < len(before.sets):
        raise ApiError(f"{'; '.join(faults)}; take the set without any signal out, or measure it again")
    sets, scatter, forces = [], dict(measurement.scatter), dict(measurement.forces)
    for stored, was, found in zip(measurement.sets, before.sets, after.sets, strict=True):
        sets.append(stored if _same(was, found) else _stored(stored, found))
        if sets[-1] is not stored:
            scatter.pop(stored.number, None)
            forces.pop(stored.number, None)
    return replace(measurement, sets=tuple(sets), scatter=scatter, forces=forces, faults=(*windows, *faults))


def _unknown_windows(measurement: Measurement) -> tuple[str, ...]:
    read = [(each.source, stated_window(each.window, each.block_seconds)[1]) for each in measurement.sets]
    return tuple(f"{source}: {unknown}" for source, unknown in read if unknown)


def _same(one: HammerSet, other: HammerSet) -> bool:
    return one.inputs == other.inputs and np.array_equal(one.accelerance, other.accelerance)


def _stored(stored: FrequencyResponseSet, found: HammerSet) -> FrequencyResponseSet:
    """The set as it was found to be, with all else of the stored one."""
    points = {dof(point): point for point in stored.inputs}
    return replace(
        stored,
        inputs=tuple(points[point] for point in found.inputs),
        frequency=found.frequency,
        accelerance=found.accelerance,
        coherence=found.coherence,
        variance=found.deviation**2,
    )
