"""The whole simulated laboratory, in this process and in one of its own."""

import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from simlab.laboratory import Addresses, Laboratory, LaboratoryProcess
from simlab.operator_server import OperatorClient
from tests.ports import free_port
from tests.waiting import LONG

ROOT = Path(__file__).resolve().parents[2]


def answers(address: str) -> bool:
    """Whether somebody listens at ``host:port``."""
    host, _, port = address.rpartition("/")[2].rpartition(":")
    try:
        socket.create_connection((host, int(port)), timeout=LONG).close()
    except OSError:
        return False
    return True


@pytest.fixture(scope="module")
def process() -> Iterator[LaboratoryProcess]:
    with LaboratoryProcess(seed=2, speed=100.0) as running:
        yield running


def test_every_address_answers_until_the_laboratory_stops() -> None:
    with Laboratory(seed=1, speed=100.0) as laboratory:
        addresses = list(asdict(laboratory.addresses).values())
        assert [address.split(":")[0] for address in addresses] == ["grpc", "tcp", "socket", "127.0.0.1"]
        assert all(map(answers, addresses))
    assert not any(map(answers, addresses))


def test_a_port_that_is_taken_stops_what_had_started() -> None:
    with Laboratory(seed=1) as first:
        taken = int(first.addresses.operator.rpartition(":")[2])
        port = free_port()
        with pytest.raises(OSError, match="in use"):
            Laboratory(seed=1, ports={"operator": taken, "thermometer": port})
        assert not answers(f"127.0.0.1:{port}")
        assert answers(first.addresses.operator)


def test_the_hand_strikes_mounts_and_reveals(process: LaboratoryProcess) -> None:
    process.operator.do("mount", specimen="I", configuration="shear")
    process.operator.do("strike", node=3, direction="y")
    with pytest.raises(ValueError, match="2y"):
        process.operator.do("strike", node=2, direction="y")
    with pytest.raises(ValueError, match="III"):
        process.operator.do("mount", specimen="III", configuration="shear")
    truth = process.operator.do("truth")
    assert set(truth["inverse"]) == {"I", "II"}
    for joint in truth["inverse"].values():
        assert np.shape(joint["k"]) == np.shape(joint["h"]) == (3, 3)
    assert process.operator.do("dwells") == []


def test_one_seed_is_one_bench(process: LaboratoryProcess) -> None:
    with Laboratory(seed=2) as same, Laboratory(seed=3) as other:
        operators = [OperatorClient(laboratory.addresses.operator) for laboratory in (same, other)]
        ours, theirs = (operator.do("truth")["inverse"]["I"]["k"] for operator in operators)
        for operator in operators:
            operator.close()
    assert ours == process.operator.do("truth")["inverse"]["I"]["k"]
    assert theirs != ours


def test_a_process_ends_when_it_is_stopped() -> None:
    with LaboratoryProcess(speed=100.0) as laboratory:
        addresses = list(asdict(laboratory.addresses).values())
        assert all(map(answers, addresses))
    assert not any(map(answers, addresses))


def test_a_process_ends_when_the_one_that_started_it_dies() -> None:
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import json, time; from dataclasses import asdict; from simlab.laboratory import LaboratoryProcess\n"
            "print(json.dumps(asdict(LaboratoryProcess().addresses)), flush=True); time.sleep(60)",
        ],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    with parent:
        assert parent.stdout is not None
        addresses = Addresses(**json.loads(parent.stdout.readline()))
        assert answers(addresses.operator)
        parent.kill()
    patience_ends = time.monotonic() + LONG
    while answers(addresses.operator):
        assert time.monotonic() < patience_ends
        time.sleep(0.1)


def test_a_laboratory_that_cannot_start_says_so(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RuntimeError, match="ended with exit code 1"):
        LaboratoryProcess(speed=-1.0)
    assert "speed is -1.0; it must be positive" in capfd.readouterr().err
