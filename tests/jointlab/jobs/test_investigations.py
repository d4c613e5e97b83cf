"""Investigations as jobs: of two answers at a time one counts, on both databases, and stopping waits for nothing."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest

from jointlab.diagnosis.investigation import Answer, Readings, Refused
from jointlab.errors import ConflictError
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.investigations import StoredInvestigation, answer, get_investigation, list_investigations, stop
from jointlab.jobs.queue import JobQueue
from store.catalogue import Catalogue
from store.service.jobs import list_jobs, take_job
from store.states import InvestigationState, JobState
from tests.investigations import DELAY, READING, add_waiting

BOTH = pytest.mark.parametrize("database_kind", ["sqlite", "postgresql"])


@pytest.fixture
def idle(catalogue: Catalogue) -> Iterator[JobQueue]:
    """A queue without workers."""
    made = JobQueue(catalogue, ProcessExecutor(0))
    yield made
    made.close()


@BOTH
def test_of_two_answers_at_a_time_one_counts(catalogue: Catalogue, idle: JobQueue) -> None:
    number = add_waiting(catalogue, 1, READING).id
    together = Barrier(2)

    def give(given: Answer) -> StoredInvestigation | ConflictError:
        together.wait()
        try:
            return answer(idle, catalogue, number, given, "ann")
        except ConflictError as error:
            return error

    with ThreadPoolExecutor(2) as threads:
        found = list(threads.map(give, (Readings({"channel_delay.tau": DELAY}), Refused("no free mass here"))))
    (taken,) = [each for each in found if isinstance(each, StoredInvestigation)]
    (queued,) = catalogue.read(list_jobs, state=JobState.QUEUED)
    assert queued == taken.job
    assert catalogue.read(get_investigation, number) == taken


@BOTH
def test_one_that_waits_or_works_is_stopped_and_its_work_does_not_count(catalogue: Catalogue, idle: JobQueue) -> None:
    waits = add_waiting(catalogue, 1, READING)
    stopped = stop(idle, catalogue, waits.id, "ann")
    assert (stopped.state, stopped.investigation) == (InvestigationState.STOPPED, waits.investigation)
    assert stopped.job.asked_by == "ann"
    answer(idle, catalogue, waits.id, Refused("no free mass here"), "bob")
    with catalogue.writing() as session:
        assert take_job(session, ["investigate"]) is not None  # a worker is at it
    assert stop(idle, catalogue, waits.id, "ann").investigation == waits.investigation
    assert [each.id for each in catalogue.read(list_investigations)] == [waits.id]
