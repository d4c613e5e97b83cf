"""Phases of the rig."""

from __future__ import annotations

from enum import StrEnum


class Phase(StrEnum):
    """What the rig does."""

    IDLE = "idle"
    STARTING = "starting"
    RUNNING = "running"
    PAUSED = "paused"
    STOPPING = "stopping"
