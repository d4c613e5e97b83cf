"""What becomes of a job where the database is away while it is worked on."""

from collections.abc import Callable
from typing import Any

import pytest
from sqlalchemy.orm import Session

from jointlab.jobs.tasks import WORK, Save, Work
from jointlab.jobs.work import carry_out
from store.catalogue import Catalogue
from store.errors import ConnectionLostError, SilentError, StoreError, UnknownOutcomeError
from store.service.jobs import Job, add_job, finish_job, get_job, take_job
from store.states import JobState

Does = Callable[[Work], None]
CarriedOut = Callable[[], Job]


@pytest.fixture
def does(monkeypatch: pytest.MonkeyPatch) -> Does:
    """Let jobs of a kind do something else."""
    return lambda work: monkeypatch.setitem(WORK, "export", work)


@pytest.fixture
def carried_out(catalogue: Catalogue) -> CarriedOut:
    """Take a job, carry it out, and see what became of it."""

    def carry() -> Job:
        with catalogue.writing() as session:
            add_job(session, "export", {"run": 1, "form": "hdf5"}, "test")
            taken = take_job(session, ("export",))
        assert taken is not None
        job, token = taken
        carry_out(catalogue.place, job.id, token)
        return catalogue.read(get_job, job.id)

    return carry


@pytest.mark.parametrize("kind", [ConnectionLostError, SilentError])
def test_a_job_whose_database_went_away_is_queued_again(
    kind: type[StoreError], does: Does, carried_out: CarriedOut
) -> None:
    def work(*_: object) -> Save:
        raise kind("the database was restarted")

    does(work)
    job = carried_out()
    assert (job.state, job.attempts, job.error) == (JobState.QUEUED, 1, "the database was restarted")


def test_a_result_is_stored_once_more_where_the_connection_was_lost(does: Does, carried_out: CarriedOut) -> None:
    tried = list[Session]()

    def save(session: Session) -> dict[str, Any]:
        tried.append(session)
        if len(tried) == 1:
            raise ConnectionLostError("the line was cut")
        return {"file": "name"}

    does(lambda *_: save)
    job = carried_out()
    assert (job.state, job.attempts, job.result) == (JobState.DONE, 1, {"file": "name"})


@pytest.mark.parametrize("is_stored", [False, True])
def test_a_result_of_which_it_is_not_known_whether_it_was_stored_is_there_once(
    is_stored: bool, does: Does, carried_out: CarriedOut, monkeypatch: pytest.MonkeyPatch
) -> None:
    def finish(session: Session, job_id: int, token: str, result: dict[str, Any]) -> None:
        if is_stored:
            finish_job(session, job_id, token, result)
            session.commit()
        raise UnknownOutcomeError("the line was cut")

    monkeypatch.setattr("jointlab.jobs.work.finish_job", finish)
    does(lambda *_: lambda _session: {"file": "name"})
    job = carried_out()
    assert (job.state, job.result) == ((JobState.DONE, {"file": "name"}) if is_stored else (JobState.QUEUED, None))


def test_what_is_missing_in_the_database_fails_a_job(does: Does, carried_out: CarriedOut) -> None:
    def work(*_: object) -> Save:
        raise StoreError("there is no run 1")

    does(work)
    job = carried_out()
    assert (job.state, job.error) == (JobState.FAILED, "there is no run 1")
