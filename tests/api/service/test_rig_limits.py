"""The rig's limits over REST: in force at once, and again after a restart."""

import time
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from typing import Any

import httpx
import pytest
from sqlalchemy import text

from jointlab.settings import Settings
from jointlab.supervision import manager
from jointlab.supervision.manager import RunManager
from jointlab.supervision.stored_limits import save_limits
from rig.errors import RigError
from rig.instruments import Instruments
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.service.rig_limits import save_rig_limits
from tests.api.conftest import paper
from tests.api.service.conftest import Acting


def test_limits_bind_the_next_run_and_outlive_the_service(
    rig_client: httpx.Client, rig_settings: Settings, catalogue: Catalogue, acting: Acting
) -> None:
    read = rig_client.get("/api/rig/limits")
    tight = read.json() | {"amplitude_pp": 2e-5}
    headers = acting() | {"If-Match": read.headers["etag"]}
    assert rig_client.put("/api/rig/limits", json=tight, headers=headers).json() == tight
    refused = rig_client.post("/api/runs", json={"sequence": paper()}, headers=acting())
    assert (refused.status_code, "limits of 0 to 0.02 mm" in refused.json()["detail"]) == (422, True)
    with closing(RunManager(catalogue, rig_settings, starts=False)) as restarted:
        assert restarted.instruments.limits == TesterLimits(amplitude_pp=2e-5)
    stale = acting() | {"If-Match": read.headers["etag"]}
    assert rig_client.put("/api/rig/limits", json=read.json(), headers=stale).status_code == 412


def test_of_two_who_change_the_limits_that_they_read_at_once_one_is_refused(
    rig_client: httpx.Client, acting: Acting, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = rig_client.get("/api/rig/limits")
    later: list[Future[httpx.Response]] = []

    def put(force: float) -> httpx.Response:
        headers = acting() | {"If-Match": read.headers["etag"]}
        return rig_client.put("/api/rig/limits", json=read.json() | {"force": force}, headers=headers)

    def save_while_another_asks(*given: Any) -> Instruments:
        if not later:
            later.append(other.submit(put, 2e3))
            time.sleep(0.3)  # by now it waits for its turn
        return save_limits(*given)

    monkeypatch.setattr(manager, "save_limits", save_while_another_asks)
    with ThreadPoolExecutor(1) as other:
        assert put(1e3).status_code == 200
        assert later[0].result().status_code == 412
    assert rig_client.get("/api/rig/limits").json()["force"] == 1e3


def test_limits_that_cannot_be_stored_are_not_in_force(
    rig_client: httpx.Client, catalogue: Catalogue, acting: Acting
) -> None:
    before = rig_client.get("/api/rig/limits").json()
    with catalogue.writing() as session:
        session.execute(
            text("CREATE TRIGGER full BEFORE INSERT ON rig_limits BEGIN SELECT RAISE(ABORT, 'disk is full'); END")
        )
    refused = rig_client.put("/api/rig/limits", json=before | {"force": 1e3}, headers=acting())
    assert (refused.status_code, "disk is full" in refused.json()["detail"]) == (503, True)
    assert rig_client.get("/api/rig/limits").json() == before


def test_limits_that_this_version_does_not_know_are_refused(rig_settings: Settings, catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        save_rig_limits(session, rig_settings.rig, {"jerk": 1.0}, "a later version")
    with pytest.raises(RigError, match="do not fit this version"):
        RunManager(catalogue, rig_settings)
