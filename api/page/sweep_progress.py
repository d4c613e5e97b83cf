"""How far a sweep is, and what its sine points say, read from the store one mounting at a time."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from api.page.charts.axes import Real
from rig.sequence import DISPLACEMENT, FORCE, Sequence, SweepStep, sequence_from
from rig.sweep import uncorrected
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.runs import Run, get_run
from store.sine_records import BLANK, SineRecord, list_sine_records

CYCLES_SHOWN = 3


class Point(NamedTuple):
    """One sine point before any correction of the tester: k in N/m; None where the record is no sine."""

    record: SineRecord
    stiffness: float | None
    loss_factor: float | None


@dataclass(frozen=True, eq=False)
class Signals:
    """The last cycles of a record: time in s, displacement in m, force in N, each (samples,)."""

    time: Real
    displacement: Real
    force: Real


@dataclass(frozen=True, eq=False)
class SweepProgress:
    """How far it is.

    Attributes:
        mounting: the specimen and configuration whose points these are.
        mountings: all that were measured so far or are at work.
        points: of that mounting, in the order of measuring.
        signals: of the latest record of the run; None before the first.
        taken_at: when each point of the run was recorded.
        step: what was asked for; None where it was no sweep.
    """

    run: Run
    mounting: tuple[str, str]
    mountings: tuple[tuple[str, str], ...]
    points: tuple[Point, ...]
    signals: Signals | None
    taken_at: tuple[datetime, ...]
    step: SweepStep | None


def sweep_progress(catalogue: Catalogue, run_id: int, mounting: tuple[str, str] | None = None) -> SweepProgress:
    """Read how far the sweep of a run is, and the points of `mounting`, or of the one at work.

    Raises:
        NotFoundError: there is no such run, or it has no sine points to measure.
        StoreError: a record is damaged.
    """
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        records = list_sine_records(session, run_id)
    sequence = sequence_from(run.sequence, f"sequence of run {run_id}") if run.sequence else None
    if sequence is None or not sequence.sine_steps:
        raise NotFoundError(f"run {run_id} has no sweep; press Measure to start one")
    mountings = tuple(dict.fromkeys((record.specimen, record.configuration) for record in records))
    shown = mounting or (mountings[-1] if mountings else _first(sequence))
    own = [record for record in records if (record.specimen, record.configuration) == shown]
    return SweepProgress(
        run,
        shown,
        mountings,
        tuple(_point(catalogue, record) for record in own),
        _signals(catalogue, records[-1]) if records else None,
        tuple(record.recorded_at for record in records if record.recorded_at is not None),
        sequence.sweep,
    )


def _first(sequence: Sequence) -> tuple[str, str]:
    step = sequence.sine_steps[0][0]
    return (step.specimens[0], step.configurations[0]) if isinstance(step, SweepStep) else (step.piece, BLANK)


def _point(catalogue: Catalogue, record: SineRecord) -> Point:
    known = _estimate(catalogue, record) if record.waveform is not None else None
    return Point(record, None, None) if known is None else Point(record, *known)


@lru_cache(maxsize=5000)
def _estimate(catalogue: Catalogue, record: SineRecord) -> tuple[float, float] | None:
    """k and gamma of a record, which never change."""
    assert record.waveform is not None
    waveform = catalogue.waveforms.read(record.waveform)
    signals = waveform.value(DISPLACEMENT), waveform.value(FORCE)
    return uncorrected(*signals, waveform.sample_rate, record.frequency)


def _signals(catalogue: Catalogue, record: SineRecord) -> Signals | None:
    if record.waveform is None:
        return None
    waveform = catalogue.waveforms.read(record.waveform)
    samples = min(int(CYCLES_SHOWN * waveform.sample_rate / record.frequency), waveform.samples.shape[1])
    time = np.arange(samples) / waveform.sample_rate
    return Signals(time, waveform.value(DISPLACEMENT)[-samples:], waveform.value(FORCE)[-samples:])
