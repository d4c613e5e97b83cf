"""The simulated NI-DAQmx server, spoken to by NI's own client over loopback."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import grpc
import nidaqmx
import numpy as np
import pytest
from nidaqmx import GrpcSessionOptions
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx._stubs.nidaqmx_pb2_grpc import NiDAQmxStub
from nidaqmx.constants import (
    AccelUnits,
    AcquisitionType,
    ExcitationSource,
    FillMode,
    Slope,
    TaskMode,
)
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError, DaqReadError, RpcError
from nidaqmx.stream_readers import AnalogMultiChannelReader, AnalogUnscaledReader
from nidaqmx.system import System
from numpy.typing import NDArray

from simlab.clock import Clock
from simlab.daq_server import DaqServer, start_daq_server

Real = NDArray[np.float64]
NewTask = Callable[..., nidaqmx.Task]
SPEED = 20.0
HALF_COUNT = 5 / 2**24  # V, of the NI 9234


class Ramps:
    """A bench whose every signal is linear in time, so that a value tells its time; blows at whole seconds."""

    def __init__(self) -> None:
        self.clock = Clock(SPEED)
        self.starts: list[float] = []
        self.offset = 0.0  # m/s^2

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        self.starts.append(start)
        times = start + np.arange(samples) / rate
        return {"hammer": 100 * (times % 1.0), "accelerometer": 10 * times + self.offset}

    def tester_signals(self, times: Real) -> dict[str, Real]:
        return {"displacement": 1e-5 * times, "force": 100 * times}

    def next_crossing(self, channel: str, level: float, after: float) -> float | None:
        assert channel == "hammer"
        return float(np.ceil(after - level / 100)) + level / 100 if 0 < level < 100 else None


@pytest.fixture
def bench() -> Ramps:
    return Ramps()


@pytest.fixture
def server(bench: Ramps) -> Iterator[DaqServer]:
    server = start_daq_server(bench)
    yield server
    server.stop()


@pytest.fixture
def line(server: DaqServer) -> Iterator[grpc.Channel]:
    with grpc.insecure_channel(server.address.removeprefix("grpc://")) as channel:
        yield channel


@pytest.fixture
def new_task(line: grpc.Channel) -> Iterator[NewTask]:
    made = []

    def make(*kinds: str) -> nidaqmx.Task:
        task = nidaqmx.Task(grpc_options=GrpcSessionOptions(line, ""))
        made.append(task)
        for kind in kinds:
            add(task, kind)
        return task

    yield make
    for task in made:
        if task._handle is not None:  # NI's mark of a task that is not yet closed
            task.close()


def add(task: nidaqmx.Task, kind: str, **changes: object) -> None:
    inputs = task.ai_channels
    if kind == "hammer":
        inputs.add_ai_force_iepe_chan("cDAQ1Mod1/ai0", "hammer", **{"current_excit_val": 2e-3} | changes)
    elif kind == "accelerometer":
        settings = {
            "sensitivity": 10.2 * 9.80665,
            "current_excit_val": 2e-3,
            "min_val": -490.0,
            "max_val": 490.0,
            "units": AccelUnits.METERS_PER_SECOND_SQUARED,
        }
        inputs.add_ai_accel_chan("cDAQ1Mod1/ai1", "accelerometer", **settings | changes)
    else:
        physical = {"displacement": "cDAQ1Mod2/ai0", "force": "cDAQ1Mod2/ai1"}[kind]
        inputs.add_ai_voltage_chan(physical, kind, **{"min_val": -10.0, "max_val": 10.0} | changes)


def finite(task: nidaqmx.Task, rate: float, samples: int) -> None:
    task.timing.cfg_samp_clk_timing(rate, sample_mode=AcquisitionType.FINITE, samps_per_chan=samples)


def continuous(task: nidaqmx.Task, rate: float, samples: int = 1000) -> None:
    task.timing.cfg_samp_clk_timing(rate, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=samples)


def raised(call: Callable[[], object]) -> int:
    with pytest.raises(DaqError) as error:
        call()
    return int(error.value.error_code)


# -- what is there


def test_the_server_is_on_loopback(server: DaqServer) -> None:
    assert server.address.startswith("grpc://127.0.0.1:")


def test_the_chassis_and_its_modules_are_listed(line: grpc.Channel) -> None:
    system = System.remote(GrpcSessionOptions(line, ""))
    found = {d.name: (d.product_type, d.ai_physical_chans.channel_names) for d in system.devices}
    assert found["cDAQ1"] == ("cDAQ-9174", [])
    assert found["cDAQ1Mod1"] == ("NI 9234", [f"cDAQ1Mod1/ai{i}" for i in range(4)])
    assert found["cDAQ1Mod2"] == ("NI 9239", [f"cDAQ1Mod2/ai{i}" for i in range(4)])
    assert [m.name for m in system.devices["cDAQ1"].chassis_module_devices] == ["cDAQ1Mod1", "cDAQ1Mod2"]
    assert len({d.serial_num for d in system.devices}) == 3


def test_a_channel_tells_its_range_scaling_and_excitation(new_task: NewTask) -> None:
    channel = new_task("hammer").ai_channels["hammer"]
    assert (channel.ai_rng_low, channel.ai_rng_high) == (-5.0, 5.0)
    assert channel.ai_dev_scaling_coeff == [0.0, 5 / 2**23]
    assert (channel.ai_excit_src, channel.ai_excit_val) == (ExcitationSource.INTERNAL, 2e-3)
    assert channel.physical_channel.name == "cDAQ1Mod1/ai0"


def test_a_method_that_is_not_simulated_says_so(line: grpc.Channel) -> None:
    stub = NiDAQmxStub(line)
    with pytest.raises(grpc.RpcError) as error:
        stub.SelfTestDevice(pb.SelfTestDeviceRequest(device_name="cDAQ1"))
    assert error.value.code() is grpc.StatusCode.UNIMPLEMENTED
    assert "SelfTestDevice is not simulated" in error.value.details()


def test_an_attribute_that_is_not_simulated_says_so(new_task: NewTask) -> None:
    channel = new_task("hammer").ai_channels["hammer"]
    assert raised(lambda: channel.ai_lowpass_cutoff_freq) == DAQmxErrors.ATTR_NOT_SUPPORTED


# -- channels that NI-DAQmx would refuse


@pytest.mark.parametrize(
    ("add_channel", "code"),
    [
        (lambda i: i.add_ai_voltage_chan("Dev9/ai0"), DAQmxErrors.INVALID_DEVICE_ID),
        (lambda i: i.add_ai_voltage_chan("cDAQ1Mod2/ai4"), DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST),
        (lambda i: i.add_ai_accel_chan("cDAQ1Mod2/ai0"), DAQmxErrors.PHYS_CHAN_MEAS_TYPE),
        (lambda i: i.add_ai_voltage_chan("cDAQ1Mod2/ai0", min_val=1, max_val=1), DAQmxErrors.MIN_NOT_LESS_THAN_MAX),
        (lambda i: i.add_ai_voltage_chan("cDAQ1Mod2/ai0", max_val=10.1), DAQmxErrors.INVALID_ATTRIBUTE_VALUE),
        (lambda i: i.add_ai_force_iepe_chan("cDAQ1Mod1/ai0"), DAQmxErrors.INVALID_ATTRIBUTE_VALUE),  # 4 mA
        (
            lambda i: i.add_ai_force_iepe_chan("cDAQ1Mod1/ai0", current_excit_val=2e-3, max_val=2300.0),
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
        ),
    ],
)
def test_a_channel_that_the_module_cannot_be_is_refused(
    new_task: NewTask, add_channel: Callable[..., object], code: int
) -> None:
    assert raised(lambda: add_channel(new_task().ai_channels)) == code


def test_a_channel_is_refused_twice_in_one_task(new_task: NewTask) -> None:
    task = new_task("hammer")
    assert raised(lambda: add(task, "hammer")) == DAQmxErrors.CHAN_ALREADY_IN_TASK


# -- timing


@pytest.mark.parametrize(
    ("kind", "asked", "got"),
    [("hammer", 5120, 5120), ("hammer", 4096, 51200 / 12), ("force", 5000, 5000), ("force", 40_000, 50_000)],
)
def test_the_rate_is_coerced_to_a_division_of_the_time_base(
    new_task: NewTask, kind: str, asked: float, got: float
) -> None:
    task = new_task(kind)
    finite(task, asked, 100)
    assert task.timing.samp_clk_rate == pytest.approx(got, rel=1e-12)


def test_a_rate_beyond_the_module_is_refused(new_task: NewTask) -> None:
    task = new_task("hammer")
    assert raised(lambda: finite(task, 51_201, 100)) == DAQmxErrors.INVALID_ATTRIBUTE_VALUE


def test_a_task_over_both_modules_runs_on_one_clock(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("accelerometer", "force")
    finite(task, 5120, 1000)
    accelerometer, volts = np.array(task.read(1000))
    np.testing.assert_allclose(volts / 2e-3, accelerometer * 10, atol=2e-3)


# -- reading


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
            timeout=5.0,
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
    task.wait_until_done(5)
    assert task.is_task_done()


def test_a_read_that_is_ready_takes_little_time(new_task: NewTask) -> None:
    task = new_task("hammer", "accelerometer")
    continuous(task, 5120, 1_000_000)
    task.start()
    time.sleep(0.1)
    reader, values = AnalogUnscaledReader(task.in_stream), np.empty((2, 10), dtype=np.int32)
    reader.verify_array_shape = False
    took = []
    for _ in range(50):
        before = time.perf_counter()
        reader.read_int32(values, 10)
        took.append(time.perf_counter() - before)
    assert min(took) < 2e-3  # the least of them, so that a busy computer does not count


# -- triggers


def test_a_reference_trigger_keeps_the_samples_before_it(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("hammer", "accelerometer")
    finite(task, 5120, 1000)
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig("hammer", pretrigger_samples=256, trigger_level=50.0)
    hammer, _ = np.array(task.read(1000))
    assert hammer[255] < 50 <= hammer[256] + HALF_COUNT / 2.25e-3
    assert np.all(np.diff(hammer[:1000]) > 0)


def test_a_trigger_counts_only_when_the_pre_trigger_samples_are_there(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("hammer")
    finite(task, 5120, 20_000)
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig("hammer", pretrigger_samples=10_000, trigger_level=50.0)
    started = bench.clock.now()
    task.start()
    task.wait_until_done(5)
    task.read(20_000)
    assert bench.starts[-1] >= started  # nothing from before the start


def test_a_start_trigger_starts_the_record_at_the_edge(new_task: NewTask) -> None:
    task = new_task("hammer")
    finite(task, 5120, 500)
    task.triggers.start_trigger.cfg_anlg_edge_start_trig("hammer", trigger_level=25.0)
    assert task.read(500)[0] == pytest.approx(25, abs=100 / 5120 + 1e-3)


def test_a_trigger_that_does_not_come_is_a_timeout(new_task: NewTask) -> None:
    task = new_task("hammer")
    finite(task, 5120, 100)
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig("hammer", pretrigger_samples=10, trigger_level=150.0)
    assert raised(lambda: task.read(100, timeout=0.05)) == DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE


def test_triggers_that_the_bench_cannot_make_are_refused(new_task: NewTask) -> None:
    task = new_task("hammer", "accelerometer")
    trigger = task.triggers.reference_trigger.cfg_anlg_edge_ref_trig
    assert raised(lambda: trigger("accelerometer", 10)) == DAQmxErrors.INVALID_ANALOG_TRIG_SRC
    assert raised(lambda: trigger("hammer", 10, Slope.FALLING)) == DAQmxErrors.INVALID_ATTRIBUTE_VALUE
    assert raised(lambda: trigger("nothing", 10)) == -200428
    finite(task, 5120, 100)
    trigger("hammer", pretrigger_samples=100)
    assert raised(lambda: task.control(TaskMode.TASK_VERIFY)) == DAQmxErrors.INVALID_ATTRIBUTE_VALUE


# -- states


def test_a_running_task_is_not_changed_or_started_again(new_task: NewTask) -> None:
    task = new_task("force")
    continuous(task, 5000)
    task.start()
    for change in (task.start, lambda: finite(task, 5000, 10), lambda: add(task, "displacement")):
        assert raised(change) == DAQmxErrors.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING


def test_a_module_serves_one_running_task_at_a_time(new_task: NewTask) -> None:
    first, second, other = new_task("hammer"), new_task("accelerometer"), new_task("force")
    for task in (first, second, other):
        continuous(task, 5000)
    first.start()
    other.start()
    assert raised(second.start) == DAQmxErrors.PAL_RESOURCE_RESERVED
    first.stop()
    second.start()


def test_resetting_a_device_frees_it(line: grpc.Channel, new_task: NewTask) -> None:
    first, second = new_task("hammer"), new_task("hammer")
    first.start()
    System.remote(GrpcSessionOptions(line, "")).devices["cDAQ1Mod1"].reset_device()
    second.start()


def test_a_task_without_channels_does_not_start(new_task: NewTask) -> None:
    assert raised(new_task().start) == DAQmxErrors.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK


def test_a_task_that_was_cleared_is_unknown(line: grpc.Channel, new_task: NewTask) -> None:
    task = new_task("force")
    handle = task._handle
    task.close()
    with pytest.raises(grpc.RpcError) as error:
        NiDAQmxStub(line).StartTask(pb.StartTaskRequest(task=handle))
    assert ("ni-error", "-200088") in error.value.trailing_metadata()


def test_sessions_are_shared_by_name(line: grpc.Channel) -> None:
    first = nidaqmx.Task("shared", grpc_options=GrpcSessionOptions(line, "shared"))
    second = nidaqmx.Task("shared", grpc_options=GrpcSessionOptions(line, "shared"))
    add(first, "force")
    assert second.channel_names == ["force"]
    first.close()


def test_a_waiting_read_ends_when_the_task_is_stopped(new_task: NewTask) -> None:
    task = new_task("force")
    continuous(task, 5000, 10_000_000)
    task.start()
    stopper = threading.Timer(0.05, task.stop)
    stopper.start()
    before = time.monotonic()
    assert raised(lambda: task.read(5_000_000, timeout=20)) == DAQmxErrors.SAMPLES_WILL_NEVER_BE_AVAILABLE
    assert time.monotonic() - before < 2
    stopper.join()


# -- events


def test_events_tell_of_samples_and_of_the_end(new_task: NewTask) -> None:
    task = new_task("force")
    finite(task, 5000, 5000)
    counted: list[int] = []
    done = threading.Event()

    def count(_task: object, _kind: int, samples: int, _data: object) -> int:
        counted.append(samples)
        return 0

    def end(_task: object, _status: int, _data: object) -> int:
        done.set()
        return 0

    task.register_every_n_samples_acquired_into_buffer_event(1000, count)
    task.register_done_event(end)
    task.start()
    assert done.wait(5)
    deadline = time.monotonic() + 5
    while len(counted) < 5 and time.monotonic() < deadline:
        time.sleep(1e-3)
    task.close()
    assert counted == [1000] * 5


# -- faults


def test_a_channel_beyond_its_range_is_clipped_and_flagged_until_asked(new_task: NewTask, bench: Ramps) -> None:
    bench.offset = 500.0  # 5.1 V
    task = new_task("hammer", "accelerometer")
    finite(task, 5120, 100)
    _, accelerometer = np.array(task.read(100))
    assert np.all(accelerometer == accelerometer[0])
    assert accelerometer[0] == pytest.approx(5 / 10.2e-3, rel=1e-6)
    assert task.in_stream.overloaded_chans_exist
    assert task.in_stream.overloaded_chans == ["accelerometer"]
    assert not task.in_stream.overloaded_chans_exist


def test_an_overload_fault_overloads_its_channel_only(new_task: NewTask, server: DaqServer, bench: Ramps) -> None:
    bench.clock.sleep_until(1.0)
    server.faults.set("overload", "cDAQ1Mod2/ai1")
    task = new_task("displacement", "force")
    finite(task, 5000, 5000)
    task.read(5000)
    assert task.in_stream.overloaded_chans_exist
    assert task.in_stream.overloaded_chans == ["force"]


def test_an_open_cable_rails_an_iepe_channel_and_silences_another(new_task: NewTask, server: DaqServer) -> None:
    server.faults.set("cable_open", "cDAQ1Mod1/ai1")
    server.faults.set("cable_open", "cDAQ1Mod2/ai1")
    task = new_task("accelerometer", "force")
    finite(task, 5120, 100)
    accelerometer, force = np.array(task.read(100))
    np.testing.assert_allclose(accelerometer, 5 / 10.2e-3, rtol=1e-6)
    assert np.max(np.abs(force)) < 1e-3


def test_an_overrun_happens_once(new_task: NewTask, server: DaqServer) -> None:
    server.faults.set("overrun")
    task = new_task("force")
    finite(task, 5000, 100)
    assert raised(lambda: task.read(100)) == DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE
    task.stop()
    assert len(task.read(100)) == 100


def test_a_device_that_goes_ends_a_read_that_waits(new_task: NewTask, server: DaqServer) -> None:
    task = new_task("force")
    continuous(task, 5000, 10_000_000)
    task.start()
    goes = threading.Timer(0.05, server.faults.set, ("device_gone",))
    goes.start()
    before = time.monotonic()
    assert raised(lambda: task.read(5_000_000, timeout=20)) == DAQmxErrors.DEV_CANNOT_BE_ACCESSED
    assert time.monotonic() - before < 2
    goes.join()
    server.faults.clear()
    assert len(task.read(100)) == 100


@pytest.mark.parametrize("code", [-201003, -200279, -50103, -200010])
def test_a_scripted_status_comes_once_from_its_method(new_task: NewTask, server: DaqServer, code: int) -> None:
    task = new_task("force")
    server.faults.script("StartTask", code)
    assert raised(task.start) == code
    task.start()


@pytest.mark.parametrize(("name", "channel"), [("overload", ""), ("overrun", "cDAQ1Mod1/ai0"), ("fire", "")])
def test_a_fault_that_does_not_exist_is_refused(server: DaqServer, name: str, channel: str) -> None:
    with pytest.raises(ValueError, match="choose one of"):
        server.faults.set(name, channel)


def test_a_server_that_stops_drops_its_clients(line: grpc.Channel, server: DaqServer) -> None:
    task = nidaqmx.Task(grpc_options=GrpcSessionOptions(line, ""))
    server.stop()
    with pytest.raises(RpcError, match="UNAVAILABLE"):
        task.start()


def test_an_address_in_use_is_an_error(server: DaqServer, bench: Ramps) -> None:
    with pytest.raises(OSError, match="cannot serve at"):
        start_daq_server(bench, server.address.removeprefix("grpc://"))
