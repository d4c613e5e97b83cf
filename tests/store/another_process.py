"""Another process that runs until the test ends it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_HOLDING = """
import sys
import {module} as database
other = database.connect({address!r})
for statement in {statements!r}:
    other.execute(statement)
print("held", flush=True)
sys.stdin.read()
"""


def holding_script(url: str) -> str:
    """A script that lets nobody else write to the database at `url` as long as it runs."""
    if url.startswith("sqlite"):
        return _HOLDING.format(module="sqlite3", address=url.removeprefix("sqlite:///"), statements=["BEGIN IMMEDIATE"])
    statements = ["LOCK TABLE runs, spools, sine_records, audit_head IN EXCLUSIVE MODE"]
    return _HOLDING.format(module="psycopg", address=url, statements=statements)


@contextmanager
def another_process(script: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a script that prints "held" once it holds what it is to hold, and then waits."""
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        yield holder
