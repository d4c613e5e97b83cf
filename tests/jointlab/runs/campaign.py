"""A run that wrote a spool, and what the catalogue has to hold once it is stored."""

import random
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from sqlalchemy import select

from jointlab.runs.orders import order_to_begin, plan_run
from rig.runs.records import BeginRecord, BlowRecord, EndRecord, Record, RunOrder, SinePointRecord
from rig.runs.spool import spooling, spools
from rig.sequences.sequence import sequence_from
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.instrument import Instrument
from store.measurements.blows import Blow, list_blows
from store.measurements.runs import get_run
from store.measurements.sine_records import SineRecord, list_sine_records
from store.models.measurements import RunEventRow
from store.service.alarms import list_alarms
from store.states import RunState
from store.waveforms.waveform import Waveform, WaveformChannel, WaveformReference
from tests.rig.conftest import DOCUMENT

STARTED = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
Entry = tuple[Record, Waveform | None]


@dataclass(frozen=True)
class Spooled:
    """A spool that a run has written: its order, its folder, and its records."""

    order: RunOrder
    path: Path
    written: list[Entry]


def waveform(chance: random.Random) -> Waveform:
    counts = np.random.default_rng(chance.getrandbits(32)).integers(-(2**23), 2**23, (2, 40), dtype=np.int32)
    channels = (WaveformChannel("hammer", "N"), WaveformChannel("accelerometer", "m/s^2"))
    return Waveform(channels, counts, 5120.0, STARTED, chance.choice([None, 5]))


def records(chance: random.Random, count: int) -> list[Entry]:
    """The beginning of a run, `count` blows and sine points, and its end; a waveform may come twice."""
    tester = Instrument("tester", "elastomer tester", "T-01", details={"map_version": 3})
    found: list[Entry] = [(BeginRecord(STARTED, "ann@rig", (), (tester,), None), None)]
    struck = dict[str, int]()
    waves = [waveform(chance)]
    for number in range(1, count + 1):
        at = STARTED + timedelta(seconds=number)
        waves.append(waveform(chance) if chance.random() < 0.8 else waves[-1])
        if chance.random() < 0.5:
            point = chance.choice(["5y", "1x", "11y"])
            blow = struck[point] = struck.get(point, 0) + 1
            reason = chance.choice([None, None, "double hit"])
            record: Record = BlowRecord(1, point, blow, reason is None, reason, 100.0 + number, 23.4, at)
        else:
            record = SinePointRecord(number, "I", "shear", 0.1, 0.098, 5.0 * number, float(number), at, 23.5)
        found.append((record, waves[-1]))
    ends: tuple[tuple[RunState, str | None, bool], ...] = (
        (RunState.FINISHED, None, False),
        (RunState.STOPPED, "stopped by hand", False),
        (RunState.STOPPED, "no program steers the rig any more", True),
        (RunState.FAILED, "the tester tripped", True),
    )
    found.append((EndRecord(STARTED + timedelta(hours=1), "ann@rig", *chance.choice(ends)), None))
    return found


def spooled(catalogue: Catalogue, folder: Path, chance: random.Random, count: int) -> Spooled:
    """Plan a run, and write its spool as the rig does."""
    run = plan_run(sequence_from(DOCUMENT), TesterLimits(), catalogue, "test", rig="rig")
    order, written = order_to_begin(run, rig="rig"), records(chance, count)
    before = set(spools(folder))
    with spooling(folder, order) as spool:
        for record, wave in written:
            spool.write(record, wave)
    (path,) = set(spools(folder)) - before
    return Spooled(order, path, written)


def check_stored(catalogue: Catalogue, spool: Spooled) -> None:
    """Check that every record is stored once, as it was written, and nothing else."""
    number = spool.order.run_id
    with catalogue.reading() as session:
        run, blows = get_run(session, number), list_blows(session, number)
        sines = list_sine_records(session, number)
        alarms = list_alarms(session)
        states = session.scalars(select(RunEventRow.state).filter_by(run_id=number).order_by(RunEventRow.id)).all()
    (begin, _), *measured, (end, _) = spool.written
    assert isinstance(begin, BeginRecord)
    assert isinstance(end, EndRecord)
    assert (run.started_at, run.finished_at, run.state, run.reason) == (begin.at, end.at, end.state, end.reason)
    assert [(alarm.run_id, alarm.happened_at) for alarm in alarms] == [(number, end.at)] * end.by_itself
    assert states == [RunState.CREATED, RunState.RUNNING, end.state]
    waves = dict[WaveformReference, Waveform]()
    found_blows, found_sines = iter(blows), iter(sines)
    for record, wave in measured:
        assert wave is not None
        reference = _same_blow(next(found_blows), record) if isinstance(record, BlowRecord) else None
        reference = reference or _same_sine(next(found_sines), record)
        waves[reference] = wave
    assert (list(found_blows), list(found_sines)) == ([], [])
    assert catalogue.waveforms.records(run.waveform_file) == list(waves)  # each once, in order
    for reference, wave in waves.items():
        kept = catalogue.waveforms.read(reference)
        np.testing.assert_array_equal(kept.samples, wave.samples)
        assert (kept.channels, kept.started_at, kept.trigger_index) == (
            wave.channels,
            wave.started_at,
            wave.trigger_index,
        )


def _same_blow(row: Blow, record: Record) -> WaveformReference:
    assert isinstance(record, BlowRecord)
    assert (row.set_number, str(row.point), row.number) == (record.set_number, record.point, record.number)
    assert (row.accepted, row.reason, row.peak_force) == (record.accepted, record.reason, record.peak_force)
    assert (row.temperature_c, row.struck_at) == (record.temperature_c, record.struck_at)
    assert row.waveform is not None
    return row.waveform


def _same_sine(row: SineRecord, record: Record) -> WaveformReference:
    assert isinstance(record, SinePointRecord)
    for name, value in vars(record).items():
        assert name == "kind" or getattr(row, name) == value
    assert row.waveform is not None
    return row.waveform
