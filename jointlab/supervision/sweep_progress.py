"""Progress of a sweep, and the sine points of one mounting before any correction of the tester, read from the store."""

from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.direct.loop import Loop, loop_of
from analysis.errors import AnalysisError
from jointlab.sequences import sequence_of
from rig.sequences.sequence import DISPLACEMENT, FORCE, Sequence, SweepStep
from rig.sweep.driven_sweep import uncorrected
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.measurements.runs import Run, get_run
from store.measurements.sine_records import SineRecord, list_sine_records
from store.states import BLANK

CYCLES_SHOWN = 3


class UncorrectedPoint(NamedTuple):
    """One sine point before any correction of the tester: k in N/m; None where the record is no sine."""

    record: SineRecord
    stiffness: float | None
    loss_factor: float | None


@dataclass(frozen=True, eq=False)
class Signals:
    """The last cycles of a record: time in s, displacement in m, force in N, each (samples,).

    Attributes:
        loop: mean cycle of the whole record, about the means of these; None where the record is no sine.
    """

    time: NDArray[np.float64]
    displacement: NDArray[np.float64]
    force: NDArray[np.float64]
    loop: Loop | None


@dataclass(frozen=True, eq=False)
class SweepProgress:
    """Progress of a sweep.

    Attributes:
        mounting: the specimen and configuration of the points.
        mountings: all that were measured so far, and the present one.
        points: of that mounting, in the order of measuring.
        signals: of the latest record of the run; None before the first.
        taken_at: when each point of the run was recorded.
        step: the sweep of the sequence; None where the sequence has only blank steps.
    """

    run: Run
    mounting: tuple[str, str]
    mountings: tuple[tuple[str, str], ...]
    points: tuple[UncorrectedPoint, ...]
    signals: Signals | None
    taken_at: tuple[datetime, ...]
    step: SweepStep | None


def sweep_progress(catalogue: Catalogue, run_id: int, mounting: tuple[str, str] | None = None) -> SweepProgress:
    """Read the progress of the sweep of a run, and the points of `mounting`, by default of the latest one.

    Raises NotFoundError where there is no such run, or it has no sine points to measure; StoreError where a record is
    damaged.
    """
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        records = list_sine_records(session, run_id)
    sequence = sequence_of(run)
    if sequence is None or not sequence.sine_steps:
        raise NotFoundError(f"run {run_id} has no sweep; press Measure to start one")
    mountings = tuple(dict.fromkeys((record.specimen, record.configuration) for record in records))
    shown = mounting or (mountings[-1] if mountings else _first_mounting(sequence))
    own = [record for record in records if (record.specimen, record.configuration) == shown]
    return SweepProgress(
        run,
        shown,
        mountings,
        tuple(UncorrectedPoint(record, *(_estimate(catalogue, record) or (None, None))) for record in own),
        _signals(catalogue, records[-1]) if records else None,
        tuple(record.recorded_at for record in records if record.recorded_at is not None),
        sequence.sweep,
    )


def _first_mounting(sequence: Sequence) -> tuple[str, str]:
    step = sequence.sine_steps[0][0]
    return (step.specimens[0], step.configurations[0]) if isinstance(step, SweepStep) else (step.piece, BLANK)


@lru_cache(maxsize=5000)
def _estimate(catalogue: Catalogue, record: SineRecord) -> tuple[float, float] | None:
    """k in N/m and gamma of a record, which never change; None where it has no waveform or is no sine."""
    if record.waveform is None:
        return None
    waveform = catalogue.waveforms.read(record.waveform)
    signals = waveform.value(DISPLACEMENT), waveform.value(FORCE)
    return uncorrected(*signals, waveform.sample_rate, record.true_frequency)


def _signals(catalogue: Catalogue, record: SineRecord) -> Signals | None:
    if record.waveform is None:
        return None
    waveform = catalogue.waveforms.read(record.waveform)
    samples = min(int(CYCLES_SHOWN * waveform.sample_rate / record.true_frequency), waveform.samples.shape[1])
    time = np.arange(samples) / waveform.sample_rate
    signals = waveform.value(DISPLACEMENT), waveform.value(FORCE)
    try:
        loop = loop_of(*signals, waveform.sample_rate, record.true_frequency)
    except AnalysisError:
        loop = None
    displacement, force = (signal[-samples:] for signal in signals)
    return Signals(time, displacement, force, loop)
