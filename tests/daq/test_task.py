"""Triggered tasks and recorders, over the wire, against signals that are known at every instant."""

from __future__ import annotations

import threading
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np
import pytest

from daq.channels import Channel
from daq.device import Chassis
from daq.errors import ChannelError, DaqError, InstrumentAbsentError, OverrunError, TriggerTimeoutError
from daq.instrument import EdgeTrigger
from simlab.daq_server import DaqServer
from tests.waiting import LONG

if TYPE_CHECKING:
    from tests.daq.conftest import Plant

Table = tuple[Channel, ...]
TRIGGER = EdgeTrigger("hammer", 10.0, pre_trigger=0.05)
COUNT = {5.0: 5 / 2**23, 10.0: 10 / 2**23}  # V


# -- one blow


def test_a_triggered_block_is_the_bench_within_half_a_count(
    chassis: Chassis, plant: Plant, hammer_table: Table
) -> None:
    with chassis.triggered(hammer_table, 5120, 2.0, TRIGGER) as task:
        task.arm()
        plant.strike()
        block = task.wait(LONG)
    start, rate, samples = plant.served[-1]
    assert (rate, samples) == (5120, 10240)
    signals = plant.hammer_signals(start, rate, samples)
    for channel in hammer_table:
        error = block.value(channel.name) - signals[channel.name]
        assert np.max(np.abs(error)) <= COUNT[5.0] / 2 / channel.sensitivity * (1 + 1e-6)


def test_a_sensor_that_is_turned_round_triggers_and_counts_as_its_polarity_says(
    chassis: Chassis, server: DaqServer, plant: Plant, hammer_table: Table
) -> None:
    turned = tuple(replace(channel, polarity=-1) for channel in hammer_table)
    for channel in turned:
        server.faults.set("inverted", channel.physical)
    with chassis.triggered(turned, 5120, 0.5, TRIGGER) as task:
        task.arm()
        plant.strike()
        block = task.wait(LONG)
    assert block.value("hammer").max() == pytest.approx(100.0, rel=0.01)
    assert block.value("hammer").min() > -1e-3
    signals = plant.hammer_signals(*plant.served[-1])
    assert np.allclose(block.value("accelerometer"), signals["accelerometer"], atol=1e-3)
    assert not block.overloaded


def test_the_trigger_index_is_the_first_sample_above_the_level(
    chassis: Chassis, plant: Plant, hammer_table: Table
) -> None:
    with chassis.triggered(hammer_table, 5120, 0.5, TRIGGER) as task:
        task.arm()
        plant.strike()
        block = task.wait(LONG)
    hammer = block.value("hammer")
    assert block.trigger_index == 256
    assert hammer[255] < 10.0 <= hammer[256]
    assert np.max(hammer) == pytest.approx(100.0, rel=0.01)


def test_a_task_takes_blow_after_blow(chassis: Chassis, plant: Plant, hammer_table: Table) -> None:
    with chassis.triggered(hammer_table, 5120, 0.5, TRIGGER) as task:
        for peak in (50.0, 100.0, 150.0):
            task.arm()
            plant.strike(peak=peak)
            assert np.max(task.wait(LONG).value("hammer")) == pytest.approx(peak, rel=0.01)


def test_a_block_carries_its_calibration_rate_and_time(chassis: Chassis, plant: Plant, hammer_table: Table) -> None:
    with chassis.triggered(hammer_table, 5120, 0.5, TRIGGER) as task:
        before = datetime.now(UTC)
        task.arm()
        plant.strike()
        block = task.wait(LONG)
    assert before <= block.started_at <= datetime.now(UTC)
    assert block.channels == hammer_table
    assert block.counts.dtype == np.int32
    assert block.scaling == ((0.0, COUNT[5.0]),) * 2
    assert block.sample_rate == 5120
    assert block.overloaded == ()


def test_without_a_blow_the_task_can_be_armed_again(chassis: Chassis, plant: Plant, hammer_table: Table) -> None:
    with chassis.triggered(hammer_table, 5120, 0.1, TRIGGER) as task:
        task.arm()
        with pytest.raises(TriggerTimeoutError, match=r"read hammer, accelerometer: .*nothing came in time") as error:
            task.wait(0.2)
        assert error.value.code == -200284
        task.arm()
        plant.strike()
        assert task.wait(LONG).samples == 512


def test_a_blow_before_arming_does_not_count(chassis: Chassis, plant: Plant, hammer_table: Table) -> None:
    plant.strike(after=0.0)
    plant.clock.sleep(0.1)
    with chassis.triggered(hammer_table, 5120, 0.1, TRIGGER) as task:
        task.arm()
        with pytest.raises(TriggerTimeoutError):
            task.wait(0.1)


