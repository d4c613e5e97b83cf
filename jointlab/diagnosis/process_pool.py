"""Processes that do the work of a diagnosis side by side."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import forkserver
from typing import TypeVar

from analysis.gap import diagnosis
from analysis.gap.search import ParallelMap, serial_map

Item = TypeVar("Item")
Result = TypeVar("Result")
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
SHARES = 4
"""Into which each process's part of a task is divided, so that none waits long for the others."""


@contextmanager
def processes(count: int | None = None) -> Iterator[ParallelMap]:
    """ParallelMap that are `count` processes, by default as many as there are processors.

    They are forked from a server that has loaded what they need. A job of the service may have no processes of its own:
    there, and for a count of one, all is done one by one.
    """
    wanted = count or os.cpu_count() or 1
    if wanted == 1 or multiprocessing.current_process().daemon:
        yield serial_map
        return
    one_thread_each()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["__main__", diagnosis.__name__])
    forkserver.ensure_running()  # it loads while the first steps are taken, which nobody can share
    with ProcessPoolExecutor(wanted, mp_context=context) as pool:

        def together(work: Callable[[Item], Result], items: Sequence[Item], /) -> Iterable[Result]:
            return pool.map(work, items, chunksize=max(1, len(items) // (SHARES * wanted)))

        yield together


def one_thread_each() -> None:
    """Keep processes that are yet to begin from more threads of BLAS than one; call it before they load numpy."""
    for name in THREADS:
        os.environ.setdefault(name, "1")
