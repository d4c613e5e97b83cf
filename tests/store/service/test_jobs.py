"""Jobs: taken once, leased by heartbeats, queued again when a worker is lost, with exactly one result."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.service.jobs import (
    MOST_ATTEMPTS,
    Job,
    JobLostError,
    SignOfLife,
    add_job,
    cancel_job,
    count_open_jobs,
    fail_job,
    finish_job,
    get_job,
    list_jobs,
    list_series,
    lose_job,
    renew_lease,
    signs_of_life,
    take_job,
)
from store.states import JobState
from tests.databases import is_waiting
from tests.postgresql_server import Server
from tests.waiting import until

KINDS = ("identify", "trial")


@pytest.fixture
def job(catalogue: Catalogue) -> Job:
    with catalogue.writing() as session:
        return add_job(session, "identify", {"run": 1}, "bench")


@pytest.fixture
def take(catalogue: Catalogue) -> Callable[[], tuple[Job, str]]:
    def taken() -> tuple[Job, str]:
        with catalogue.writing() as session:
            found = take_job(session, KINDS)
        assert found is not None
        return found

    return taken


def now_is(catalogue: Catalogue, job: Job) -> Job:
    with catalogue.reading() as session:
        return get_job(session, job.id)


def test_the_most_urgent_kind_is_taken_first_and_no_other_than_those_asked_for(catalogue: Catalogue, job: Job) -> None:
    with catalogue.writing() as session:
        add_job(session, "trial", {}, "bench")
        add_job(session, "trial", {}, "bench")
        taken = [take_job(session, kinds) for kinds in (["export"], ["trial", "identify"], ["identify"], ["identify"])]
    assert [each and each[0].id for each in taken] == [None, 2, job.id, None]


def test_open_jobs_are_counted_for_each_who_asked(catalogue: Catalogue, job: Job) -> None:
    with catalogue.writing() as session:
        add_job(session, "trial", {}, "bench")
        assert (count_open_jobs(session, "bench"), count_open_jobs(session, "ann")) == (2, 0)
        take_job(session, KINDS)
        assert count_open_jobs(session, "bench") == 2
        cancel_job(session, job.id)
        assert count_open_jobs(session, "bench") == 1


def test_a_job_is_taken_once_and_the_oldest_first(catalogue: Catalogue, job: Job) -> None:
    with catalogue.writing() as session:
        add_job(session, "trial", {}, "bench")
        first, second, third = take_job(session, KINDS), take_job(session, KINDS), take_job(session, KINDS)
    assert first is not None
    assert second is not None
    assert (first[0].id, second[0].kind, third) == (job.id, "trial", None)
    assert first[1] != second[1]
    assert (first[0].state, first[0].attempts) == (JobState.RUNNING, 1)


def test_a_heartbeat_says_how_far_the_worker_is(
    catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]]
) -> None:
    _, token = take()
    with catalogue.writing() as session:
        renew_lease(session, job.id, token, "accelerances", 3, 110)
    found = now_is(catalogue, job)
    assert (found.stage, found.done, found.total, found.now) == ("accelerances", 3, 110, None)


def _done(session: Session, job: Job, token: str) -> None:
    finish_job(session, job.id, token, {})


def _failed(session: Session, job: Job, token: str) -> None:
    fail_job(session, job.id, token, "no")


def _cancelled(session: Session, job: Job, token: str) -> None:
    cancel_job(session, job.id)


def _lost(session: Session, job: Job, token: str) -> None:
    lose_job(session, job.id, token, "its process was killed")


@pytest.mark.parametrize("end", [_done, _failed, _cancelled, _lost])
def test_what_a_worker_has_found_so_far_goes_with_it(
    catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]], end: Callable[[Session, Job, str], None]
) -> None:
    _, token = take()
    with catalogue.writing() as session:
        renew_lease(session, job.id, token, "diagnosis", 42, 100, "first answer, not final: joint mass")
    assert now_is(catalogue, job).now == "first answer, not final: joint mass"
    with catalogue.writing() as session:
        end(session, job, token)
    found = now_is(catalogue, job)
    assert (found.stage, found.done, found.now) == ("diagnosis", 42, None)


def test_the_result_of_a_lost_worker_does_not_count(
    catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]]
) -> None:
    _, lost = take()
    with catalogue.writing() as session:
        lose_job(session, job.id, lost, "its process was killed")
    again, token = take()
    assert again.attempts == 2
    with pytest.raises(JobLostError), catalogue.writing() as session:
        finish_job(session, job.id, lost, {"by": "the lost one"})
    with catalogue.writing() as session:
        finish_job(session, job.id, token, {"by": "the second"})
    found = now_is(catalogue, job)
    assert (found.state, found.result, found.error) == (JobState.DONE, {"by": "the second"}, None)
    for late in (lost, token):
        with pytest.raises(JobLostError), catalogue.writing() as session:
            finish_job(session, job.id, late, {"by": "late"})
    assert now_is(catalogue, job).result == {"by": "the second"}


def test_every_job_that_is_worked_on_has_a_latest_sign_of_life(
    catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]]
) -> None:
    with catalogue.reading() as session:
        assert signs_of_life(session) == []
    taken, token = take()
    with catalogue.writing() as session:
        assert signs_of_life(session) == [SignOfLife(job.id, token, taken.heartbeat_at)]
        renew_lease(session, job.id, token, None, 0, 0)
    with catalogue.writing() as session:
        (sign,) = signs_of_life(session)
        assert sign.at is not None
        assert taken.heartbeat_at is not None
        assert sign.at > taken.heartbeat_at
        finish_job(session, job.id, token, {})
        assert signs_of_life(session) == []


def test_a_job_that_kills_its_workers_is_given_up(
    catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]]
) -> None:
    for _ in range(MOST_ATTEMPTS):
        _, token = take()
        with catalogue.writing() as session:
            lose_job(session, job.id, token, "its process was killed")
    found = now_is(catalogue, job)
    assert (found.state, found.attempts) == (JobState.FAILED, MOST_ATTEMPTS)
    assert found.error == "given up after 3 attempts; at the last one its process was killed"


def test_a_job_whose_service_was_stopped_is_never_given_up_for_that(
    catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]]
) -> None:
    for _ in range(MOST_ATTEMPTS + 1):
        _, token = take()
        with catalogue.writing() as session:
            lose_job(session, job.id, token, "the service was stopped", counts=False)
    found = now_is(catalogue, job)
    assert (found.state, found.error) == (JobState.QUEUED, "the service was stopped")


def test_a_cancelled_job_takes_no_result(catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]]) -> None:
    _, token = take()
    with catalogue.writing() as session:
        assert cancel_job(session, job.id).state is JobState.CANCELLED
    with pytest.raises(JobLostError), catalogue.writing() as session:
        renew_lease(session, job.id, token, None, 0, 0)
    with pytest.raises(JobLostError), catalogue.writing() as session:
        finish_job(session, job.id, token, {})
    with pytest.raises(JobLostError), catalogue.writing() as session:
        fail_job(session, job.id, token, "no")
    assert now_is(catalogue, job).state is JobState.CANCELLED


def test_a_job_that_is_over_stays_so_when_it_is_cancelled(
    catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]]
) -> None:
    _, token = take()
    with catalogue.writing() as session:
        fail_job(session, job.id, token, "run 1 holds nothing to identify from")
        assert cancel_job(session, job.id).state is JobState.FAILED
    assert now_is(catalogue, job).error == "run 1 holds nothing to identify from"


@pytest.mark.parametrize("database_kind", ["postgresql"])  # SQLite has one writer at a time
@pytest.mark.parametrize("ended", ["cancelled", "lost"])
def test_a_job_that_is_done_at_the_same_time_stays_done(
    catalogue: Catalogue, job: Job, take: Callable[[], tuple[Job, str]], postgresql: Server, ended: str
) -> None:
    _, token = take()

    def end() -> None:
        with catalogue.writing() as session:
            if ended == "cancelled":
                cancel_job(session, job.id)
            else:
                lose_job(session, job.id, token, "its worker gave no sign of life")

    with ThreadPoolExecutor(1) as other:
        with catalogue.writing() as session:
            finish_job(session, job.id, token, {"analysis": 7})
            session.flush()
            ending = other.submit(end)
            until(lambda: ending.done() or is_waiting(postgresql))
        ending.result()
    found = now_is(catalogue, job)
    assert (found.state, found.result) == (JobState.DONE, {"analysis": 7})


def test_jobs_are_listed_newest_first_and_filtered(catalogue: Catalogue, job: Job) -> None:
    with catalogue.writing() as session:
        second = add_job(session, "trial", {}, "bench")
        cancel_job(session, second.id)
        assert [each.id for each in list_jobs(session)] == [second.id, job.id]
        assert [each.id for each in list_jobs(session, before=second.id)] == [job.id]
        assert [each.id for each in list_jobs(session, kind="trial")] == [second.id]
        assert [each.id for each in list_jobs(session, state=JobState.QUEUED)] == [job.id]


def test_a_job_that_is_not_there_is_not_found(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        for read in (get_job, cancel_job):
            with pytest.raises(NotFoundError, match="no job 5"):
                read(session, 5)


def test_a_series_has_its_first_and_its_newest_job(catalogue: Catalogue, job: Job) -> None:
    with catalogue.writing() as session:
        alone = add_job(session, "investigate", {"run": 1, "state": {"steps": []}}, "bench")
        first = add_job(session, "investigate", {"run": 2, "state": {"steps": []}}, "bench")
        further = [add_job(session, "investigate", {"run": 2, "of": first.id}, who) for who in ("ann", "bob")]
        add_job(session, "identify", {"run": 2, "of": first.id}, "bench")  # of another kind
    with catalogue.reading() as session:

        def found(**wanted: int) -> list[tuple[Job, Job]]:
            return [(each.first, each.newest) for each in list_series(session, "investigate", "of", **wanted)]

        assert found() == [(first, further[1]), (alone, alone)]
        assert found(limit=1) == found(run_id=2) == found(number=first.id) == [(first, further[1])]
        assert found(before=first.id) == [(alone, alone)]
        assert found(number=further[0].id) == found(number=job.id) == found(run_id=3) == []
