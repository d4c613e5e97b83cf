"""Keeping the memory of a process flat that runs for months with many threads."""

import ctypes
import sys
from typing import Any

MALLOC = {-8: 2, -3: 128 * 1024}
"""M_ARENA_MAX and M_MMAP_THRESHOLD of glibc (mallopt(3)): with an arena for each thread, and a threshold that rises
with the first large record, freed memory is spread over many arenas and never given back."""


def keep_memory_flat() -> None:
    """Let the C library give freed memory back; call it before threads are started. Without glibc nothing happens."""
    library = _glibc()
    for option, value in MALLOC.items() if library is not None else ():
        library.mallopt(option, value)


def give_memory_back() -> None:
    """Give all freed memory back to the system, which takes some milliseconds. Without glibc nothing happens."""
    library = _glibc()
    if library is not None:
        library.malloc_trim(0)


def _glibc() -> Any:
    """The C library, where it has glibc's functions; None elsewhere."""
    library = ctypes.CDLL(None) if sys.platform == "linux" else None
    return library if hasattr(library, "malloc_trim") else None
