"""Disk full, database locked, a folder that cannot be written: said in words, nothing lost, and it goes on after."""

import resource
import sqlite3
import time
from contextlib import closing
from pathlib import Path

import httpx
import pytest

from jointlab.client import Client, ProblemError
from jointlab.supervision.manager import RunManager
from store.backup.check import check
from store.catalogue import Catalogue
from store.states import RunState
from tests.api.commands.test_service import serving_process
from tests.api.conftest import paper
from tests.api.service.conftest import PROBLEM, Acting
from tests.waiting import LONG, until

SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 110, "step": 3},
}  # fmt: skip


def test_a_locked_database_is_a_503_and_the_same_request_is_done_once_it_is_free(
    impatient: None, client: httpx.Client, acting: Acting, tmp_path: Path
) -> None:
    headers, body = acting(), {"name": "page", "scopes": ["read:data"]}
    with closing(sqlite3.connect(tmp_path / "jointlab.db", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        refused = client.post("/api/keys", json=body, headers=headers)
        assert (refused.status_code, refused.headers["content-type"]) == (503, PROBLEM)
        assert "another program is writing" in refused.json()["detail"]
        assert client.get("/api/runs").status_code == 200  # readers do not wait
    assert client.post("/api/keys", json=body, headers=headers).status_code == 201


def test_a_folder_of_waveforms_that_cannot_be_written_delays_what_is_stored_and_no_run(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, catalogue: Catalogue
) -> None:
    catalogue.waveforms.folder.write_text("not a folder")
    lease = rig_client.post("/api/rig/lease", json={"holder": "test"}, headers=acting()).json()["token"]
    run = rig_client.post("/api/runs", json={"sequence": paper() | {"steps": [SWEEP]}}, headers=acting()).json()["id"]
    started = rig_client.post(f"/api/runs/{run}/start", json={"automatic": True}, headers=acting(lease=lease))
    assert started.status_code == 200, started.text
    until(lambda: rig.state.ended_as is RunState.FINISHED)
    assert rig_client.get(f"/api/runs/{run}").json()["state"] != "finished"
    catalogue.waveforms.folder.unlink()
    assert rig.wait(LONG)
    assert rig_client.get(f"/api/runs/{run}").json()["state"] == "finished"
    assert len(rig_client.get(f"/api/runs/{run}/sine-records").json()["items"]) == 31


def drive_process_of(service: int) -> int:
    """Number of the drive process that a service has started."""
    children = Path(f"/proc/{service}/task/{service}/children").read_text().split()
    return next(int(child) for child in children if "jointlab.drive" in Path(f"/proc/{child}/cmdline").read_text())


def test_a_full_disk_ends_a_run_with_a_reason_and_it_continues_once_there_is_space(tmp_path: Path) -> None:
    with serving_process(tmp_path, "--simulated", "--speed", "50") as (address, process), Client(address) as lab:
        run, driving = lab.create_run(paper() | {"steps": [SWEEP]}), drive_process_of(process.pid)
        with lab.driving("test") as driver:
            driver.start(run.id, automatic=True)
            while lab.rig().sines < 3:
                time.sleep(0.02)
            _, hard = resource.prlimit(driving, resource.RLIMIT_FSIZE)
            resource.prlimit(driving, resource.RLIMIT_FSIZE, (20_000, hard))  # what a full disk is to a process
            while lab.rig().phase != "idle":
                time.sleep(0.02)
            ended = lab.rig()
            assert ended.ended_as == "failed"
            assert "repair or empty the disk" in str(ended.reason), ended.reason
            with pytest.raises(ProblemError, match=r"disk") as caught:
                driver.resume(run.id, automatic=True)
            assert caught.value.status == 503
            resource.prlimit(driving, resource.RLIMIT_FSIZE, (hard, hard))
            driver.resume(run.id, automatic=True)
            assert lab.wait_for_run(run.id).state is RunState.FINISHED
        records = list(lab.sine_records(run.id))
    assert [record.order_number for record in records] == list(range(1, 32))
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        assert [finding for finding in check(catalogue) if finding.damage] == []
