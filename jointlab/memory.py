"""Keeping the memory of a process flat that runs for months with many threads."""

import ctypes
import sys

MALLOC = {-8: 2, -3: 128 * 1024}
"""M_ARENA_MAX and M_MMAP_THRESHOLD of glibc (mallopt(3)): with an arena for each thread, and a threshold that rises
with the first large record, freed memory is spread over many arenas and never given back."""


def keep_memory_flat() -> None:
    """Let the C library give freed memory back; call it before threads are started. Without glibc nothing happens."""
    if sys.platform != "linux":
        return
    library = ctypes.CDLL(None)
    for option, value in MALLOC.items() if hasattr(library, "mallopt") else ():
        library.mallopt(option, value)
