"""`jointlab opcua` on simulated instruments, read by asyncua's own client."""

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from asyncua.sync import Client as OpcuaClient
from asyncua.ua.uaerrors import BadUserAccessDenied
from asyncua.ua.uatypes import NodeId

from api.cli import INTERRUPTED
from jointlab.client import Client
from jointlab.publishing.variables import VARIABLES
from tests.api.conftest import paper
from tests.fault_proxy import FaultProxy
from tests.jointlab.publishing.conftest import command_process
from tests.ports import free_port
from tests.waiting import LONG, until

BLOWS = {"step": "hammer", "points": ["5y", "1x"], "blows": 2, "block_seconds": 1.0}
SINES = {"specimens": ["I"], "amplitudes_pp_mm": [0.1], "frequencies": {"first": 40, "last": 120, "step": 80}}


@pytest.fixture
def address() -> str:
    """Where the command listens."""
    return f"opc.tcp://127.0.0.1:{free_port()}"


@pytest.fixture
def process(lab: Client, service_line: FaultProxy, address: str, tmp_path: Path) -> "Iterator[subprocess.Popen[str]]":
    """The command, as soon as it serves."""
    with command_process(tmp_path, "opcua", address, "--service", f"http://{service_line.address}") as process:
        said = tmp_path / "said.txt"
        until(lambda: process.poll() is not None or "serves at" in said.read_text())
        yield process


@pytest.fixture
def opened(process: "subprocess.Popen[str]", address: str) -> Iterator[OpcuaClient]:
    with OpcuaClient(address) as client:
        yield client


def node(client: OpcuaClient, name: str) -> Any:
    index = client.get_namespace_index("urn:jointlab:rig")
    return client.nodes.objects.get_child([f"{index}:rig", f"{index}:{name}"])


def told(client: OpcuaClient, name: str) -> tuple[Any, str]:
    """The value of a variable and its quality."""
    found = node(client, name).read_data_value(raise_on_bad_status=False)
    return found.Value.Value, found.StatusCode.name


def test_variables_follow_the_rig(opened: OpcuaClient, lab: Client) -> None:
    until(lambda: told(opened, "State") == ("idle", "Good"))
    assert told(opened, "LastBlowForce") == (None, "BadNoData")
    run = lab.create_run(paper() | {"steps": [BLOWS, paper()["steps"][1] | SINES]})
    with lab.driving("test") as driver:
        driver.start(run.id, automatic=True)
        lab.wait_for_run(run.id)
    until(lambda: told(opened, "State") == ("idle", "Good") and told(opened, "Progress") == (100.0, "Good"))
    assert (told(opened, "Run"), told(opened, "Stop")) == ((run.id, "Good"), (False, "Good"))
    until(lambda: told(opened, "LastBlowPoint") == ("1x", "Good"))
    blows = list(lab.blows(run.id, accepted=True))
    force, quality = told(opened, "LastBlowForce")
    assert quality == "Good"
    assert force == pytest.approx(blows[-1].peak_force, rel=1e-3)
    until(lambda: told(opened, "LastSineFrequency") == (120.0, "Good"))
    (stiffness, good), (loss_factor, _) = told(opened, "LastStiffness"), told(opened, "LastLossFactor")
    assert good == "Good"
    assert stiffness > 1e4  # N/m
    assert 0.0 < loss_factor < 1.0
    assert told(opened, "LastSineAmplitude")[0] == pytest.approx(0.1, rel=0.1)


def test_values_are_bad_while_the_service_is_away(opened: OpcuaClient, lab: Client, service_line: FaultProxy) -> None:
    until(lambda: told(opened, "State") == ("idle", "Good"))
    service_line.cut()
    until(lambda: all(told(opened, each.name) == (None, "BadNoCommunication") for each in VARIABLES))
    assert lab.stop() is None
    service_line.repair()
    until(lambda: told(opened, "Stop") == (True, "Good"))
    assert told(opened, "State") == ("idle", "Good")


def test_units_are_those_of_opc_ua(opened: OpcuaClient) -> None:
    units = {}
    for each in VARIABLES:
        if each.unit is not None:
            found = node(opened, each.name).get_child("0:EngineeringUnits").read_value()
            assert found.NamespaceUri == "http://www.opcfoundation.org/UA/units/un/cefact"
            units[found.DisplayName.Text] = found.UnitId
    # ids of the table of the OPC Foundation (UNECE_to_OPCUA.csv)
    assert units == {"%": 20529, "N": 5129559, "mm": 5066068, "Hz": 4740186, "N/m": 13392, "1": 4404786}


def test_ctrl_c_ends_it(process: "subprocess.Popen[str]", opened: OpcuaClient) -> None:
    until(lambda: told(opened, "State") == ("idle", "Good"))
    process.send_signal(signal.SIGINT)
    assert process.wait(LONG) == INTERRUPTED


@pytest.mark.usefixtures("process")
@pytest.mark.parametrize("user", [None, "admin"])
def test_nothing_is_writable(address: str, lab: Client, user: str | None) -> None:
    before = lab.rig()
    client = OpcuaClient(address)
    if user is not None:
        client.set_user(user)
        client.set_password("admin")
    with client:
        until(lambda: told(client, "State") == ("idle", "Good"))
        for each in VARIABLES:
            with pytest.raises(BadUserAccessDenied):
                node(client, each.name).write_value(each.kind())
        with pytest.raises(BadUserAccessDenied):
            client.nodes.objects.add_object(NodeId.from_string("ns=2;s=mine"), "2:mine")
        assert told(client, "State") == ("idle", "Good")
    assert lab.rig() == before
