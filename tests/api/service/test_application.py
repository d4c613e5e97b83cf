"""What the application closes when it is shut down."""

import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.queue import JobQueue
from jointlab.supervision.manager import RunManager
from rig.errors import RigError
from store.catalogue import Catalogue
from tests.api.service.conftest import served


def test_jobs_end_and_people_are_told_where_the_actuator_is_not_confirmed_at_rest(
    catalogue: Catalogue, rig: RunManager, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    jobs, closed, close = JobQueue(catalogue, ProcessExecutor(0)), list[JobQueue](), JobQueue.close

    def unconfirmed(_: RunManager) -> None:
        raise RigError("the actuator was not confirmed at rest")

    def note(queue: JobQueue) -> None:
        closed.append(queue)
        close(queue)

    with monkeypatch.context() as patched:
        patched.setattr(RunManager, "close", unconfirmed)
        patched.setattr(JobQueue, "close", note)
        with served(create_app(Services(catalogue, rig, jobs=jobs))) as client:
            assert client.get("/api/runs").status_code == 200
    assert closed == [jobs]
    assert [each.message for each in caplog.records if each.levelname == "ERROR"] == [
        "the actuator was not confirmed at rest"
    ]
