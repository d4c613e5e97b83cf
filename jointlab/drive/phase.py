"""Phases of the rig."""

from enum import StrEnum


class Phase(StrEnum):
    """What the rig does."""

    IDLE = "idle"
    STARTING = "starting"
    RUNNING = "running"
    PAUSED = "paused"
    STOPPING = "stopping"
    EXAMINING = "examining"
    UNKNOWN = "unknown"  # its drive process does not answer

    @property
    def is_of_a_run(self) -> bool:
        """Whether a run is carried out."""
        return self not in (Phase.IDLE, Phase.EXAMINING, Phase.UNKNOWN)
