"""The base of the errors of the rig, and how a failure is described to people."""

from __future__ import annotations

UNEXPECTED = "an unexpected error in the program; its log has the details"


class RigError(Exception):
    """A sequence or an instrument of the rig could not do what was asked; the message says what to do."""


class RequestError(RigError):
    """The request is wrong, whatever the instruments are like; nothing moved."""


def failure_reason(error: Exception, expected: tuple[type[Exception], ...]) -> str:
    """Why something failed, for people: the message of an `expected` error; for any other a reference to the log."""
    return str(error) if isinstance(error, expected) else UNEXPECTED
