"""Keeping the memory of a process flat."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ALLOCATE = """
import ctypes, sys, threading
from jointlab.memory import keep_memory_flat
keep_memory_flat()
library = ctypes.CDLL(None)
library.malloc.restype = library.fopen.restype = ctypes.c_void_p
together = threading.Barrier(20)
def allocate():
    together.wait()
    library.malloc(1000)
    together.wait()
threads = [threading.Thread(target=allocate) for _ in range(20)]
for each in threads: each.start()
for each in threads: each.join()
file = ctypes.c_void_p(library.fopen(sys.argv[1].encode(), b"w"))
library.malloc_info(0, file)
library.fclose(file)
"""

FREE = """
from jointlab.memory import give_memory_back
def resident():
    return next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmRSS"))
before = resident()
# below the size from which a piece is mapped by itself, and written to: what is zero is not in memory
pieces = [b"x" * 100_000 for _ in range(1000)]
keep = b"x" * 100_000  # above them, so that the heap does not end with them
full = resident()
del pieces
give_memory_back()
print(before, full, resident())
"""
"""Prints how many kilobytes are in memory before pieces are allocated, with them, and after they were freed."""


@pytest.mark.skipif(sys.platform != "linux", reason="arenas are those of glibc")
def test_many_threads_share_two_arenas_of_the_c_library(tmp_path: Path) -> None:
    file = tmp_path / "arenas.xml"
    subprocess.run([sys.executable, "-c", ALLOCATE, str(file)], check=True, timeout=60)
    assert len(re.findall("<heap nr=", file.read_text())) <= 2


@pytest.mark.skipif(sys.platform != "linux", reason="the C library is glibc")
def test_freed_memory_is_given_back() -> None:
    sizes = subprocess.run([sys.executable, "-c", FREE], check=True, timeout=60, capture_output=True, text=True)
    before, full, freed = map(int, sizes.stdout.split())
    assert full > before + 90_000
    assert freed < full - 80_000
