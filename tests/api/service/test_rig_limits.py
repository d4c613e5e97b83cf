"""The rig's limits over REST: in force at once, and again after a restart."""

from contextlib import closing

import httpx
import pytest
from sqlalchemy import text

from jointlab.settings import Settings
from jointlab.supervision.manager import RunManager
from rig.errors import RigError
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
