"""Investigations of the service: each step is a job, and the jobs of an investigation hold all of its state.

The first job has the number of the investigation; each further one names it. A job takes the investigation with the
answer to its last request, diagnoses all data, and has the investigation with the next step as its result. So an
answer and its diagnosis are stored once, nothing of it is changed later, and a restart of the service loses nothing.
Where a job fails or is cancelled, its answer does not count, and the request is open again.

An investigation moves no machine: it asks for a run, which is begun like any other.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import Any

from sqlalchemy.orm import Session

from analysis.gap.experiments.joined_measurements import check_same_bench, together
from jointlab.diagnosis.conditions import conditions_of_run
from jointlab.diagnosis.investigation import (
    INVESTIGATION,
    Answer,
    Asked,
    Budget,
    Data,
    Investigation,
    with_answer,
    with_budget,
    with_missing,
    without_answer,
)
from jointlab.diagnosis.load import drawing_of
from jointlab.errors import ConflictError
from jointlab.jobs.queue import JobQueue
from jointlab.sequences.of_run import sequence_for_experiment
from rig.sequences.sequence import Sequence
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.exchange.bundle_setup import article_from
from store.measurements.runs import Run, get_run, list_runs
from store.service.jobs import Job, JobSeries, add_job, cancel_job, list_series, lock_job
from store.states import OPEN_JOB_STATES, InvestigationState, JobState, RunState

KIND, INVESTIGATION_PARAMETER = "investigate", "investigation"
MOST_RUNS_SEARCHED = 200
"""Newest finished runs of an article that are searched for one that may answer a request."""


@dataclass(frozen=True)
class StoredInvestigation:
    """An investigation of the service.

    Attributes:
        first: its first job.
        job: its newest job.
        investigation: with its steps; an answer counts while its job is at work and when that is done.
        state: what it does at present.
    """

    first: Job
    job: Job
    investigation: Investigation
    state: InvestigationState

    @property
    def id(self) -> int:
        """Its number."""
        return self.first.id

    @property
    def run(self) -> int:
        """Number of the run with the first data."""
        return int(self.investigation.target)

    @property
    def name(self) -> str:
        """Its name in a sentence."""
        return f"investigation {self.id}"


def get_investigation(session: Session, number: int) -> StoredInvestigation:
    """One investigation, or NotFoundError."""
    found = list_series(session, KIND, INVESTIGATION_PARAMETER, number=number)
    if not found:
        raise NotFoundError(f"there is no investigation {number}")
    return _stored(found[0])


def list_investigations(
    session: Session, *, run_id: int | None = None, before: int | None = None, limit: int = 100
) -> list[StoredInvestigation]:
    """Investigations, those begun last first; a page begins before the number `before`."""
    return [
        _stored(each)
        for each in list_series(session, KIND, INVESTIGATION_PARAMETER, run_id=run_id, before=before, limit=limit)
    ]


def begin(queue: JobQueue, run_id: int, budget: Budget, who: str) -> StoredInvestigation:
    """Begin an investigation of the gap of a run.

    Raises:
        NotFoundError: there is no such run.
        ConflictError: the run was not finished, or another investigation of it with this budget has just begun.
        QuotaError, StoreError: as of `JobQueue.add`.
    """
    state = Investigation(str(run_id), budget)
    job = queue.add(
        KIND, _parameters(state), who, once=True, check=lambda session: _check_finished(get_run(session, run_id))
    )
    return StoredInvestigation(job, job, state, InvestigationState.WORKING)


def answer(queue: JobQueue, catalogue: Catalogue, number: int, given: Answer, who: str) -> StoredInvestigation:
    """Take the answer to what an investigation asks for; it then diagnoses all data again.

    Raises:
        NotFoundError: there is no such investigation, or no such run.
        ConflictError: it does not wait for an answer, or the run was not finished.
        JointlabError, AnalysisError: the answer is not to what was asked for, or the run is of another bench or has
            nothing of what was asked for.
        QuotaError, StoreError: as of `JobQueue.add`.
    """
    with catalogue.reading() as session:
        found = get_investigation(session, number)
        after = with_answer(found.investigation, given, found.name)
        if isinstance(given, Data):
            further = get_run(session, int(given.source))
            _check_run(get_run(session, found.run), further)
            before = (conditions_of_run(session, get_run(session, int(each))) for each in found.investigation.sources)
            after = with_missing(after, reduce(together, before), conditions_of_run(session, further))
    return _queued(queue, found, after, who)


def go_on(
    queue: JobQueue, catalogue: Catalogue, number: int, who: str, budget: Callable[[Budget], Budget] | None = None
) -> StoredInvestigation:
    """Go on with an investigation that was stopped, has failed, or has spent its budget.

    Args:
        queue: for the next job.
        catalogue: that has the investigation.
        number: of the investigation.
        who: asks for it.
        budget: gives another budget from the present one.

    Raises:
        NotFoundError: there is no such investigation.
        ConflictError: there is nothing to go on with.
        QuotaError, StoreError: as of `JobQueue.add`.
    """
    with catalogue.reading() as session:
        found = get_investigation(session, number)
    if found.state in (InvestigationState.WORKING, InvestigationState.WAITING):
        raise ConflictError(f"{found.name} is {found.state}; it goes on by itself, or with the answer")
    ended = found.state is InvestigationState.ENDED
    before = found.investigation if ended else _given(found.job)
    after = before if budget is None else with_budget(before, budget(before.budget))
    if ended and after.steps == before.steps:
        raise ConflictError(f"{found.name} has ended; it goes on only where its budget was spent, with a larger one")
    return _queued(queue, found, after, who)


def stop(queue: JobQueue, catalogue: Catalogue, number: int, who: str) -> StoredInvestigation:
    """Stop an investigation; one that has ended or was stopped stays as it is.

    Raises:
        NotFoundError: there is no such investigation.
        StoreError: it cannot be stored.
    """
    while True:
        with catalogue.writing() as session:
            lock_job(session, number)
            found = get_investigation(session, number)
            if found.state in (InvestigationState.WAITING, InvestigationState.FAILED):
                # a job that is cancelled before it begins notes who stopped it, and when
                waiting = add_job(session, KIND, _parameters(found.investigation, number), who)
                cancel_job(session, waiting.id)
        if found.state is not InvestigationState.WORKING:
            return catalogue.read(get_investigation, number)
        queue.cancel(found.job.id)  # if the job has ended meanwhile, the investigation may wait now: look again


def sequence_for_request(session: Session, number: int, limits: TesterLimits) -> tuple[Asked, Sequence]:
    """The experiment that an investigation asks for, and the sequence for it within the tester's `limits`.

    Raises:
        NotFoundError: there is no such investigation.
        ConflictError: it asks for nothing, or for readings.
        StoreError, RigError: the stored data make no sequence.
    """
    found = get_investigation(session, number)
    asked = found.investigation.open_request
    if asked is None or found.state is InvestigationState.WORKING:
        raise ConflictError(f"{found.name} asks for no experiment")
    if asked.readings:
        raise ConflictError(f"{found.name} asks for readings of {', '.join(asked.readings)}, which need no sequence")
    return asked, sequence_for_experiment(session, found.run, asked.experiment, limits)


def offered_runs(session: Session, found: StoredInvestigation) -> list[Run]:
    """Finished runs of the same article that may answer the request: those not used so far, newest first."""
    article = get_run(session, found.run).article
    used = found.investigation.sources
    runs = list_runs(session, state=RunState.FINISHED, article=article, limit=MOST_RUNS_SEARCHED)
    return [run for run in runs if str(run.id) not in used]


def investigations_waiting_for(session: Session, run: Run) -> list[StoredInvestigation]:
    """Of the newest investigations those that wait for a measurement, where a finished run may be it.

    The run is of the same article and began after the request.
    """
    if run.state is not RunState.FINISHED:
        return []
    waiting = [each for each in list_investigations(session) if each.state is InvestigationState.WAITING]
    return [
        each
        for each in waiting
        if (asked := each.investigation.open_request) is not None
        and not asked.readings
        and str(run.id) not in each.investigation.sources
        and each.job.finished_at is not None
        and run.started_at > each.job.finished_at
        and get_run(session, each.run).article == run.article
    ]


def _queued(queue: JobQueue, found: StoredInvestigation, after: Investigation, who: str) -> StoredInvestigation:
    """Queue the next job, unless another one was queued since `found` was read."""

    def check(session: Session) -> None:
        lock_job(session, found.id)
        now = get_investigation(session, found.id)
        if (now.job.id, now.job.state) != (found.job.id, found.job.state):
            raise ConflictError(f"{found.name} has gone on meanwhile and is {now.state}; read it again")

    job = queue.add(KIND, _parameters(after, found.id), who, check=check)
    return StoredInvestigation(found.first, job, after, InvestigationState.WORKING)


def _parameters(state: Investigation, number: int | None = None) -> dict[str, Any]:
    """Of a job that goes on from this state; `number` is that of its investigation, None for a new one."""
    parameters = {"run": int(state.target), "state": INVESTIGATION.dump_python(state, mode="json")}
    return parameters if number is None else parameters | {INVESTIGATION_PARAMETER: number}


def _stored(series: JobSeries) -> StoredInvestigation:
    newest = series.newest
    if newest.result is not None:
        done = INVESTIGATION.validate_python(newest.result["state"])
        waits = done.open_request is not None
        return StoredInvestigation(
            series.first, newest, done, InvestigationState.WAITING if waits else InvestigationState.ENDED
        )
    given = _given(newest)
    if newest.state in OPEN_JOB_STATES:
        return StoredInvestigation(series.first, newest, given, InvestigationState.WORKING)
    stopped = newest.state is JobState.CANCELLED
    state = InvestigationState.STOPPED if stopped else InvestigationState.FAILED
    return StoredInvestigation(series.first, newest, without_answer(given), state)


def _given(job: Job) -> Investigation:
    return INVESTIGATION.validate_python(job.parameters["state"])


def _check_run(first: Run, further: Run) -> None:
    """Do nothing where a finished run is of the bench of the first one; the data themselves are checked by the job."""
    _check_finished(further)
    check_same_bench(*(drawing_of(article_from(each.setup)) for each in (first, further)))


def _check_finished(run: Run) -> None:
    if run.state is not RunState.FINISHED:
        raise ConflictError(f"run {run.id} is {run.state}, and not finished")
