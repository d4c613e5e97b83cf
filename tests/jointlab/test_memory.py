"""Keeping the memory of a process flat."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from jointlab.memory import give_memory_back

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


@pytest.mark.skipif(sys.platform != "linux", reason="arenas are those of glibc")
def test_many_threads_share_two_arenas_of_the_c_library(tmp_path: Path) -> None:
    file = tmp_path / "arenas.xml"
    subprocess.run([sys.executable, "-c", ALLOCATE, str(file)], check=True, timeout=60)
    assert len(re.findall("<heap nr=", file.read_text())) <= 2


@pytest.mark.skipif(sys.platform != "linux", reason="the C library is glibc")
def test_freed_memory_is_given_back() -> None:
    resident = re.compile(r"^VmRSS:\s+(\d+)", re.M)
    pieces = [bytearray(100_000) for _ in range(1000)]  # below the size from which a piece is mapped by itself
    keep = bytes(100_000)  # above them, so that the heap does not end with them
    full = int(resident.findall(Path("/proc/self/status").read_text())[0])
    del pieces
    give_memory_back()
    assert int(resident.findall(Path("/proc/self/status").read_text())[0]) < full - 80_000
    assert len(keep) == 100_000