def test_armed_means_that_a_blow_at_once_counts_with_its_whole_pre_trigger(
    chassis: Chassis, plant: Plant, hammer_table: Table
) -> None:
    with chassis.triggered(hammer_table, 5120, 2.0, EdgeTrigger("hammer", 10.0, pre_trigger=1.0)) as task:
        task.arm()
        plant.strike(after=0.0)
        block = task.wait(LONG)
    assert block.trigger_index == 5120


def test_a_trigger_on_a_channel_outside_the_table_is_refused(chassis: Chassis, hammer_table: Table) -> None:
    with pytest.raises(ChannelError, match="trigger on 'anvil': not one of hammer, accelerometer"):
        chassis.triggered(hammer_table, 5120, 0.1, EdgeTrigger("anvil", 1.0, 0.01))


# -- sensors


def test_a_channel_beyond_its_range_is_named_in_the_block(chassis: Chassis, plant: Plant, hammer_table: Table) -> None:
    with chassis.triggered(hammer_table, 5120, 0.5, TRIGGER) as task:
        task.arm()
        plant.strike(peak=1200.0)  # 600 m/s^2 or 6.1 V at the accelerometer, 2.7 V at the hammer
        block = task.wait(LONG)
        assert block.overloaded == ("accelerometer",)
        task.arm()
        plant.strike()
        assert task.wait(LONG).overloaded == ()


def test_overloads_are_found_without_the_help_of_the_instrument(
    chassis: Chassis, server: DaqServer, plant: Plant, hammer_table: Table
) -> None:
    with chassis.triggered(hammer_table, 5120, 0.5, TRIGGER) as task:
        server.faults.script("GetReadAttributeBool", -200452)  # an instrument that has no such property
        for _ in range(2):
            task.arm()
            plant.strike(peak=1200.0)
            assert task.wait(LONG).overloaded == ("accelerometer",)


def test_without_excitation_an_iepe_sensor_gives_nothing(chassis: Chassis, plant: Plant, hammer_table: Table) -> None:
    off = replace(hammer_table[1], excitation_current=0.0)
    with chassis.triggered((hammer_table[0], off), 5120, 0.5, TRIGGER) as task:
        task.arm()
        plant.strike()
        block = task.wait(LONG)
    assert np.max(block.value("hammer")) > 50
    assert np.max(np.abs(block.at_input("accelerometer"))) < 1e-3


def test_without_excitation_the_hammer_never_triggers(chassis: Chassis, plant: Plant, hammer_table: Table) -> None:
    off = replace(hammer_table[0], excitation_current=0.0)
    with chassis.triggered((off, hammer_table[1]), 5120, 0.1, TRIGGER) as task:
        task.arm()
        plant.strike()
        with pytest.raises(TriggerTimeoutError):
            task.wait(0.2)


def test_an_open_cable_is_an_overload(chassis: Chassis, server: DaqServer, plant: Plant, hammer_table: Table) -> None:
    server.faults.set("cable_open", "cDAQ1Mod1/ai1")
    with chassis.record(hammer_table, 5120, 0.1) as recorder:
        assert recorder.record().overloaded == ("accelerometer",)


# -- records


def test_a_record_has_both_modules_on_one_clock(
    chassis: Chassis, plant: Plant, hammer_table: Table, tester_table: Table
) -> None:
    with chassis.record((*hammer_table, *tester_table), 5120, 1.0) as recorder:
        block = recorder.record()
    start, rate, samples = plant.served[-1]
    times = start + np.arange(samples) / rate
    np.testing.assert_allclose(
        block.value("accelerometer"), plant.hammer_signals(start, rate, samples)["accelerometer"], atol=1e-4
    )
    signals = plant.tester_signals(times)
    for channel in tester_table:
        error = np.max(np.abs(block.value(channel.name) - signals[channel.name]))
        assert error <= COUNT[10.0] / 2 / channel.sensitivity * (1 + 1e-6)


def test_records_follow_each_other_in_one_task(chassis: Chassis, tester_table: Table) -> None:
    with chassis.record(tester_table, 5000, 0.2) as recorder:
        blocks = [recorder.record() for _ in range(20)]
    assert {b.samples for b in blocks} == {1000}
    assert all(b.trigger_index is None for b in blocks)
    assert [b.started_at for b in blocks] == sorted(b.started_at for b in blocks)


def test_a_record_may_be_longer_or_shorter_than_the_last(chassis: Chassis, tester_table: Table) -> None:
    with chassis.record(tester_table, 5000, 0.2) as recorder:
        assert [recorder.record(d).samples for d in (None, 0.5, None, 0.1)] == [1000, 2500, 2500, 500]


def test_a_rate_that_the_instrument_has_needs_no_note(chassis: Chassis, tester_table: Table) -> None:
    with chassis.record(tester_table, 5000, 0.2) as recorder:
        assert (recorder.sample_rate, recorder.rate_note) == (5000, None)


