"""Correction of faults in hammer sets that would otherwise bias an identification."""

from dataclasses import replace

import numpy as np

from analysis.gap.faults.row_faults import correct_rows
from analysis.gap.measurement import HammerSet
from jointlab.diagnosis.load import gap_measurement
from jointlab.errors import JointlabError
from jointlab.identification.measurement import MeasuredArticle, dof
from store.exchange.blow_window import stated_window
from store.measurements.frequency_responses import FrequencyResponseSet
from store.states import HAMMER


def correct_faults(measurement: MeasuredArticle) -> MeasuredArticle:
    """The measurement with sets in the right unit, without dead rows, and with rows of right polarity and order.

    Every fault is a sentence in `faults`, and so is a window that cannot be corrected for. A changed set loses the
    scatter and the forces of its single blows, whose points have the names from before. Sets without a fault and sets
    of a shaker, which are not checked, stay as they are.

    Raises:
        AnalysisError: all rows are dead.
        JointlabError: all rows of one of several sets are.
    """
    windows = _unknown_windows(measurement)
    as_it_is = replace(measurement, faults=windows) if windows else measurement
    struck = tuple(each for each in measurement.sets if each.excitation == HAMMER)
    if not struck:
        return as_it_is
    before = gap_measurement(replace(measurement, sets=struck))
    after, faults = correct_rows(before)
    if not faults:
        return as_it_is
    if len(after.sets) < len(before.sets):
        raise JointlabError(f"{'; '.join(faults)}; remove the set without a signal, or measure it again")
    changed = {
        stored.number: _stored(stored, found)
        for stored, was, found in zip(struck, before.sets, after.sets, strict=True)
        if not _same(was, found)
    }
    return replace(
        measurement,
        sets=tuple(changed.get(each.number, each) for each in measurement.sets),
        scatter={number: own for number, own in measurement.scatter.items() if number not in changed},
        forces={number: own for number, own in measurement.forces.items() if number not in changed},
        faults=(*windows, *faults),
    )


def _unknown_windows(measurement: MeasuredArticle) -> tuple[str, ...]:
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
