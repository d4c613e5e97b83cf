"""The spool of a run: records as they were written, room for the end, and a safe end on a full disk."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.events import Event, SinePointMeasured
from rig.instruments import Instruments
from rig.registers import State
from rig.runs import spool
from rig.runs.completed_points import CompletedPoint, CompletedPoints, RecordedBlow
from rig.runs.records import (
    BeginRecord,
    BegunWith,
    BlowRecord,
    EndRecord,
    Record,
    ResetRecord,
    RunOrder,
    SinePointRecord,
)
from rig.runs.run import carry_out
from rig.runs.spool import (
    REFUSED,
    SpoolError,
    SpoolReader,
    discard_spool,
    is_written,
    set_aside,
    spooling,
    spools,
    spools_of,
)
from rig.sequences.sequence import Sequence, sequence_from
from simlab.laboratory import Laboratory
from store.instrument import Instrument, StoredChannel
from store.states import RunState
from store.waveforms.waveform import Waveform, WaveformChannel
from store.waveforms.waveform_codec import Encoded, encode
from tests.rig.conftest import DOCUMENT
from tests.rig.person import Person

NOW = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
SEQUENCE = sequence_from(DOCUMENT)
ORDER = RunOrder(7, "20260304-0123456789ab.waveforms", SEQUENCE, "ann@rig, process 7")
BLOW = BlowRecord(1, "5y", 1, True, None, 101.5, 23.4, NOW)
STOPPED = EndRecord(NOW, "ann@rig", RunState.STOPPED, "stopped by hand")

texts = st.text(max_size=20)
numbers = st.floats(allow_nan=False, allow_infinity=False)
times = st.datetimes(timezones=st.just(UTC))
instruments_drawn = st.builds(Instrument, texts, texts, texts, st.none() | st.dates(), st.none() | numbers)
channels_drawn = st.builds(
    StoredChannel, *(4 * (texts,)), *(3 * (numbers,)), st.none() | numbers, instruments_drawn,
    st.sampled_from([1, -1, None]),
)  # fmt: skip
records_drawn: st.SearchStrategy[Record] = st.one_of(
    st.builds(ResetRecord, times, texts, st.tuples(texts), texts),
    st.builds(BeginRecord, times, texts, st.tuples(channels_drawn), st.tuples(instruments_drawn), st.none() | texts),
    st.builds(
        BlowRecord, st.integers(1, 9), texts, st.integers(1), st.booleans(), st.none() | texts, numbers, numbers, times
    ),
    st.builds(SinePointRecord, st.integers(1), texts, texts, *(4 * (numbers,)), times, numbers),
    st.builds(EndRecord, times, texts, st.sampled_from(RunState), st.none() | texts),
)


@st.composite
def waveforms_drawn(draw: st.DrawFn) -> Waveform:
    counts = draw(st.lists(st.integers(-(2**31), 2**31 - 1), min_size=1, max_size=9))
    channel = WaveformChannel(draw(texts), draw(texts), (0.0, draw(numbers)))
    return Waveform((channel,), np.array([counts], np.int32), 5120.0, draw(times), draw(st.none() | st.integers(0, 9)))


def waveform(samples: int = 5120) -> Waveform:
    counts = np.random.default_rng(1).integers(-(2**23), 2**23, (2, samples), dtype=np.int32)
    return Waveform((WaveformChannel("hammer", "N"), WaveformChannel("accelerometer", "m/s^2")), counts, 5120.0, NOW)


def read(path: Path) -> tuple[RunOrder | None, list[tuple[int, Record, Encoded | None]]]:
    reader = SpoolReader(path)
    found = [(each.number, each.record, each.waveform) for each in reader.records()]
    return reader.order, found


@given(written=st.lists(st.tuples(records_drawn, st.none() | waveforms_drawn()), max_size=5))
def test_every_record_is_read_back_as_it_was_written(
    written: list[tuple[Record, Waveform | None]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("spools")
    with spooling(folder, ORDER) as opened:
        for record, wave in written:
            opened.write(record, wave)
    (path,) = spools(folder)
    order, found = read(path)
    assert order == ORDER
    assert found == [
        (number, record, None if wave is None else encode(wave)) for number, (record, wave) in enumerate(written, 1)
    ]


def test_an_order_to_go_on_is_read_back_with_the_records_that_blows_are_compared_with(tmp_path: Path) -> None:
    samples = np.random.default_rng(2).normal(size=(2, 100))
    struck = RecordedBlow.of(3, 5120.0, *samples)
    begun = BegunWith(NOW, (), (Instrument("tester", "elastomer tester", "T-01", details={"map": 1}),), "resumed")
    completed = CompletedPoints((CompletedPoint(1, "5y", 1, 2, 3, (struck,)),), frozenset({1, 4}), 12.5)
    order = RunOrder(7, "a.waveforms", SEQUENCE.with_seed(), "ann", completed, begun, planned=False, reset=True)
    with spooling(tmp_path, order):
        pass
    found, _ = read(spools(tmp_path)[0])
    assert found == order
    assert found is not None
    (blow,) = found.completed.points[0].compared
    np.testing.assert_array_equal([np.frombuffer(row) for row in (blow.force, blow.acceleration)], samples)


def test_a_spool_is_written_as_long_as_its_process_lives_and_is_removed_whole(tmp_path: Path) -> None:
    with spooling(tmp_path, ORDER) as opened:
        opened.write(BLOW, waveform())
        (path,) = spools(tmp_path)
        assert is_written(path)
    assert not is_written(path)
    discard_spool(path)
    assert list(tmp_path.iterdir()) == []


def test_a_run_does_not_begin_where_the_disk_has_no_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spool, "FREE_TO_BEGIN", 10**18)
    with pytest.raises(SpoolError, match="MB are free, 1000000000000 MB are needed"), spooling(tmp_path, ORDER):
        pytest.fail("it began")
    assert list(tmp_path.iterdir()) == []


def test_the_end_is_written_though_nothing_else_fits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with spooling(tmp_path, ORDER) as opened:
        monkeypatch.setattr(spool, "FREE_TO_GO_ON", 10**18)
        with pytest.raises(SpoolError, match="is full"):
            opened.write(BLOW, waveform())
        opened.write(STOPPED)
    assert [record for _, record, _ in read(spools(tmp_path)[0])[1]] == [STOPPED]


def test_a_disk_that_fills_up_ends_the_run_with_the_reason_and_the_actuator_at_rest(
    sequence: Sequence,
    instruments: Instruments,
    person: Person,
    whole_laboratory: Laboratory,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fill(event: Event) -> None:
        if isinstance(event, SinePointMeasured):
            monkeypatch.setattr(spool, "FREE_TO_GO_ON", 10**18)

    order = RunOrder(7, "a.waveforms", sequence, "ann")
    with pytest.raises(SpoolError, match="is full"), spooling(tmp_path, order) as opened:
        carry_out(order, instruments, person, opened, fill)
    assert whole_laboratory.tester.actuator.steady_pp() == 0.0
    assert whole_laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF
    kinds = [record.kind for _, record, _ in read(spools(tmp_path)[0])[1]]
    assert kinds == ["begin", "blow", "blow", "blow", "blow", "sine", "end"]
    end = read(spools(tmp_path)[0])[1][-1][1]
    assert isinstance(end, EndRecord)
    assert (end.state, end.reason is not None and "is full" in end.reason) == (RunState.FAILED, True)


def test_the_spools_of_a_run_are_in_the_order_in_which_they_were_made(tmp_path: Path) -> None:
    made = list[Path]()
    for _ in range(12):
        with spooling(tmp_path, ORDER):
            made += set(spools(tmp_path)) - set(made)
    assert spools(tmp_path) == made
    assert spools_of(tmp_path, ORDER.waveform_file) == made
    discard_spool(made[0])
    set_aside(made[-1], REFUSED)
    with spooling(tmp_path, ORDER):
        assert spools(tmp_path)[:-1] == made[1:-1]
    assert spools_of(tmp_path, "20260304-0123456789.waveforms") == []
