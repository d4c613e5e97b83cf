"""The fixtures of the command line: what it offers is asked here without it."""

from tests.api.conftest import (
    bundle,
    contents,
    demo,
    drive,
    exported,
    identified,
    jointlab,
    laboratory,
    measured,
    measured_catalogue,
    operator,
    query,
    running_laboratory,
    sequence,
)

__all__ = [
    "bundle",
    "contents",
    "demo",
    "drive",
    "exported",
    "identified",
    "jointlab",
    "laboratory",
    "measured",
    "measured_catalogue",
    "operator",
    "query",
    "running_laboratory",
    "sequence",
]
