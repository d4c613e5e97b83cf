"""Values from the network: readings have to agree, settings are read back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import grpc
import numpy as np
import pytest

from daq.channels import Channel
from daq.device import Chassis
from daq.device import connect as connect_daq
from daq.errors import AcquisitionCancelledError, DaqError
from daq.instrument import EdgeTrigger
from daq.readback import agreed
from simlab.daq_server import DaqServer, start_daq_server
from simlab.daq_service import Message, NiDaqmx
from simlab.daq_tasks import Task

if TYPE_CHECKING:
    from tests.daq.conftest import Plant

Table = tuple[Channel, ...]


@contextmanager
def chassis_of(plant: Plant) -> Iterator[Chassis]:
    """A server that is started now, with whatever was changed in its code, and a connection to it."""
    server = start_daq_server(plant)
    try:
        with connect_daq(server.address) as chassis:
            yield chassis
    finally:
        server.stop()


def test_two_equal_readings_in_a_row_are_believed() -> None:
    readings = iter([1.0, 2.0, 2.0, 3.0])
    assert agreed("rate", lambda: next(readings)) == 2.0
    assert next(readings) == 3.0


def test_arrays_agree_where_every_sample_does() -> None:
    readings: Iterator[np.ndarray[tuple[int], np.dtype[np.int32]]] = iter(
        [np.array([1, 2], dtype=np.int32), np.array([1, 6], dtype=np.int32), np.array([1, 6], dtype=np.int32)]
    )
    assert agreed("record", lambda: next(readings)).tolist() == [1, 6]


def test_readings_that_never_agree_are_refused_by_name() -> None:
    numbers = iter(range(100))
    with pytest.raises(DaqError, match="sample rate: 4 readings, and no two in succession agree"):
        agreed("sample rate", lambda: next(numbers))


def test_a_setting_damaged_on_the_network_is_found_by_reading_back(
    plant: Plant, hammer_table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = NiDaqmx.CfgAnlgEdgeRefTrig

    def changed(service: NiDaqmx, request: Message, context: grpc.ServicerContext) -> Message:
        request.pretrigger_samples ^= 4  # one bit
        return original(service, request, context)

    monkeypatch.setattr(NiDaqmx, "CfgAnlgEdgeRefTrig", changed)
    found = pytest.raises(DaqError, match=r"samples before the trigger: 51 was asked for, the instrument has 55")
    with chassis_of(plant) as chassis, found:
        chassis.triggered(hammer_table, 5120.0, 0.1, EdgeTrigger("hammer", 5.0, 0.01))


def test_a_channel_on_another_input_than_asked_for_is_found(
    plant: Plant, tester_table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = NiDaqmx.CreateAIVoltageChan

    def changed(service: NiDaqmx, request: Message, context: grpc.ServicerContext) -> Message:
        request.physical_channel = request.physical_channel.replace("ai1", "ai3")
        return original(service, request, context)

    monkeypatch.setattr(NiDaqmx, "CreateAIVoltageChan", changed)
    found = pytest.raises(DaqError, match=r"input of channel 'force': .*/ai1 was asked for, .* has cDAQ1Mod2/ai3")
    with chassis_of(plant) as chassis, found:
        chassis.record(tester_table, 5120.0, 0.1)


def test_a_record_of_which_one_bit_changed_on_the_way_is_read_again(
    chassis: Chassis, server: DaqServer, tester_table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = Task.read
    readings = 0

    def flipped(task: Task, *arguments: object) -> object:
        nonlocal readings
        readings += 1
        counts, in_time = original(task, *arguments)  # type: ignore[arg-type]  # passed on as they come
        if readings == 1:
            counts = counts.copy()
            counts[0, 7] ^= 1
        return counts, in_time

    with chassis.record(tester_table, 5120.0, 0.1) as recorder:
        monkeypatch.setattr(Task, "read", flipped)
        block = recorder.record()
    assert readings == 3
    assert np.array_equal(block.counts, server.given[-1])
    assert not np.array_equal(block.counts, server.given[0])


def test_a_cancelled_record_ends_and_the_recorder_goes_on(chassis: Chassis, tester_table: Table) -> None:
    asked = 0

    def after_three_looks() -> bool:
        nonlocal asked
        asked += 1
        return asked > 3

    with chassis.record(tester_table, 5120.0, 60.0) as recorder:
        with pytest.raises(AcquisitionCancelledError, match="displacement, force: the record was cancelled"):
            recorder.record(cancelled=after_three_looks)
        assert recorder.record(0.1, cancelled=lambda: False).duration == pytest.approx(0.1, abs=1e-3)


def test_two_recorders_on_the_same_modules_in_one_process_do_not_clear_each_other(
    chassis: Chassis, server: DaqServer, tester_table: Table
) -> None:
    with chassis.record(tester_table, 5120.0, 0.1) as first, chassis.record(tester_table, 5120.0, 0.1) as second:
        assert len(server.tasks) == 2
        first.record()
        second.record()
    assert len(server.tasks) == 0


def test_a_task_that_could_not_be_cleared_is_cleared_by_the_next(server: DaqServer, tester_table: Table) -> None:
    server.faults.script("ClearTask", -201003)
    with (
        pytest.raises(DaqError, match="clear task of displacement, force"),
        connect_daq(server.address) as chassis,
        chassis.record(tester_table, 5120.0, 0.1),
    ):
        pass
    assert len(server.tasks) == 1
    with connect_daq(server.address) as chassis, chassis.record(tester_table, 5120.0, 0.1) as recorder:
        assert recorder.record().duration == pytest.approx(0.1, abs=1e-3)
    assert len(server.tasks) == 0