def test_a_coerced_rate_is_reported_and_used(chassis: Chassis, hammer_table: Table) -> None:
    with chassis.record(hammer_table, 4096, 1.5) as recorder:
        block = recorder.record()
        assert recorder.rate_note == "4096 Hz were requested; the instrument samples at 4266.67 Hz"
    assert block.sample_rate == pytest.approx(51200 / 12)
    assert block.samples == 6400
    assert block.duration == pytest.approx(1.5)


def test_a_rate_beyond_the_instrument_is_an_error_and_frees_it(chassis: Chassis, tester_table: Table) -> None:
    with pytest.raises(ChannelError, match=r"displacement, force at 60000 Hz: .*Maximum value: 50000"):
        chassis.record(tester_table, 60_000, 0.1)
    with chassis.record(tester_table, 5000, 0.1) as recorder:
        recorder.record()


# -- what goes wrong


@pytest.mark.parametrize(
    ("code", "kind", "advice"),
    [
        (-200279, OverrunError, "samples were lost"),
        (-200222, OverrunError, "samples were lost"),
        (-200010, OverrunError, "lower the rate"),
        (-201003, InstrumentAbsentError, "check power and cable"),
        (-200220, ChannelError, "check the channel table"),
        (-200170, ChannelError, "check the channel table"),
        (-50103, DaqError, "another task or program holds the module"),
        (-200088, DaqError, "reconnect"),
        (-200621, DaqError, "look the code up"),
    ],
)
@pytest.mark.parametrize("method", ["StartTask", "ReadBinaryI32", "StopTask"])
def test_every_error_names_place_and_remedy_and_clears_the_task(
    chassis: Chassis, server: DaqServer, tester_table: Table, method: str, code: int, kind: type[DaqError], advice: str
) -> None:
    with chassis.record(tester_table, 5000, 0.1) as recorder:
        server.faults.script(method, code)
        with pytest.raises(kind, match=rf"displacement, force: .*\({advice}|{advice}") as error:
            recorder.record()
        assert error.value.code == code
        assert str(code) in str(error.value)
        with pytest.raises(DaqError, match="the task is cleared; open a new one"):
            recorder.record()
    with chassis.record(tester_table, 5000, 0.1) as recorder:  # the instrument is free again
        recorder.record()


def test_an_overrun_is_an_error_not_a_gap(chassis: Chassis, server: DaqServer, tester_table: Table) -> None:
    with chassis.record(tester_table, 5000, 0.1) as recorder:
        server.faults.set("overrun")
        with pytest.raises(OverrunError):
            recorder.record()


def test_a_device_that_goes_while_a_blow_is_awaited(chassis: Chassis, server: DaqServer, hammer_table: Table) -> None:
    with chassis.triggered(hammer_table, 5120, 0.1, TRIGGER) as task:
        task.arm()
        goes = threading.Timer(0.05, server.faults.set, ("device_gone",))
        goes.start()
        with pytest.raises(
            InstrumentAbsentError, match=r"read hammer, accelerometer: .*check power and cable"
        ) as error:
            task.wait(LONG)
        goes.join()
    assert error.value.code == -201003


def test_a_server_that_is_killed_while_a_blow_is_awaited(
    chassis: Chassis, server: DaqServer, hammer_table: Table
) -> None:
    task = chassis.triggered(hammer_table, 5120, 0.1, TRIGGER)
    task.arm()
    dies = threading.Timer(0.05, server.stop)
    dies.start()
    with pytest.raises(InstrumentAbsentError, match=r"server does not answer.*check that it runs") as error:
        task.wait(LONG)
    dies.join()
    assert any("could not be cleared" in note for note in error.value.__notes__)
    task.close()  # nothing is left to clear


def test_a_record_that_takes_too_long_is_a_timeout_and_can_be_repeated(
    chassis: Chassis, plant: Plant, tester_table: Table
) -> None:
    with chassis.record(tester_table, 5000, 0.1) as recorder:
        with pytest.raises(TriggerTimeoutError):
            recorder.record(duration=10.0, timeout=-9.95)  # 0.05 s for what takes 0.5 s
        assert recorder.record(duration=0.1).samples == 500


def test_two_tasks_on_one_module_are_refused(chassis: Chassis, plant: Plant, hammer_table: Table) -> None:
    with chassis.triggered(hammer_table, 5120, 0.1, TRIGGER) as task:
        task.arm()
        with pytest.raises(DaqError, match="another task or program holds the module") as error:
            chassis.record(hammer_table, 5120, 0.1)
        assert error.value.code == -50103


def test_hammer_and_tester_may_run_at_once(
    chassis: Chassis, plant: Plant, hammer_table: Table, tester_table: Table
) -> None:
    with (
        chassis.triggered(hammer_table, 5120, 0.5, TRIGGER) as task,
        chassis.record(tester_table, 5000, 0.2) as recorder,
    ):
        task.arm()
        plant.strike()
        assert recorder.record().samples == 1000
        assert task.wait(LONG).trigger_index == 256
