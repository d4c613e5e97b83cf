"""What a sequence measures is written to the last count before it goes on."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.modal.blow_check import BlowFault, BlowReason, BlowVerdict
from daq.block import Block
from daq.channels import Channel
from rig.control import RunControl
from rig.instruments import Instruments
from rig.runs.recorder import BlowRecorder, SineRecorder
from rig.runs.records import BlowRecord, Record, RunRecords, SinePointRecord
from rig.sweep.driven_sweep import SinePoint
from rig.thermometer import Thermometer, ThermometerError
from simlab.laboratory import Laboratory
from store.waveforms.waveform import Waveform

STARTED = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
RATE, TRIGGER = 5120.0, 256
POINT = Dof.parse("5y")


@pytest.fixture
def thermometer(instruments: Instruments, whole_laboratory: Laboratory) -> Iterator[Thermometer]:
    with Thermometer(instruments.thermometer_url, 0.2) as opened:
        yield opened


class Written(RunRecords):
    """Keeps what is written."""

    def __init__(self) -> None:
        self.records = list[tuple[Record, Waveform | None]]()

    def write(self, record: Record, waveform: Waveform | None = None) -> None:
        self.records.append((record, waveform))


@pytest.fixture
def written() -> Written:
    return Written()


@pytest.fixture
def blow(channel_table: tuple[Channel, ...]) -> Block:
    """A record of 24 bit counts, as a converter gives them."""
    counts = np.random.default_rng(1).integers(-(2**23), 2**23, (2, 5120), dtype=np.int32)
    return Block(channel_table[:2], counts, ((1e-6, 6e-7), (0.0, 6e-7)), RATE, STARTED, TRIGGER)


COUNTS = BlowVerdict((), 101.5, 0.02)
OVERLOADED = BlowVerdict((BlowReason(BlowFault.OVERLOAD, "overload of the hammer"),), 2100.0, 0.02)


def test_a_blow_is_written_count_by_count_with_its_verdict(
    written: Written, thermometer: Thermometer, blow: Block
) -> None:
    recorder = BlowRecorder(written, 2, thermometer, RunControl())
    recorder.add_blow(POINT, 1, blow, COUNTS)
    recorder.add_blow(POINT, 2, replace(blow, overloaded=("hammer",)), OVERLOADED)
    (first, waveform), (second, other) = written.records
    assert isinstance(first, BlowRecord)
    assert isinstance(second, BlowRecord)
    assert waveform is not None
    assert other is not None
    warm = first.temperature_c
    assert 15 < warm < 35
    assert first == BlowRecord(2, "5y", 1, True, None, 101.5, warm, STARTED)
    assert second == BlowRecord(2, "5y", 2, False, "overload of the hammer", 2100.0, second.temperature_c, STARTED)
    np.testing.assert_array_equal(waveform.samples, blow.counts)
    assert (waveform.sample_rate, waveform.trigger_index, waveform.started_at) == (RATE, TRIGGER, STARTED)
    for name in ("hammer", "accelerometer"):
        np.testing.assert_array_equal(waveform.value(name), blow.value(name))
    assert (waveform.overloaded, other.overloaded) == ((), ("hammer",))


def test_a_blow_without_a_temperature_is_not_written(
    written: Written, thermometer: Thermometer, blow: Block, whole_laboratory: Laboratory
) -> None:
    whole_laboratory.thermometer.faults.set("silent")
    with pytest.raises(ThermometerError):
        BlowRecorder(written, 1, thermometer, RunControl()).add_blow(POINT, 1, blow, COUNTS)
    assert written.records == []


def test_blows_that_were_withdrawn_meanwhile_are_counted_for_their_point_and_set_once(
    written: Written, thermometer: Thermometer
) -> None:
    control = RunControl()
    recorder = BlowRecorder(written, 2, thermometer, control)
    assert recorder.withdrawn(POINT) == 0
    for place in ((2, POINT, 1), (2, POINT, 3), (2, POINT, 3), (1, POINT, 2), (2, Dof.parse("1x"), 1)):
        control.withdraw(*place)
    assert recorder.withdrawn(POINT) == 2


@pytest.fixture
def sine(channel_table: tuple[Channel, ...]) -> SinePoint:
    times = np.arange(5000) / 5000.0
    volts = np.stack([0.1 * np.sin(2 * np.pi * 40 * times), 0.5 * np.sin(2 * np.pi * 40 * times + 0.1)])
    counts = np.round(volts / 3e-4).astype(np.int32)
    block = Block(channel_table[2:], counts, ((0.0, 3e-4), (0.0, 3e-4)), 5000.0, STARTED)
    return SinePoint(7, "I", "shear", 1e-5, 40.0, 40.0, 5e-4, 1.1e-5, 0.98e-5, True, 23.4, block)


def test_a_sine_point_is_written_as_it_was_asked_for_and_as_it_was_reached(written: Written, sine: SinePoint) -> None:
    SineRecorder(written, STARTED).add_sine(sine)
    ((record, waveform),) = written.records
    assert isinstance(record, SinePointRecord)
    assert (record.order_number, record.specimen, record.configuration) == (7, "I", "shear")
    assert (record.frequency, record.temperature_c, record.recorded_at) == (40.0, 23.4, STARTED)
    assert record.driven_frequency is None
    assert record.commanded_pp_mm == 0.01  # the series it belongs to: no rounding of 1e3 * 1e-5
    assert record.reached_pp_mm == pytest.approx(0.0098)
    since_start = (datetime.now(UTC) - STARTED).total_seconds()
    assert record.elapsed == pytest.approx(max(since_start, 0.0), abs=60)
    assert waveform is not None
    np.testing.assert_array_equal(waveform.samples, sine.block.counts)
    assert waveform.trigger_index is None


def test_a_point_that_was_moved_off_the_mains_keeps_the_frequency_of_its_plan(
    written: Written, sine: SinePoint
) -> None:
    SineRecorder(written, STARTED).add_sine(replace(sine, frequency=50.0, driven_frequency=48.0))
    ((record, _),) = written.records
    assert isinstance(record, SinePointRecord)
    assert (record.frequency, record.driven_frequency) == (50.0, 48.0)
