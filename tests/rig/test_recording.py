"""What a sequence records is in the store to the last count before it goes on."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from types import SimpleNamespace

import numpy as np
import pytest
from sqlalchemy import text

from analysis.dof import Dof
from analysis.modal.blow_check import BlowFault, BlowReason, BlowVerdict
from daq.block import Block
from daq.channels import Channel
from jointlab.runs.carry_out import CatalogueRecords
from rig.control import RunControl
from rig.instruments import Instruments
from rig.recording import BlowRecorder, SineRecorder
from rig.records import RunOrder
from rig.sequence import Sequence
from rig.sweep import SinePoint
from rig.thermometer import Thermometer, ThermometerError
from simlab.laboratory import Laboratory
from store.blows import list_blows
from store.catalogue import Catalogue
from store.errors import StoreError
from store.runs import Run, start_run
from store.sine_records import list_sine_records

STARTED = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
RATE, TRIGGER = 5120.0, 256
POINT = Dof.parse("5y")


@pytest.fixture
def thermometer(instruments: Instruments, whole_laboratory: Laboratory) -> Iterator[Thermometer]:
    with Thermometer(instruments.thermometer_url, 0.2) as opened:
        yield opened


@pytest.fixture
def run(catalogue: Catalogue) -> Run:
    with catalogue.writing() as session:
        return start_run(session, kind="sequence", title="t", article="beam 3", setup={}, started_at=STARTED)


@pytest.fixture
def records(catalogue: Catalogue, run: Run, sequence: Sequence) -> CatalogueRecords:
    return CatalogueRecords(catalogue, run, RunOrder(run.id, run.waveform_file, sequence, "test"))


@pytest.fixture
def blow(channel_table: tuple[Channel, ...]) -> Block:
    """A record of 24 bit counts, as a converter gives them."""
    counts = np.random.default_rng(1).integers(-(2**23), 2**23, (2, 5120), dtype=np.int32)
    return Block(channel_table[:2], counts, ((1e-6, 6e-7), (0.0, 6e-7)), RATE, STARTED, TRIGGER)


COUNTS = BlowVerdict((), 101.5, 0.0, 0.02)
OVERLOADED = BlowVerdict((BlowReason(BlowFault.OVERLOAD, "overload of the hammer"),), 2100.0, 0.0, 0.02)


def test_a_blow_is_kept_count_by_count_with_its_verdict(
    catalogue: Catalogue, run: Run, records: CatalogueRecords, thermometer: Thermometer, blow: Block
) -> None:
    recorder = BlowRecorder(records, 2, thermometer, RunControl())
    recorder.add_blow(POINT, 1, blow, COUNTS)
    recorder.add_blow(POINT, 2, replace(blow, overloaded=("hammer",)), OVERLOADED)
    with catalogue.reading() as session:
        first, second = list_blows(session, run.id)
    assert (str(first.point), first.set_number, first.number, first.accepted, first.reason) == ("5y", 2, 1, True, None)
    assert (second.number, second.accepted) == (2, False)
    assert second.reason == "overload of the hammer"
    assert (first.peak_force, second.peak_force) == (101.5, 2100.0)
    assert first.temperature_c is not None
    assert 15 < first.temperature_c < 35
    assert first.waveform is not None
    assert second.waveform is not None
    kept = catalogue.waveforms.read(first.waveform)
    np.testing.assert_array_equal(kept.samples, blow.counts)
    assert (kept.sample_rate, kept.trigger_index, kept.started_at) == (RATE, TRIGGER, STARTED)
    for name in ("hammer", "accelerometer"):
        np.testing.assert_array_equal(kept.value(name), blow.value(name))
    assert catalogue.waveforms.read(second.waveform).overloaded == ("hammer",)


def test_a_point_has_one_row_however_many_blows(
    catalogue: Catalogue, run: Run, records: CatalogueRecords, thermometer: Thermometer, blow: Block
) -> None:
    recorder = BlowRecorder(records, 1, thermometer, RunControl())
    for number in (1, 2, 3):
        recorder.add_blow(POINT, number, blow, COUNTS)
    recorder.add_blow(Dof.parse("1x"), 1, blow, COUNTS)
    with catalogue.reading() as session:
        points = session.execute(text("SELECT count(*) FROM points")).scalar()
    assert points == 2


def test_a_blow_without_a_temperature_is_not_kept(
    catalogue: Catalogue,
    run: Run,
    records: CatalogueRecords,
    thermometer: Thermometer,
    blow: Block,
    whole_laboratory: Laboratory,
) -> None:
    whole_laboratory.thermometer.faults.set("silent")
    with pytest.raises(ThermometerError):
        BlowRecorder(records, 1, thermometer, RunControl()).add_blow(POINT, 1, blow, COUNTS)
    with catalogue.reading() as session:
        assert list_blows(session, run.id) == []
    assert not catalogue.waveforms.folder.exists()


def test_a_blow_number_that_is_taken_is_refused(
    catalogue: Catalogue, run: Run, records: CatalogueRecords, thermometer: Thermometer, blow: Block
) -> None:
    recorder = BlowRecorder(records, 1, thermometer, RunControl())
    recorder.add_blow(POINT, 1, blow, COUNTS)
    with pytest.raises(StoreError):
        recorder.add_blow(POINT, 1, blow, COUNTS)
    with catalogue.reading() as session:
        assert len(list_blows(session, run.id)) == 1


@pytest.fixture
def sine(channel_table: tuple[Channel, ...]) -> SinePoint:
    times = np.arange(5000) / 5000.0
    volts = np.stack([0.1 * np.sin(2 * np.pi * 40 * times), 0.5 * np.sin(2 * np.pi * 40 * times + 0.1)])
    counts = np.round(volts / 3e-4).astype(np.int32)
    block = Block(channel_table[2:], counts, ((0.0, 3e-4), (0.0, 3e-4)), 5000.0, STARTED)
    return SinePoint(7, "I", "shear", 1e-5, 40.0, 5e-4, 1.1e-5, 0.98e-5, True, 23.4, block)


def test_a_sine_point_is_kept_as_it_was_asked_for_and_as_it_was_reached(
    catalogue: Catalogue, run: Run, records: CatalogueRecords, sine: SinePoint
) -> None:
    SineRecorder(records, run.started_at).add_sine(sine)
    with catalogue.reading() as session:
        (kept,) = list_sine_records(session, run.id)
    asked = SimpleNamespace(order_number=7, specimen="I", configuration="shear", frequency=40.0, temperature_c=23.4)
    for name, value in vars(asked).items():
        assert getattr(kept, name) == value, name
    assert kept.commanded_pp_mm == 0.01  # the series it belongs to: no rounding of 1e3 * 1e-5
    assert kept.reached_pp_mm == pytest.approx(0.0098)
    since_start = (datetime.now(UTC) - STARTED).total_seconds()
    assert kept.elapsed == pytest.approx(max(since_start, 0.0), abs=60)
    assert kept.recorded_at == STARTED
    assert kept.waveform is not None
    waveform = catalogue.waveforms.read(kept.waveform)
    np.testing.assert_array_equal(waveform.samples, sine.block.counts)
    assert waveform.trigger_index is None
