"""The completed points of a run, read from the catalogue before it is resumed, so that none is measured twice."""

import math

from analysis.dof import Dof
from rig.runs.completed_points import (
    CompletedPoint,
    CompletedPoints,
    RecordedBlow,
    ResumeError,
    compared_blows,
)
from rig.sequences.sequence import HammerStep, Sequence
from rig.sequences.steps import sweep_plan
from rig.sequences.sweep_plan import SweepPlan
from store.catalogue import Catalogue
from store.measurements.blows import Blow, list_blows
from store.measurements.runs import Run
from store.measurements.sine_records import SineRecord, list_sine_records


def completed_points(catalogue: Catalogue, run: Run, sequence: Sequence) -> CompletedPoints:
    """The stored measurements of `run`, which carries out `sequence`.

    The accepted blows of a point are compared once more, because the store has no results of the comparison; an
    inconsistent blow does not count. Raises ResumeError where the stored measurements are not those that the sequence
    asks for; StoreError where the catalogue cannot be read, or a blow's record is damaged.
    """
    with catalogue.reading() as session:
        blows, records = list_blows(session, run.id), list_sine_records(session, run.id)
    _check_order(run, records, [sweep_plan(step, first) for step, first in sequence.sine_steps])
    points = dict[tuple[int, str], list[Blow]]()
    for blow in blows:
        points.setdefault((blow.set_number, str(Dof.parse(str(blow.point)))), []).append(blow)
    steps = dict(enumerate(sequence.hammer_steps, 1))
    if unknown := sorted({blow.set_number for blow in blows} - set(steps)):
        raise ResumeError(f"run {run.id} holds blows of set {unknown[0]}, its sequence has {len(steps)} hammer steps")
    return CompletedPoints(
        tuple(_completed(catalogue, *place, struck, steps[place[0]]) for place, struck in points.items()),
        frozenset(record.order_number for record in records),
        max((record.elapsed for record in records), default=0.0),
    )


def _completed(
    catalogue: Catalogue, set_number: int, point: str, struck: list[Blow], step: HammerStep
) -> CompletedPoint:
    records = _records(catalogue, [blow for blow in struck if blow.accepted], step)
    compared = compared_blows(records, step.highest_frequency)
    accepted = 0 if compared is None else compared.accepted
    return CompletedPoint(
        set_number,
        point,
        accepted,
        refused=len(struck) - accepted,
        last_blow=max(blow.number for blow in struck),
        compared=records if accepted < step.blows else (),
    )


def _records(catalogue: Catalogue, accepted: list[Blow], step: HammerStep) -> tuple[RecordedBlow, ...]:
    """The accepted blows of a point for comparison; blows without a record (never stored here) are left out."""
    found = [(blow.number, catalogue.waveforms.read(blow.waveform)) for blow in accepted if blow.waveform is not None]
    return tuple(
        RecordedBlow.of(number, record.sample_rate, record.value(step.hammer), record.value(step.accelerometer))
        for number, record in found
    )


def _check_order(run: Run, records: list[SineRecord], plans: list[SweepPlan]) -> None:
    asked = {
        sine.order_number: (mounting.specimen, mounting.configuration, sine.amplitude_pp, sine.frequency)
        for plan in plans
        for mounting in plan.mountings()
        for sine in mounting.sines
    }
    for record in records:
        specimen, configuration, amplitude_pp, frequency = asked.get(record.order_number, ("", "", 0.0, 0.0))
        if (specimen, configuration) != (record.specimen, record.configuration) or not (
            math.isclose(1e3 * amplitude_pp, record.commanded_pp_mm, rel_tol=1e-6)
            and math.isclose(frequency, record.frequency, rel_tol=1e-9)
        ):
            raise ResumeError(
                f"run {run.id}: sine record {record.order_number} ({record.specimen}, {record.configuration}, "
                f"{record.commanded_pp_mm:g} mm, {record.frequency:g} Hz) is not what its sequence asks for there; "
                "resume it with the version that began it"
            )
