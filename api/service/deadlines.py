"""Waiting for the database in another thread, with a deadline: the event loop never waits, no caller waits forever."""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from store.errors import SilentError

ResultT = TypeVar("ResultT")
LONGEST_LOOKUP = 5.0
"""Seconds that a request waits for the lookup of its key."""
STOP_LOOKUP = 0.5
"""Seconds that a request that ends or pauses a run waits for it; where it takes longer, that is done, too."""


async def within(seconds: float, pool: ThreadPoolExecutor, do: Callable[..., ResultT], *arguments: Any) -> ResultT:
    """The result of `do` in a thread of `pool`, which goes on if it is late.

    Raises:
        SilentError: it has not returned within `seconds`.
        Exception: what `do` raises.
    """
    working = asyncio.get_running_loop().run_in_executor(pool, do, *arguments)
    done, _ = await asyncio.wait({working}, timeout=seconds)
    if not done:
        working.cancel()  # one that has not begun need not
        raise SilentError(f"the database has not answered within {seconds:g} s; look at its server and the line to it")
    return working.result()


async def looked_up(pool: ThreadPoolExecutor, do: Callable[..., ResultT], *arguments: Any) -> ResultT:
    """The result of `do`, the lookup of a key, within `LONGEST_LOOKUP`. Raises as `within`."""
    return await within(LONGEST_LOOKUP, pool, do, *arguments)


async def looked_up_soon(pool: ThreadPoolExecutor, do: Callable[..., ResultT], *arguments: Any) -> ResultT:
    """The same within `STOP_LOOKUP`."""
    return await within(STOP_LOOKUP, pool, do, *arguments)
