"""The simulated NI-DAQmx server, spoken to by NI's own client over loopback: devices, channels, tasks, sessions."""

from collections.abc import Callable

import grpc
import nidaqmx
import numpy as np
import pytest
from nidaqmx import GrpcSessionOptions
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx._stubs.nidaqmx_pb2_grpc import NiDAQmxStub
from nidaqmx.constants import BridgeConfiguration, ChargeUnits, ExcitationSource
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import RpcError
from nidaqmx.system import System
from nidaqmx.task.collections import AIChannelCollection

from simlab.daq_server import DaqServer, start_daq_server
from tests.simlab.daq_client import NewTask, Ramps, add, continuous, finite, raised

GRAVITY, POUND = 9.80665, 4.4482216152605


def test_the_server_is_on_loopback(server: DaqServer) -> None:
    assert server.address.startswith("grpc://127.0.0.1:")


def test_the_chassis_and_its_modules_are_listed(line: grpc.Channel) -> None:
    system = System.remote(GrpcSessionOptions(line, ""))
    found = {d.name: (d.product_type, d.ai_physical_chans.channel_names) for d in system.devices}
    assert found["cDAQ1"] == ("cDAQ-9174", [])
    assert found["cDAQ1Mod1"] == ("NI 9234", [f"cDAQ1Mod1/ai{i}" for i in range(4)])
    assert found["cDAQ1Mod2"] == ("NI 9239", [f"cDAQ1Mod2/ai{i}" for i in range(4)])
    assert [m.name for m in system.devices["cDAQ1"].chassis_module_devices] == [
        "cDAQ1Mod1",
        "cDAQ1Mod2",
        "cDAQ1Mod3",
    ]
    assert found["PXI1Slot2"] == ("PXIe-4480", [f"PXI1Slot2/ai{i}" for i in range(6)])
    assert len({d.serial_num for d in system.devices}) == 5


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
        (lambda i: i.add_ai_force_bridge_two_point_lin_chan("cDAQ1Mod1/ai0"), DAQmxErrors.PHYS_CHAN_MEAS_TYPE),
        (lambda i: i.add_ai_voltage_chan("cDAQ1Mod3/ai0", max_val=1e-3), DAQmxErrors.PHYS_CHAN_MEAS_TYPE),
        (lambda i: i.add_ai_charge_chan("cDAQ1Mod1/ai0"), DAQmxErrors.PHYS_CHAN_MEAS_TYPE),
        (
            lambda i: i.add_ai_force_bridge_two_point_lin_chan("cDAQ1Mod3/ai0", second_physical_val=0.0),
            DAQmxErrors.LINEAR_REQUIRES_UNIQUE_POINTS,
        ),
        (
            lambda i: i.add_ai_force_bridge_two_point_lin_chan("cDAQ1Mod3/ai0", nominal_bridge_resistance=0.0),
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
        ),
        (
            lambda i: i.add_ai_force_bridge_two_point_lin_chan(
                "cDAQ1Mod3/ai0", bridge_config=BridgeConfiguration.NO_BRIDGE
            ),
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
        ),
    ],
)
def test_a_channel_that_the_module_cannot_be_is_refused(
    new_task: NewTask, add_channel: Callable[..., object], code: int
) -> None:
    assert raised(lambda: add_channel(new_task().ai_channels)) == code


def bridge_in_pounds(inputs: AIChannelCollection) -> None:
    cell = {"second_electrical_val": 2.0, "second_physical_val": 5000 / POUND, "min_val": -1000.0, "max_val": 1000.0}
    inputs.add_ai_force_bridge_two_point_lin_chan("cDAQ1Mod3/ai0", **cell)


def charge_in_g(inputs: AIChannelCollection) -> None:
    inputs.add_ai_accel_charge_chan("PXI1Slot2/ai1", sensitivity=10 * GRAVITY, min_val=-50.0, max_val=50.0)


def charge_in_picocoulombs(inputs: AIChannelCollection) -> None:
    inputs.add_ai_charge_chan("PXI1Slot2/ai1", units=ChargeUnits.PICO_COULOMBS, min_val=-1e4, max_val=1e4)


@pytest.mark.parametrize(
    ("add_channel", "slope"),  # of force or acceleration over time, in the unit of the channel
    [(bridge_in_pounds, 100 / POUND), (charge_in_g, 10 / GRAVITY), (charge_in_picocoulombs, 10 * 10)],
)
def test_bridge_and_charge_are_scaled_to_the_units_that_were_asked_for(
    new_task: NewTask, add_channel: Callable[[AIChannelCollection], None], slope: float
) -> None:
    task = new_task()
    add_channel(task.ai_channels)
    finite(task, 5000, 5000)
    values = np.array(task.read(5000))
    assert (values[-1] - values[0]) / 4999 * task.timing.samp_clk_rate == pytest.approx(slope, rel=1e-3)


def test_a_bridge_tells_its_range_supply_and_configuration(line: grpc.Channel, new_task: NewTask) -> None:
    task = new_task()
    half = BridgeConfiguration.HALF_BRIDGE
    channel = task.ai_channels.add_ai_force_bridge_two_point_lin_chan(
        "cDAQ1Mod3/ai0", bridge_config=half, voltage_excit_val=3.3, nominal_bridge_resistance=120.0
    )
    assert (channel.ai_bridge_cfg, channel.ai_bridge_nom_resistance, channel.ai_excit_val) == (half, 120.0, 3.3)
    assert channel.ai_dev_scaling_coeff == [0.0, 25e-3 / 2**23]
    devices = System.remote(GrpcSessionOptions(line, "")).devices
    assert devices["cDAQ1Mod3"].ai_bridge_rngs == [-25e-3, 25e-3]
    assert devices["PXI1Slot2"].ai_charge_rngs == [-20e-9, 20e-9]
    assert devices["cDAQ1Mod1"].ai_bridge_rngs == []


def test_a_channel_is_refused_twice_in_one_task(new_task: NewTask) -> None:
    task = new_task("hammer")
    assert raised(lambda: add(task, "hammer")) == DAQmxErrors.CHAN_ALREADY_IN_TASK


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


def test_a_server_that_stops_drops_its_clients(line: grpc.Channel, server: DaqServer) -> None:
    task = nidaqmx.Task(grpc_options=GrpcSessionOptions(line, ""))
    server.stop()
    with pytest.raises(RpcError, match="UNAVAILABLE"):
        task.start()


def test_an_address_in_use_is_an_error(server: DaqServer, bench: Ramps) -> None:
    with pytest.raises(OSError, match="cannot serve at"):
        start_daq_server(bench, server.address.removeprefix("grpc://"))
