"""How far a hammer session is, read from the store: the same whoever looks, and whenever the page is opened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses
from analysis.modal.spectra import responses_from_blows
from api.page.charts.axes import Real
from rig.point_blows import inconsistent_blows
from rig.sequence import HammerStep, sequence_from
from rig.sequence import Sequence as SequenceDocument
from store.blows import Blow, list_blows
from store.bundle_setup import Article
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.runs import Run, get_run


@dataclass(frozen=True, eq=False)
class Record:
    """One blow's record: time in s from the trigger, force in N, acceleration in m/s^2, each (samples,)."""

    time: Real
    force: Real
    acceleration: Real
    sample_rate: float


@dataclass(frozen=True, eq=False)
class HammerSession:
    """How far it is.

    Attributes:
        counts: accepted and wanted blows of each point of the set that is at work, or was last.
        following: the point to strike next; None where every point has its blows.
        blows: of the point that was struck last, oldest first, with the reason where the others of the point contradict
            one that was accepted.
        last: record of the last blow; None before the first.
        so_far: accelerance and coherence of the accepted blows of that point; None where there are none.
    """

    run: Run
    article: Article
    step: HammerStep
    set_number: int
    counts: dict[str, tuple[int, int]]
    following: str | None
    blows: tuple[tuple[Blow, str | None], ...]
    last: Record | None
    so_far: FrequencyResponses | None


def hammer_session(catalogue: Catalogue, run_id: int, at_work: str | None = None) -> HammerSession:
    """Read how far the hammer session of a run is.

    Args:
        catalogue: where the run is.
        run_id: its number.
        at_work: the point that is struck now, where the run is carried out; by default the first that lacks blows.

    Raises:
        NotFoundError: there is no such run, or it has no hammer step.
        StoreError: a record is damaged.
    """
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        blows = list_blows(session, run_id)
    sequence = _sequence(run)
    if sequence is None or not sequence.hammer_steps:
        raise NotFoundError(f"run {run_id} has no hammer session; press Measure to start one")
    set_number = max((blow.set_number for blow in blows), default=1)
    counts, following = _counts(sequence.hammer_steps[set_number - 1], blows, set_number)
    if following is None and set_number < len(sequence.hammer_steps):
        set_number += 1
        counts, following = _counts(sequence.hammer_steps[set_number - 1], blows, set_number)
    step = sequence.hammer_steps[(blows[-1].set_number if blows else set_number) - 1]
    own = [blow for blow in blows if blow.point == blows[-1].point and blow.set_number == blows[-1].set_number]
    records = {blow.number: _record(catalogue, blow, step) for blow in own if blow.waveform is not None}
    accepted = [blow for blow in own if blow.accepted and blow.number in records]
    suspects = _suspects([records[blow.number] for blow in accepted], step)
    why = {blow.number: suspect for blow, suspect in zip(accepted, suspects, strict=True)}
    if own and str(own[0].point) in counts and own[0].set_number == set_number:
        point = str(own[0].point)
        counts[point] = (counts[point][0] - sum(reason is not None for reason in suspects), step.blows)
        following = next((name for name, (done, wanted) in counts.items() if done < wanted), None)
    if at_work in counts and counts[at_work][0] < counts[at_work][1]:
        following = at_work
    good = [records[blow.number] for blow in accepted if why[blow.number] is None]
    return HammerSession(
        run,
        sequence.article,
        step,
        set_number,
        counts,
        following,
        tuple((blow, why.get(blow.number)) for blow in own),
        records.get(own[-1].number) if own else None,
        _so_far(good, str(own[0].point), sequence.article, step) if good else None,
    )


def _sequence(run: Run) -> SequenceDocument | None:
    return sequence_from(run.sequence, f"sequence of run {run.id}") if run.sequence else None


def _counts(
    step: HammerStep, blows: Sequence[Blow], set_number: int
) -> tuple[dict[str, tuple[int, int]], str | None]:  # fmt: skip
    accepted = [str(blow.point) for blow in blows if blow.accepted and blow.set_number == set_number]
    counts = {point: (accepted.count(point), step.blows) for point in step.points}
    return counts, next((point for point, (done, wanted) in counts.items() if done < wanted), None)


def _record(catalogue: Catalogue, blow: Blow, step: HammerStep) -> Record:
    assert blow.waveform is not None
    waveform = catalogue.waveforms.read(blow.waveform)
    time = (np.arange(waveform.samples.shape[1]) - (waveform.trigger_index or 0)) / waveform.sample_rate
    return Record(time, waveform.value(step.hammer), waveform.value(step.accelerometer), waveform.sample_rate)


def _suspects(records: list[Record], step: HammerStep) -> list[str | None]:
    if not records:
        return []
    reasons = inconsistent_blows(
        np.array([record.force for record in records]),
        np.array([record.acceleration for record in records]),
        records[0].sample_rate,
        step.highest_frequency,
    )
    return [None if reason is None else str(reason) for reason in reasons]


def _so_far(records: list[Record], point: str, article: Article, step: HammerStep) -> FrequencyResponses:
    return responses_from_blows(
        [np.array([record.force for record in records])],
        [np.array([record.acceleration for record in records])],
        records[0].sample_rate,
        Dof.parse(f"{article.accelerometer.node}{article.accelerometer.direction}"),
        [Dof.parse(point)],
        step.highest_frequency,
    )
