"""Thousands of generated requests against the service on a simulated rig: how many, and what did not hold.

python -m tests.bench bench_schema
"""

import tempfile
import time
from pathlib import Path

from tests.api.service.fuzzing import fuzz
from tests.postgresql_server import running_server

WANTED = 5_000
EXAMPLES = 25


def main() -> None:
    """Generate requests by examples, coverage of the schema, chance and links between operations; on both databases."""
    measure("SQLite", None)
    with running_server() as server:
        server.execute("CREATE DATABASE lab")
        measure("PostgreSQL", server.url("lab"))


def measure(name: str, database: str | None) -> None:
    """Fuzz one service."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        cases, failures = fuzz(Path(folder), "examples,coverage,fuzzing,stateful", EXAMPLES, seed=7, database=database)
        took = time.perf_counter() - began
    failed = "these failed:" if failures else "none failed"
    print(f"{name}: {cases} cases in {took:.0f} s (wanted: {WANTED}), {failed}", flush=True)
    print(failures)
