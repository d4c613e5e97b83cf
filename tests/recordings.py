"""Recorded data and examples beside the project, which tests ask for by file."""

from collections.abc import Callable
from pathlib import Path

import pytest

Recording = Callable[[str], Path]
SHARED = Path(__file__).resolve().parents[2] / "shared"


def find_recording(name: str) -> Path:
    """A file or folder of ``../shared``, such as "examples/none"; the test that asks skips where it is absent."""
    path = SHARED / name
    if not (any(path.iterdir()) if path.is_dir() else path.is_file()):
        pytest.skip(f"no ../shared/{name} beside the project")
    return path
