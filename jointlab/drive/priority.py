"""Coming before other processes, so that a busy computer delays neither STOP nor heartbeat."""

import ctypes
import gc
import os
import sys

from jointlab.memory import keep_memory_flat

SWITCH = 1e-3  # s that one thread may keep the others waiting
REAL_TIME = 1
"""Priority in the real-time class (`SCHED_RR`), the lowest: above ordinary programs, below the system's threads."""
NICE = -10  # where only that is allowed; on Linux it counts among processes of one session, see sched(7), autogroup
LOCK_MEMORY = 1 | 2 | 4  # MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT of Linux: what was used once is never swapped out


def come_first() -> str:
    """Raise the priority of this process as far as the system allows, and shorten its pauses for memory management.

    On Linux a priority belongs to a thread: it holds for the calling thread and for those that are started afterwards
    (sched(7)). Returns what was reached, to be shown.
    """
    sys.setswitchinterval(SWITCH)
    gc.collect()
    gc.freeze()  # later collections look at what is new
    keep_memory_flat()
    if sys.platform == "linux" and os.geteuid() == 0:  # others may lock too little to be safe from a failing allocation
        ctypes.CDLL(None).mlockall(LOCK_MEMORY)
    if sys.platform == "win32":
        return "an ordinary priority"
    try:
        if sys.platform == "linux":
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(REAL_TIME))
            return f"real-time priority {REAL_TIME}"
    except PermissionError:
        pass  # the next best
    try:
        os.setpriority(os.PRIO_PROCESS, 0, NICE)
    except PermissionError:
        return "an ordinary priority, the system allows no better one: a busy computer may delay STOP"
    return f"nice {NICE}"
