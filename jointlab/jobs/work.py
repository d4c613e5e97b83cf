"""One job in the process of a worker: its work, its heartbeat, and its result in one transaction."""

import logging
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self

from threadpoolctl import threadpool_limits

from jointlab.errors import EXPECTED, JointlabError
from jointlab.jobs.cluster import ClusterLostError
from jointlab.jobs.kinds import RefusedJobError, trial_folder
from jointlab.jobs.tasks import work_of
from jointlab.logs import LogSettings, belonging_to, write_logs
from jointlab.memory import give_memory_back
from jointlab.settings import load_settings
from jointlab.traces import FAILED, flush_traces, happened, send_traces, span
from rig.errors import failure_reason
from store.catalogue import Catalogue, CatalogueParts
from store.errors import ConnectionLostError, SilentError, StoreError, UnknownOutcomeError
from store.progress import Advance
from store.service.jobs import JobLostError, fail_job, finish_job, get_job, lose_job, renew_lease, signs_of_life

BEAT = 1.0  # s
AWAY = ConnectionLostError, SilentError, UnknownOutcomeError
"""Errors of a database that is away for a moment, which say nothing about the job."""
log = logging.getLogger(__name__)


class JobHeartbeat:
    """Stores a sign of life and the progress every second. A context manager, and the `Progress` of the work."""

    def __init__(self, catalogue: Catalogue, job_id: int, token: str) -> None:
        self._catalogue = catalogue
        self._job_id = job_id
        self._token = token
        self._at: tuple[str | None, int, int, str] = (None, 0, 0, "")
        self._ended = threading.Event()
        self._lost: JobLostError | None = None
        self._thread = threading.Thread(target=self._beat, name=f"job {job_id}", daemon=True)

    @contextmanager
    def __call__(self, what: str, total: int) -> Iterator[Advance]:
        """Work on `what`, in `total` steps.

        Raises JobLostError where the job was cancelled, or given to another worker.
        """
        count = 0
        happened(what)

        def advance(done: int, now: str = "") -> None:
            nonlocal count
            if self._lost is not None:
                raise self._lost
            count += done
            self._at = (what, count, total, now)

        advance(0)
        yield advance

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _beat(self) -> None:
        while not self._ended.is_set():
            try:
                with self._catalogue.writing() as session:
                    renew_lease(session, self._job_id, self._token, *self._at)
            except JobLostError as lost:
                self._lost = lost
                return
            except StoreError as error:
                # the lease lasts for many beats; if it ends all the same, the result will be refused
                log.warning("job %s: a heartbeat could not be stored: %s", self._job_id, error)
            self._ended.wait(BEAT)


def carry_out(place: CatalogueParts, job_id: int, token: str, logs: LogSettings | None = None) -> None:
    """Carry out a job that was taken with `token`, and store its result.

    Args:
        place: of the catalogue.
        token: that it was taken with.
        logs: what this process writes into its log; None leaves that as it is.

    Raises:
        StoreError: the end of the job cannot be stored; it will be queued again.
    """
    if logs is not None:
        write_logs(logs)
        send_traces(logs.traces, "jointlab job")
    try:
        with threadpool_limits(1), Catalogue.open(*place) as catalogue:
            _carry_out(catalogue, job_id, token)
    finally:
        flush_traces()


def carry_out_as_configured(job_id: int, token: str) -> None:
    """Carry out a job of the database that this computer's configuration names; arguments are those of `carry_out`.

    Raises:
        JointlabError: that database does not have the job as it was taken.
        SettingsError, StoreError: the database cannot be opened, or the result cannot be stored.
    """
    settings = load_settings()
    place = settings.database_url, settings.waveform_folder, settings.database_limits
    try:
        with threadpool_limits(1), Catalogue.open(*place) as catalogue:
            with catalogue.reading() as session:
                taken = any((sign.job_id, sign.token) == (job_id, token) for sign in signs_of_life(session))
            if not taken:
                raise JointlabError(
                    f"{catalogue.address} does not have job {job_id} as it was taken; "
                    "set database_url and waveform_folder of this worker to those of the service"
                )
            _carry_out(catalogue, job_id, token)
    finally:
        give_memory_back()  # a worker lives long, and rests between jobs


def _carry_out(catalogue: Catalogue, job_id: int, token: str) -> None:
    job = catalogue.read(get_job, job_id)
    about = {"run": int(job.parameters["run"])} if "run" in job.parameters else {}
    with (
        belonging_to(job=job_id, **about),
        span(f"job {job.kind}", job=job_id, attempt=job.attempts, **about) as opened,
    ):
        log.info("job %s (%s) begins, attempt %s", job_id, job.kind, job.attempts)
        try:
            with JobHeartbeat(catalogue, job_id, token) as progress:
                keep = work_of(job.kind)(catalogue, job, progress)
            catalogue.write(lambda session: finish_job(session, job_id, token, keep(session)))
            # the work of a trial; its scores are stored now
            shutil.rmtree(trial_folder(catalogue, job_id), ignore_errors=True)
            log.info("job %s is done", job_id)
        except JobLostError as lost:
            log.info("%s", lost)
        except (ClusterLostError, *AWAY) as lost:  # another attempt may do it; where all was stored, nothing is lost
            log.warning("job %s is lost: %s", job_id, lost)
            with catalogue.writing() as session:
                lose_job(session, job_id, token, str(lost))
        except Exception as error:
            if not isinstance(error, EXPECTED):
                log.exception("job %s ended with an unexpected error", job_id)
            opened.attributes[FAILED] = type(error).__name__
            cause = error.cause if isinstance(error, RefusedJobError) else None
            _fail(catalogue, job_id, token, failure_reason(error, EXPECTED), cause)


def _fail(catalogue: Catalogue, job_id: int, token: str, why: str, cause: dict[str, Any] | None) -> None:
    try:
        with catalogue.writing() as session:
            fail_job(session, job_id, token, why, cause)
    except JobLostError as lost:
        log.info("%s", lost)
