"""The base of what goes wrong in a rig sequence; each sequence and driver adds its own beside its code."""

from __future__ import annotations


class RigError(Exception):
    """A sequence or an instrument of the rig could not do what was asked; the message says what to do."""


class RequestError(RigError):
    """What was asked for is wrong, whatever the instruments are like; nothing moved."""
