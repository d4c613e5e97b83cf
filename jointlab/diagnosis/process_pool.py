"""A pool of processes for the fits of a diagnosis."""

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import forkserver
from typing import TypeVar

from analysis.gap import diagnosis
from analysis.gap.search.single_effects import ParallelMap, serial_map

Item = TypeVar("Item")
Result = TypeVar("Result")
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
SHARES = 4
"""Chunks into which the part of each process is divided, so that no process waits long for the others."""


@contextmanager
def processes(count: int | None = None) -> Iterator[ParallelMap]:
    """A parallel map over `count` processes, by default as many as there are processors.

    They are forked from a server that has loaded the diagnosis. A job of the service may not start processes: there,
    and for a count of one, the map is serial.
    """
    wanted = count or os.cpu_count() or 1
    if wanted == 1 or multiprocessing.current_process().daemon:
        yield serial_map
        return
    one_thread_each()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["__main__", diagnosis.__name__])
    forkserver.ensure_running()  # it loads during the first steps, which are serial
    with ProcessPoolExecutor(wanted, mp_context=context) as pool:

        def parallel_map(work: Callable[[Item], Result], items: Sequence[Item], /) -> Iterable[Result]:
            return pool.map(work, items, chunksize=max(1, len(items) // (SHARES * wanted)))

        yield parallel_map


def one_thread_each() -> None:
    """Limit BLAS to one thread in processes that start later; they must not have loaded numpy."""
    for name in THREADS:
        os.environ.setdefault(name, "1")
