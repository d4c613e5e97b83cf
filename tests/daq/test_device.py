"""Connecting, and checking the channel table, against a server on loopback."""

import threading
from concurrent import futures
from dataclasses import replace

import grpc
import pytest

from daq.channels import Channel, ChannelKind
from daq.device import Chassis, connect
from daq.errors import ChannelError, DaqError, InstrumentAbsentError
from simlab.daq_server import DaqServer
from tests.ports import free_port
from tests.waiting import LONG

Table = tuple[Channel, ...]


def test_the_devices_are_listed_with_product_and_serial_number(chassis: Chassis) -> None:
    assert [(d.name, d.product_type) for d in chassis.devices] == [
        ("cDAQ1", "cDAQ-9174"),
        ("cDAQ1Mod1", "NI 9234"),
        ("cDAQ1Mod2", "NI 9239"),
        ("cDAQ1Mod3", "NI 9237"),
        ("PXI1Slot2", "PXIe-4480"),
    ]
    assert len({d.serial for d in chassis.devices}) == 5


@pytest.mark.parametrize("address", ["", "192.168.1.5", "grpc://host", "http://host:1", "grpc://host:1/x", "COM3"])
def test_an_address_of_another_form_is_refused_with_the_form_wanted(address: str) -> None:
    with pytest.raises(DaqError, match=r"write local, or grpc://host:port"):
        connect(address)


def test_a_server_that_is_not_there_is_an_absent_instrument_within_the_timeout() -> None:
    port = free_port()
    with pytest.raises(InstrumentAbsentError, match=f"no NI gRPC device server at 127.0.0.1:{port}"):
        connect(f"grpc://127.0.0.1:{port}", timeout=0.3)


def test_a_server_of_something_else_is_an_absent_instrument() -> None:
    server = grpc.server(futures.ThreadPoolExecutor(1))
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    with pytest.raises(InstrumentAbsentError, match=rf"127.0.0.1:{port} is no NI gRPC device server.*UNIMPLEMENTED"):
        connect(f"grpc://127.0.0.1:{port}")
    server.stop(None)


class Hanging(grpc.GenericRpcHandler):  # type: ignore[misc]  # grpc ships no types
    """A server that says that it is there, and then says nothing."""

    def __init__(self) -> None:
        self.let_go = threading.Event()

    def service(self, call: grpc.HandlerCallDetails) -> grpc.RpcMethodHandler:
        def serve(_request: bytes, _context: grpc.ServicerContext) -> bytes:
            if not call.method.endswith("GetErrorString"):
                self.let_go.wait(LONG)
            return b""

        return grpc.unary_unary_rpc_method_handler(serve)


def test_a_server_that_hangs_is_given_up() -> None:
    hanging = Hanging()
    server = grpc.server(futures.ThreadPoolExecutor(8), handlers=[hanging])
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    with pytest.raises(InstrumentAbsentError, match=r"does not answer.*DEADLINE_EXCEEDED"):
        connect(f"grpc://127.0.0.1:{port}", timeout=0.3)
    hanging.let_go.set()
    server.stop(None).wait()


def test_a_server_without_a_device_is_an_absent_instrument(server: DaqServer) -> None:
    server.faults.set("device_gone")
    with pytest.raises(InstrumentAbsentError, match="check power and cable") as error:
        connect(server.address)
    assert error.value.code == -201003


def test_this_computer_without_a_driver_is_an_absent_instrument() -> None:
    with pytest.raises(InstrumentAbsentError, match="no NI-DAQmx driver; install it, or give the address"):
        connect("local")


def test_a_table_that_fits_is_verified(chassis: Chassis, hammer_table: Table, tester_table: Table) -> None:
    chassis.verify(hammer_table)
    chassis.verify(hammer_table + tester_table)


@pytest.mark.parametrize(
    ("physical", "reason"),
    [
        ("Dev9/ai0", r"no device 'Dev9' at grpc.*there are cDAQ1 \(cDAQ-9174\), cDAQ1Mod1 \(NI 9234\)"),
        ("cDAQ1Mod1/ai7", r"cDAQ1Mod1 \(NI 9234\) has only cDAQ1Mod1/ai0, cDAQ1Mod1/ai1"),
        ("cDAQ1/ai0", "has only no analog input"),
    ],
)
def test_a_wrong_channel_is_named_with_the_known_ones(
    chassis: Chassis, hammer_table: Table, physical: str, reason: str
) -> None:
    with pytest.raises(ChannelError, match=f"channel 'hammer' is on {physical}.*{reason}"):
        chassis.verify([replace(hammer_table[0], physical=physical)])


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"physical": "cDAQ1Mod2/ai0"}, -200431),  # no IEPE current on a voltage module
        ({"maximum": 3000.0}, -200077),  # 6.75 V on a 5 V input
        ({"excitation_current": 4e-3}, -200077),
    ],
)
def test_an_unsupported_setting_is_an_error_of_its_channel(
    chassis: Chassis, hammer_table: Table, change: dict[str, object], code: int
) -> None:
    with pytest.raises(ChannelError, match=r"channel 'hammer' on cDAQ1Mod./ai0: .*check|ask") as error:
        chassis.verify([replace(hammer_table[0], **change)])  # type: ignore[arg-type]  # one field at a time
    assert error.value.code == code


def test_a_voltage_channel_is_verified_in_its_own_unit(chassis: Chassis) -> None:
    displacement = Channel("displacement", "cDAQ1Mod2/ai0", ChannelKind.VOLTAGE, 2e3, "m", -5e-3, 5e-3)
    chassis.verify([displacement])  # +-10 V
    with pytest.raises(ChannelError):
        chassis.verify([replace(displacement, maximum=5.1e-3)])


def test_verifying_leaves_the_instrument_free(chassis: Chassis, hammer_table: Table) -> None:
    chassis.verify(hammer_table)
    with chassis.record(hammer_table, 5120, 0.1) as recorder:
        assert recorder.record().samples == 512
