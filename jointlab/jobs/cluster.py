"""The workers of the dask cluster that a job runs on, for parts of the job that do not need each other."""

import sys
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager

from jointlab.errors import JointlabError


class ClusterLostError(JointlabError):
    """The cluster was lost in the middle of a job, which may go on where it ended."""


@contextmanager
def other_workers() -> Iterator[tuple[Executor, int] | None]:
    """All workers of this job's cluster as an executor, and their number of threads; None if there is no cluster.

    The thread of the job itself is free for parts meanwhile. A part whose worker dies is done by another one.

    Raises ClusterLostError where the scheduler is lost.
    """
    distributed = sys.modules.get("distributed")  # a worker has loaded it
    try:
        if distributed is None:
            raise ValueError("no cluster")
        distributed.get_worker()
    except ValueError:
        yield None
        return
    with distributed.worker_client() as client:
        try:
            yield client.get_executor(pure=False), sum(client.nthreads().values())
        except CancelledError as error:
            raise ClusterLostError("the dask cluster was lost; the job goes on where it ended") from error
