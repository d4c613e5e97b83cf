"""Thousands of generated requests against the service on a simulated rig: how many, and what did not hold.

python -m tests.bench bench_schema
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from tests.api.service.fuzzing import fuzz

WANTED = 5_000
EXAMPLES = 25


def main() -> None:
    """Generate requests by examples, coverage of the schema, chance and links between operations."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        cases, failures = fuzz(Path(folder), "examples,coverage,fuzzing,stateful", EXAMPLES, seed=7)
        took = time.perf_counter() - began
    print(f"{cases} cases in {took:.0f} s (wanted: {WANTED}), {'none failed' if not failures else 'these failed:'}")
    print(failures)
