"""Executors of jobs: processes of this computer, or a dask.distributed cluster."""

import logging
import multiprocessing
import socket
import time
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.context import ForkServerProcess
from typing import Any, Protocol
from urllib.parse import urlsplit

from jointlab.errors import JointlabError
from jointlab.logs import LogSettings
from store.catalogue import CatalogueParts
from store.extras import explained_imports

GRACE = 5.0  # s that a process has to end when it is told to
RETRY = 1.0  # s between two attempts to reach a scheduler
CONNECT = 2.0  # s that a scheduler has to answer
WORK = "jointlab.jobs.work"
"""Imported where a job is done alone: identification and diagnosis take a second that no service is to wait for."""
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Lost:
    """A job whose worker has ended without a result.

    Attributes:
        token: that it was taken with.
        counts: whether that may be the job's own fault; after some of them it is given up.
    """

    job_id: int
    token: str
    why: str
    counts: bool = True


class Executor(Protocol):
    """Carries out jobs, as many at a time as it has room for; used by one thread.

    Attributes:
        trouble: why it can begin none at all, or None; any thread may read it.
    """

    trouble: str | None

    def has_room(self, beyond: int = 0) -> bool:
        """Whether it could begin another job with `beyond` more places than it has."""

    def begin(self, place: CatalogueParts, job_id: int, token: str) -> None:
        """Begin a job that was taken with `token`."""

    def lost(self) -> list[Lost]:
        """Jobs whose workers ended without a result since the last call."""

    def drop(self, job_id: int) -> None:
        """End the work on a job."""

    def close(self) -> list[Lost]:
        """End all work; returns the jobs that were not over."""


class ProcessExecutor:
    """Processes of this computer, one for each job, so that a job that is dropped or dies does not affect another.

    They are forked from a server that has loaded every module that they need, so that a process begins quickly.
    """

    trouble: str | None = None

    def __init__(self, workers: int = 1, logs: LogSettings | None = None) -> None:
        self._logs = logs
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(["__main__", WORK])
        self._workers = workers
        self._processes = dict[int, tuple[ForkServerProcess, str]]()

    def has_room(self, beyond: int = 0) -> bool:
        """Whether another process may begin."""
        return len(self._processes) < self._workers + beyond

    def begin(self, place: CatalogueParts, job_id: int, token: str) -> None:
        """Begin a job in a process of its own."""
        arguments = (place, job_id, token, self._logs)
        process = self._context.Process(target=_carry_out, args=arguments, name=f"job {job_id}", daemon=True)
        process.start()
        self._processes[job_id] = (process, token)

    def lost(self) -> list[Lost]:
        """Jobs whose processes died; a process that ended by itself has stored the result of its job."""
        ended = {job: held for job, held in self._processes.items() if held[0].exitcode is not None}
        for job in ended:
            del self._processes[job]
        return [
            Lost(job, token, f"its process ended with exit code {process.exitcode}")
            for job, (process, token) in ended.items()
            if process.exitcode != 0
        ]

    def drop(self, job_id: int) -> None:
        """End the process of a job."""
        if job_id in self._processes:
            process, _ = self._processes.pop(job_id)
            process.terminate()
            process.join(GRACE)
            if process.exitcode is None:
                process.kill()
                process.join()

    def close(self) -> list[Lost]:
        """End every process."""
        held = self._processes.items()
        left = [Lost(job, token, "the service was stopped", counts=False) for job, (_, token) in held]
        for each in left:
            self.drop(each.job_id)
        return left


class DaskExecutor:
    """A dask.distributed cluster, whose workers take database and folder of waveforms from their own configuration.

    A scheduler may come late, die and come back: it is tried again every `RETRY` s, and `trouble` tells meanwhile. What
    workers do without it goes on; a job whose worker died with it is found by its missing heartbeat.

    Raises MissingExtraError where dask is not installed, JointlabError where `address` is none.
    """

    def __init__(self, address: str) -> None:
        with explained_imports():
            self._connect: Any = import_module("distributed").Client
        self._address = address
        self._host = _host_of(address)
        self._client: Any = None
        self._tried = -RETRY
        self._futures = dict[int, tuple[Any, str]]()
        self.trouble: str | None = None

    def has_room(self, beyond: int = 0) -> bool:
        """Whether fewer jobs are in dask than its workers have threads, plus `beyond`; dask queues any further jobs."""
        if not self._is_connected():
            return False
        try:
            threads = int(sum(self._client.nthreads().values()))
        except (OSError, AttributeError) as error:  # the latter of a client that closes itself at this moment
            self._leave(f"the dask scheduler at {self._address} is lost: {error}")
            return False
        self._say(None if threads else f"no worker (jointlab worker) has joined the dask scheduler at {self._address}")
        return len(self._futures) < threads + (beyond if threads else 0)

    def begin(self, _place: CatalogueParts, job_id: int, token: str) -> None:
        """Send a job to a worker; if that dies, dask sends the job to another one, where the same token is valid."""
        if not self._is_connected():
            raise JointlabError(self.trouble or f"the dask scheduler at {self._address} is lost")
        future = self._client.submit(_carry_out_as_configured, job_id, token, key=f"job-{token}", pure=False)
        self._futures[job_id] = (future, token)

    def lost(self) -> list[Lost]:
        """Jobs that dask has given up."""
        over = {job: held for job, held in self._futures.items() if held[0].done()}
        for job in over:
            del self._futures[job]
        return [
            Lost(job, token, f"its worker ended: {future.exception()}")
            for job, (future, token) in over.items()
            if future.status == "error"
        ]

    def drop(self, job_id: int) -> None:
        """Cancel a job; a worker that has begun it learns this from its next heartbeat."""
        if self._is_connected() and (held := self._futures.pop(job_id, None)) is not None:
            held[0].cancel()

    def close(self) -> list[Lost]:
        """Leave the cluster; its workers finish the jobs that they have begun, and store the results."""
        self._leave(None)
        return []

    def _is_connected(self) -> bool:
        if self._client is not None and self._client.status == "running":
            return True
        if self._client is not None:
            self._leave(f"the dask scheduler at {self._address} is lost")
        if time.monotonic() - self._tried < RETRY:
            return False
        self._tried = time.monotonic()
        try:
            # a client without a scheduler reports this for ever: look first
            socket.create_connection(self._host, CONNECT).close()
            self._client = self._connect(self._address, timeout=CONNECT, set_as_default=False)
        except OSError as error:
            self._say(f"no dask scheduler answers at {self._address}: {error}")
            return False
        self._say(None)
        return True

    def _leave(self, why: str | None) -> None:
        self._futures.clear()
        client, self._client = self._client, None
        self._say(why)
        if client is not None and client.status != "closed":
            client.close(timeout=CONNECT)

    def _say(self, trouble: str | None) -> None:
        if trouble != self.trouble:
            log.warning("%s", trouble) if trouble else log.info("the dask scheduler at %s answers", self._address)
        self.trouble = trouble


def _carry_out(*arguments: Any) -> None:
    import_module(WORK).carry_out(*arguments)


def _carry_out_as_configured(job_id: int, token: str) -> None:
    import_module(WORK).carry_out_as_configured(job_id, token)


def _host_of(address: str) -> tuple[str, int]:
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if host is None or port is None:
        raise JointlabError(f"{address!r} is no address of a dask scheduler; write tcp://host:8786")
    return host, port
