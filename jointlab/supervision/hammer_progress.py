"""Progress of a hammer session, read from the store: it is the same for every reader, and after every restart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses
from analysis.modal.force_pulse import ForcePulse, force_pulse
from analysis.modal.spectra import responses_from_blows
from jointlab.sequences import sequence_of
from rig.hammer.blow_comparison import inconsistent_blows
from rig.sequences.sequence import HammerStep
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.exchange.bundle_setup import Article
from store.measurements.blows import Blow, list_blows
from store.measurements.runs import Run, get_run

Counts = dict[str, tuple[int, int]]


@dataclass(frozen=True, eq=False)
class BlowSignals:
    """Record of one blow: time in s from the trigger, force in N, acceleration in m/s^2, each (samples,)."""

    time: NDArray[np.float64]
    force: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    sample_rate: float

    @property
    def pulse(self) -> ForcePulse:
        """The pulse of the force. Raises AnalysisError where there is none."""
        return force_pulse(self.force, self.sample_rate, int(np.count_nonzero(self.time < 0)))


@dataclass(frozen=True, eq=False)
class HammerProgress:
    """Progress of a hammer session.

    Attributes:
        set_number: of the present set, or of the last one.
        counts: accepted and required blows of each point of that set.
        next_point: the point to strike next; None where every point has its blows.
        blows: of the point that was struck last, oldest first. A blow that was accepted, but is inconsistent with the
            others of the point, has the reason beside it.
        last: record of the last blow; None before the first.
        responses: accelerance and coherence of the accepted blows of that point; None where there are none.
    """

    run: Run
    article: Article
    set_number: int
    counts: Counts
    next_point: str | None
    blows: tuple[tuple[Blow, str | None], ...]
    last: BlowSignals | None
    responses: FrequencyResponses | None


def hammer_progress(catalogue: Catalogue, run_id: int, present_point: str | None = None) -> HammerProgress:
    """Read the progress of the hammer session of a run.

    Args:
        present_point: the point that is being struck, where the run is carried out; it is the next one until it has its
            blows. By default that is the first point that lacks blows.

    Raises:
        NotFoundError: there is no such run, or it has no hammer step.
        StoreError: a record is damaged.
    """
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        blows = list_blows(session, run_id)
    sequence = sequence_of(run)
    if sequence is None or not sequence.hammer_steps:
        raise NotFoundError(f"run {run_id} has no hammer session; press Measure to start one")
    steps = sequence.hammer_steps
    last_set = max((blow.set_number for blow in blows), default=1)
    set_number, counts = last_set, _counts(steps[last_set - 1], blows, last_set)
    if _next_point(counts, None) is None and last_set < len(steps):
        set_number += 1
        counts = _counts(steps[last_set], blows, set_number)
    if not blows:
        next_point = _next_point(counts, present_point)
        return HammerProgress(run, sequence.article, set_number, counts, next_point, (), None, None)
    latest = blows[-1]
    step, point = steps[latest.set_number - 1], str(latest.point)
    own = [blow for blow in blows if blow.point == latest.point and blow.set_number == latest.set_number]
    records = {blow.number: _record(catalogue, blow, step) for blow in own if blow.waveform is not None}
    accepted = [blow.number for blow in own if blow.accepted and blow.number in records]
    reasons = dict(zip(accepted, _inconsistent([records[number] for number in accepted], step), strict=True))
    consistent = [records[number] for number in accepted if reasons[number] is None]
    if point in counts and latest.set_number == set_number:
        done, required = counts[point]
        counts[point] = done - (len(accepted) - len(consistent)), required
    return HammerProgress(
        run,
        sequence.article,
        set_number,
        counts,
        _next_point(counts, present_point),
        tuple((blow, reasons.get(blow.number)) for blow in own),
        records.get(latest.number),
        _responses(consistent, point, sequence.article, step) if consistent else None,
    )


def _counts(step: HammerStep, blows: Sequence[Blow], set_number: int) -> Counts:
    accepted = [str(blow.point) for blow in blows if blow.accepted and blow.set_number == set_number]
    return {point: (accepted.count(point), step.blows) for point in step.points}


def _next_point(counts: Counts, present_point: str | None) -> str | None:
    incomplete = [point for point, (done, required) in counts.items() if done < required]
    return present_point if present_point in incomplete else next(iter(incomplete), None)


def _record(catalogue: Catalogue, blow: Blow, step: HammerStep) -> BlowSignals:
    assert blow.waveform is not None
    waveform = catalogue.waveforms.read(blow.waveform)
    time = (np.arange(waveform.samples.shape[1]) - (waveform.trigger_index or 0)) / waveform.sample_rate
    return BlowSignals(time, waveform.value(step.hammer), waveform.value(step.accelerometer), waveform.sample_rate)


def _inconsistent(records: list[BlowSignals], step: HammerStep) -> list[str | None]:
    """For each blow of a point, why it is inconsistent with the others; None where it is not."""
    if not records:
        return []
    reasons = inconsistent_blows(
        np.array([record.force for record in records]),
        np.array([record.acceleration for record in records]),
        records[0].sample_rate,
        step.highest_frequency,
    )
    return [None if reason is None else str(reason) for reason in reasons]


def _responses(records: list[BlowSignals], point: str, article: Article, step: HammerStep) -> FrequencyResponses:
    return responses_from_blows(
        [np.array([record.force for record in records])],
        [np.array([record.acceleration for record in records])],
        records[0].sample_rate,
        Dof.parse(f"{article.accelerometer.node}{article.accelerometer.direction}"),
        [Dof.parse(point)],
        step.highest_frequency,
    )
