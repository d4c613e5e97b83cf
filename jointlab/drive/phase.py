"""Phases of the rig."""

from enum import StrEnum


class Phase(StrEnum):
    """What the rig does."""

    IDLE = "idle"
    STARTING = "starting"
    RUNNING = "running"
    PAUSED = "paused"
    STOPPING = "stopping"
