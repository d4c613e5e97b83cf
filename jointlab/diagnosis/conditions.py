"""The conditions of a run, without its values: known from the catalogue, so that no record has to be read."""

from collections.abc import Sequence

import numpy as np
from sqlalchemy.orm import Session

from analysis.gap import measurement as gap
from jointlab.diagnosis.load import LOWEST_LINE, drawing_of
from jointlab.identification.measurement import dof
from jointlab.sequences import sequence_of
from rig.operator import SUPPORTED
from store.dof import StoredDof
from store.exchange.bundle_setup import article_from
from store.measurements.blows import list_blows
from store.measurements.frequency_responses import list_frequency_responses
from store.measurements.runs import Run
from store.measurements.sine_records import list_sine_records
from store.results.analyses import latest_analysis
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.states import BLANK, HAMMER, AnalysisKind

Taken = tuple[str, str, float, float, float, int]
"""Specimen, configuration, amplitude in mm peak to peak, frequency in Hz, time in s and number of a sine point."""


def conditions_of_run(session: Session, run: Run) -> gap.Measurement:
    """Where and how a run was measured: points, levels, amplitudes, frequencies and order; each measured value is a 1.

    Raises:
        StoreError: its data cannot be read.
        AnalysisError: it has neither blows on the supported beam nor points of the tester.
    """
    article = article_from(run.setup)
    sets, taken = (_imported if run.kind == "import" else _recorded)(session, run)
    return gap.Measurement(
        drawing_of(article),
        sets,
        _points(taken, [joint.name for joint in article.joints]),
        preset=(run.setup.get("direct") or {}).get("preset_mm", 0.0) * 1e-3,
    )


def _imported(session: Session, run: Run) -> tuple[tuple[gap.HammerSet, ...], list[Taken]]:
    sets = list_frequency_responses(session, run.id) if run.setup.get("inverse") else []
    points = list[Taken]()
    if run.setup.get("direct"):
        newest = latest_analysis(session, run.id, AnalysisKind.DYNAMIC_STIFFNESS)
        points = [
            (each.specimen, each.configuration, each.amplitude_pp_mm, each.frequency, each.elapsed, each.order_number)
            for each in list_dynamic_stiffness(session, newest.id)
        ]
    struck = [each for each in sets if each.excitation == HAMMER]
    return tuple(_set(each.inputs, float(each.frequency[-1]), each.peak_force) for each in struck), points


def _recorded(session: Session, run: Run) -> tuple[tuple[gap.HammerSet, ...], list[Taken]]:
    sequence = sequence_of(run)
    assert sequence is not None, "it was measured by one"
    blows, sets = [each for each in list_blows(session, run.id) if each.accepted], list[gap.HammerSet]()
    for number, step in enumerate(sequence.hammer_steps, start=1):
        own = [each for each in blows if each.set_number == number]
        if own and step.beam == SUPPORTED:
            points = list(dict.fromkeys(each.point for each in own))
            peaks = [each.peak_force for each in own if each.peak_force is not None]
            sets.append(_set(points, step.highest_frequency, float(np.mean(peaks))))
    return tuple(sets), [
        (r.specimen, r.configuration, r.commanded_pp_mm, r.frequency, r.elapsed, r.order_number)
        for r in list_sine_records(session, run.id)
        if r.configuration != BLANK
    ]


def _set(points: Sequence[StoredDof], highest: float, peak_force: float) -> gap.HammerSet:
    lines = np.array([LOWEST_LINE, highest])
    nothing = np.ones((len(points), lines.size))
    return gap.HammerSet(tuple(map(dof, points)), lines, nothing.astype(complex), nothing, peak_force)


def _points(taken: Sequence[Taken], joints: Sequence[str]) -> gap.TesterPoints | None:
    if not taken:
        return None
    specimen, configuration, amplitude, frequency, elapsed, number = zip(*taken, strict=True)
    nothing = np.ones(len(taken))
    return gap.TesterPoints(
        order=np.argsort(np.lexsort((number, elapsed))).astype(np.float64) + 1,
        specimen=np.array([joints.index(each) for each in specimen], dtype=np.intp),
        configuration=np.array([gap.Configuration[each.upper()] for each in configuration], dtype=np.intp),
        amplitude=np.array(amplitude) * 0.5e-3,
        frequency=np.array(frequency),
        stiffness=nothing.astype(complex),
        deviation=nothing,
        temperature=nothing,
    )
