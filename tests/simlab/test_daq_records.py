"""Records of the simulated NI-DAQmx server: what is in them, in what form, and when they come."""

import threading
import time

import grpc
import nidaqmx
import numpy as np
import pytest
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx._stubs.nidaqmx_pb2_grpc import NiDAQmxStub
from nidaqmx.constants import FillMode
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqReadError
from nidaqmx.stream_readers import AnalogMultiChannelReader, AnalogUnscaledReader

from simlab.daq_server import DaqServer
from tests.simlab.daq_client import HALF_COUNT, SPEED, NewTask, Ramps, continuous, finite, raised
from tests.waiting import LONG


def test_a_task_over_both_modules_runs_on_one_clock(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("accelerometer", "force")
    finite(task, 5120, 1000)
    accelerometer, volts = np.array(task.read(1000))
    np.testing.assert_allclose(volts / 2e-3, accelerometer * 10, atol=2e-3)


def test_a_finite_record_holds_the_bench_within_half_a_count(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("hammer", "accelerometer")
    finite(task, 5120, 2000)
    counts = np.empty((2, 2000), dtype=np.int32)
    assert AnalogUnscaledReader(task.in_stream).read_int32(counts, 2000) == 2000
    signals = bench.hammer_signals(bench.starts[0], 5120, 2000)
    for row, name, sensitivity in ((0, "hammer", 2.25e-3), (1, "accelerometer", 10.2e-3)):
        offset, gain = task.ai_channels[name].ai_dev_scaling_coeff
        error = offset + gain * counts[row] - signals[name] * sensitivity
        assert np.max(np.abs(error)) <= HALF_COUNT * (1 + 1e-6)


def test_no_two_records_of_an_input_without_a_sensor_are_alike(new_task: NewTask) -> None:
    records = []
    task = new_task("hammer")
    task.ai_channels.add_ai_voltage_chan("cDAQ1Mod1/ai3", "idle", min_val=-5.0, max_val=5.0)
    finite(task, 5120, 2000)
    for _ in range(2):
        records.append(np.array(task.read(2000))[1])
        task.stop()
    assert abs(np.corrcoef(records)[0, 1]) < 0.1


def test_two_dead_channels_share_no_noise(new_task: NewTask, server: DaqServer) -> None:
    for channel in ("cDAQ1Mod1/ai0", "cDAQ1Mod1/ai1"):
        server.faults.set("dead", channel)
    task = new_task("hammer", "accelerometer")
    finite(task, 5120, 2000)
    assert abs(np.corrcoef(task.read(2000))[0, 1]) < 0.1


def test_scaled_values_are_counts_over_sensitivity(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("hammer", "accelerometer")
    finite(task, 5120, 1000)
    values = np.empty((2, 1000))
    AnalogMultiChannelReader(task.in_stream).read_many_sample(values, 1000)
    signals = bench.hammer_signals(bench.starts[0], 5120, 1000)
    np.testing.assert_allclose(values[0], signals["hammer"], atol=HALF_COUNT / 2.25e-3)
    np.testing.assert_allclose(values[1], signals["accelerometer"], atol=HALF_COUNT / 10.2e-3)


def test_values_come_by_scan_where_asked(line: grpc.Channel, new_task: NewTask) -> None:
    task = new_task("hammer", "accelerometer")
    finite(task, 5120, 100)
    response = NiDAQmxStub(line).ReadAnalogF64(
        pb.ReadAnalogF64Request(
            task=task._handle,
            num_samps_per_chan=100,
            timeout=LONG,
            fill_mode_raw=FillMode.GROUP_BY_SCAN_NUMBER.value,
            array_size_in_samps=200,
        )
    )
    hammer, accelerometer = np.reshape(response.read_array, (100, 2)).T
    assert np.all(np.diff(accelerometer) > 0)
    np.testing.assert_allclose(hammer, 100 * ((accelerometer / 10) % 1.0), atol=1e-2)


def test_a_record_can_be_read_in_parts_and_no_further(new_task: NewTask) -> None:
    task = new_task("force")
    finite(task, 5000, 300)
    task.start()
    parts = [task.read(100) for _ in range(3)]
    assert np.all(np.diff(np.concatenate(parts)) > 0)
    assert raised(lambda: task.read(1)) == DAQmxErrors.SAMPLES_WILL_NEVER_BE_AVAILABLE


def test_a_continuous_task_goes_on_without_a_gap(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("force")
    continuous(task, 5000, 100_000)
    task.start()
    force = np.concatenate([task.read(500) for _ in range(10)]) / 2e-3
    np.testing.assert_allclose(np.diff(force), 100 / 5000, atol=1e-3)


def test_reading_all_of_a_continuous_task_takes_what_is_there(new_task: NewTask) -> None:
    task = new_task("force")
    continuous(task, 5000, 100_000)
    task.start()
    time.sleep(0.05)
    assert len(task.read(nidaqmx.constants.READ_ALL_AVAILABLE)) >= 0.05 * SPEED * 5000
    assert task.in_stream.total_samp_per_chan_acquired >= 0.05 * SPEED * 5000


def test_samples_that_are_not_fetched_are_overwritten(new_task: NewTask) -> None:
    task = new_task("force")
    continuous(task, 50_000)  # NI's buffer for this rate: 100 000 samples, 0.1 s of wall time here
    task.start()
    time.sleep(0.15)
    with pytest.raises(DaqReadError) as error:
        task.read(100)
    assert error.value.error_code == DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE
    assert error.value.samps_per_chan_read == 0


def test_a_timeout_gives_what_there_was(new_task: NewTask) -> None:
    task = new_task("force")
    finite(task, 5000, 50_000)  # 0.5 s of wall time
    values = np.full((1, 50_000), np.nan)
    with pytest.raises(DaqReadError) as error:
        AnalogMultiChannelReader(task.in_stream).read_many_sample(values, 50_000, timeout=0.05)
    assert error.value.error_code == DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE
    assert 0.04 * SPEED * 5000 <= error.value.samps_per_chan_read < 50_000
    assert np.count_nonzero(np.isfinite(values)) == error.value.samps_per_chan_read


def test_waiting_until_done_ends_when_done_and_complains_in_time(new_task: NewTask) -> None:
    task = new_task("force")
    finite(task, 5000, 25_000)  # 0.25 s of wall time
    task.start()
    assert not task.is_task_done()
    assert raised(lambda: task.wait_until_done(0.01)) == DAQmxErrors.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE
    task.wait_until_done(LONG)
    assert task.is_task_done()


def test_a_waiting_read_ends_when_the_task_is_stopped(new_task: NewTask) -> None:
    task = new_task("force")
    continuous(task, 5000, 10_000_000)
    task.start()
    stopper = threading.Timer(0.05, task.stop)
    stopper.start()
    assert raised(lambda: task.read(5_000_000, timeout=LONG)) == DAQmxErrors.SAMPLES_WILL_NEVER_BE_AVAILABLE
    stopper.join()
