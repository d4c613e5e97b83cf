"""The hall on real drive processes: the state of each rig is its own, and so is its STOP."""

import signal
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client
from jointlab.hall import Hall
from jointlab.settings import DriveSettings, HallRig, Settings
from jointlab.trials.simulated_laboratory import simulated_settings
from rig.runs.records import RunOrder
from rig.sequences.sequence import sequence_from
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.ordinary import BenchConditions
from store.catalogue import Catalogue
from tests.api.conftest import paper
from tests.api.service.conftest import served
from tests.jointlab.drive.conftest import SWEEP, Heard, begin, is_at_rest
from tests.jointlab.drive.test_process import drive_process, linked
from tests.ports import free_port
from tests.waiting import LONG, until

TWO = ("B1", "B2")


@pytest.fixture(scope="module")
def laboratories() -> Iterator[dict[str, Laboratory]]:
    conditions = BenchConditions(double_hits=0.0)
    with Laboratory(3, 20.0, conditions) as first, Laboratory(4, 20.0, conditions) as second:
        yield {"B1": first, "B2": second}


@pytest.fixture
def rigs(laboratories: dict[str, Laboratory], tmp_path: Path) -> dict[str, Settings]:
    return {
        name: simulated_settings(
            laboratories[name].addresses,
            rig=name,
            drive=DriveSettings(folder=tmp_path / name, stop_port=free_port()),
        )
        for name in TWO
    }


@pytest.fixture
def hall_client(catalogue: Catalogue, rigs: dict[str, Settings]) -> Iterator[httpx.Client]:
    """A service that drives no rig and knows two."""
    hall = Hall(
        [
            HallRig(rig=name, stop_address="127.0.0.1", stop_port=each.drive.stop_port, page=None)
            for name, each in rigs.items()
        ]
    )
    with served(create_app(Services(catalogue, hall=hall))) as client:
        yield client


def shown(client: httpx.Client, name: str) -> dict[str, Any]:
    found: dict[str, Any] = next(each for each in client.get("/api/rigs").json()["items"] if each["rig"] == name)
    return found


def is_running(client: httpx.Client, name: str) -> bool:
    state = shown(client, name)["state"]
    return state is not None and state["phase"] == "running"


def test_each_rig_is_shown_and_stopped_by_itself(
    hall_client: httpx.Client, rigs: dict[str, Settings], laboratories: dict[str, Laboratory], tmp_path: Path
) -> None:
    order = RunOrder(1, "run-1", sequence_from(paper() | {"steps": [SWEEP]}).with_seed(), "test")
    heard = {name: Heard() for name in TWO}
    with (
        closing(OperatorClient(laboratories["B1"].addresses.operator)) as first,
        closing(OperatorClient(laboratories["B2"].addresses.operator)) as second,
        drive_process(rigs["B1"], tmp_path / "B1") as frozen,
        drive_process(rigs["B2"], tmp_path / "B2"),
        linked(rigs["B1"], heard["B1"]) as one,
        linked(rigs["B2"], heard["B2"]) as two,
    ):
        for hand, link, name in ((first, one, "B1"), (second, two, "B2")):
            hand.do("mount", specimen="I", configuration="shear")
            begin(link, heard[name], order, link.take_lease("test"))
        for name in TWO:
            until(partial(is_running, hall_client, name))

        with Client(str(hall_client.base_url)) as lab:
            lab.stop_rig("B2")
            assert [each.rig for each in lab.rigs()] == list(TWO)
        assert is_at_rest(laboratories["B2"])
        until(lambda: shown(hall_client, "B2")["state"]["stop"] is not None)
        measured = heard["B1"].now.state.sines
        until(lambda: heard["B1"].now.state.sines > measured)  # the other one goes on
        assert shown(hall_client, "B1")["state"]["stop"] is None

        frozen.send_signal(signal.SIGSTOP)
        try:
            until(lambda: shown(hall_client, "B1")["state"] is None)
            lost = shown(hall_client, "B1")
            assert lost["heard_at"] is not None
            assert lost["trouble"]
            answer = hall_client.post("/api/rigs/B1/stop", timeout=LONG)
            assert answer.status_code == 502
            assert "red button" in answer.json()["detail"]
            assert shown(hall_client, "B2")["state"] is not None
        finally:
            frozen.send_signal(signal.SIGCONT)
        until(lambda: (shown(hall_client, "B1")["state"] or {}).get("stop") is not None)  # it had waited in the socket


def test_a_rig_that_never_answered_is_not_at_rest(hall_client: httpx.Client) -> None:
    until(lambda: shown(hall_client, "B1")["trouble"] == "Connection refused")
    assert shown(hall_client, "B1") | {"trouble": None} == {
        "rig": "B1", "page": None, "state": None, "trouble": None, "heard_at": None,
    }  # fmt: skip


def test_another_rig_at_the_address_is_not_taken_for_this_one(
    catalogue: Catalogue, rigs: dict[str, Settings], tmp_path: Path
) -> None:
    with drive_process(rigs["B1"], tmp_path / "B1"):
        hall = Hall([HallRig(rig="B9", stop_address="127.0.0.1", stop_port=rigs["B1"].drive.stop_port, page=None)])
        with served(create_app(Services(catalogue, hall=hall))) as client:
            until(lambda: shown(client, "B9")["trouble"] == "B1 answers there; correct [[hall]]")
            assert shown(client, "B9")["state"] is None
            answer = client.post("/api/rigs/B9/stop", timeout=LONG)
            assert answer.status_code == 502
            assert "STOP reached B1, and not B9" in answer.json()["detail"]


def test_a_rig_that_the_hall_does_not_have_is_not_found(hall_client: httpx.Client, client: httpx.Client) -> None:
    assert hall_client.post("/api/rigs/B3/stop").status_code == 404
    assert client.post("/api/rigs/B1/stop").status_code == 404
    assert client.get("/api/rigs").json()["items"] == []
