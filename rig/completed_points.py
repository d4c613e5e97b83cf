"""The points that a run has completed, read from the store before it is resumed, so that none is measured twice."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from analysis.dof import Dof
from rig.errors import RequestError
from rig.hammer import PointProgress
from rig.point_blows import PointBlows
from rig.sequence import HammerStep, Sequence, SineStep, Step
from rig.steps import sweep_plan
from rig.sweep_plan import SweepPlan
from store.blows import Blow, list_blows
from store.catalogue import Catalogue
from store.runs import Run
from store.sine_records import SineRecord, list_sine_records


class ResumeError(RequestError):
    """The run cannot be resumed with this sequence or these instruments; nothing moved."""


@dataclass(frozen=True)
class CompletedPoints:
    """The stored measurements of a run.

    Attributes:
        points: progress of each point, by set number and point.
        sines: order numbers of the sine points.
        elapsed: s from the start of the run to the latest sine point.
    """

    points: Mapping[tuple[int, Dof], PointProgress] = field(default_factory=dict)
    sines: frozenset[int] = frozenset()
    elapsed: float = 0.0

    @property
    def blows(self) -> int:
        """Number of accepted blows."""
        return sum(point.accepted for point in self.points.values())

    def points_of(self, set_number: int) -> dict[Dof, PointProgress]:
        """Progress of the points of a set."""
        return {point: progress for (number, point), progress in self.points.items() if number == set_number}

    def remaining_steps(self, sequence: Sequence) -> tuple[tuple[Step, int], ...]:
        """The steps that are not complete, each with its set number, or the order number of its first sine point, or 0.

        A wait, a soak or a prompt serves the step after it, and is repeated where that is not complete.
        """
        remaining = list[tuple[Step, int]]()
        set_number = len(sequence.hammer_steps) + 1
        sine_steps = list(sequence.sine_steps)
        needed = True  # whether the next step is incomplete; at the end of a sequence a wait is always carried out
        for step in reversed(sequence.steps):
            number = 0
            if isinstance(step, HammerStep):
                number = set_number = set_number - 1
                points = self.points_of(set_number)
                needed = any(points.get(Dof.parse(p), PointProgress()).accepted < step.blows for p in step.points)
            elif isinstance(step, SineStep):
                _, number = sine_steps.pop()
                needed = not self.sines.issuperset(range(number, number + step.points))
            if needed:
                remaining.append((step, number))
        return tuple(reversed(remaining))


def completed_points(catalogue: Catalogue, run: Run, sequence: Sequence) -> CompletedPoints:
    """The stored measurements of `run`, which carries out `sequence`.

    The accepted blows of a point are compared once more, because the store has no results of the comparison; an
    inconsistent blow does not count. Raises ResumeError where the stored measurements are not those that the sequence
    asks for; StoreError where the catalogue cannot be read, or a blow's record is damaged.
    """
    with catalogue.reading() as session:
        blows, records = list_blows(session, run.id), list_sine_records(session, run.id)
    _check_order(run, records, [sweep_plan(step, first) for step, first in sequence.sine_steps])
    points = dict[tuple[int, Dof], list[Blow]]()
    for blow in blows:
        points.setdefault((blow.set_number, Dof.parse(str(blow.point))), []).append(blow)
    steps = dict(enumerate(sequence.hammer_steps, 1))
    if unknown := sorted({blow.set_number for blow in blows} - set(steps)):
        raise ResumeError(f"run {run.id} holds blows of set {unknown[0]}, its sequence has {len(steps)} hammer steps")
    return CompletedPoints(
        {place: _progress(catalogue, struck, steps[place[0]]) for place, struck in points.items()},
        frozenset(record.order_number for record in records),
        max((record.elapsed for record in records), default=0.0),
    )


def _progress(catalogue: Catalogue, struck: list[Blow], step: HammerStep) -> PointProgress:
    compared = _compared(catalogue, [blow for blow in struck if blow.accepted], step)
    accepted = 0 if compared is None else compared.accepted
    return PointProgress(accepted, len(struck) - accepted, max(blow.number for blow in struck), compared)


def _compared(catalogue: Catalogue, accepted: list[Blow], step: HammerStep) -> PointBlows | None:
    """The accepted blows of a point for comparison; blows without a record (never stored here) are left out."""
    records = [(blow.number, catalogue.waveforms.read(blow.waveform)) for blow in accepted if blow.waveform is not None]
    if not records:
        return None
    blows = [(number, found.value(step.hammer), found.value(step.accelerometer)) for number, found in records]
    return PointBlows.of(step.highest_frequency, blows, records[0][1].sample_rate)


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
