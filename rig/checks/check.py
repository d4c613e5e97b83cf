"""A check of the rig: what was measured, its limit, and what to do where it failed."""

from dataclasses import dataclass
from enum import StrEnum

from rig.errors import with_notes

Measured = float | str | None


class CheckState(StrEnum):
    """Whether a check was passed."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_DONE = "not done"


class Place(StrEnum):
    """Where the sensors of the hammer test are while the rig is examined."""

    BENCH = "bench"  # everything as for a run, nothing moves
    CALIBRATOR = "calibrator"
    MASS = "mass"


@dataclass(frozen=True)
class Check:
    """One check.

    Attributes:
        id: of the check, such as noise.
        subject: the channel or instrument.
        state: whether it was passed.
        measured: a number in `unit`, or a text; None where nothing was measured.
        limit: what `measured` was compared with, as a number in `unit` or a text; None where there is no limit.
        unit: of `measured` and `limit`; empty for texts and ratios.
        advice: what to do; empty where the check was passed.
    """

    id: str
    subject: str
    state: CheckState
    measured: Measured = None
    limit: Measured = None
    unit: str = ""
    advice: str = ""


def judged(
    id_: str, subject: str, good: bool, advice: str, measured: Measured = None, limit: Measured = None, unit: str = ""
) -> Check:
    """A check that was done: passed if `good`, else failed with `advice`, which says what to do."""
    state = CheckState.PASSED if good else CheckState.FAILED
    return Check(id_, subject, state, measured, limit, unit, "" if good else advice)


def failed(id_: str, subject: str, error: Exception) -> Check:
    """A check that could not be done because its instrument failed; the error says what to do."""
    return Check(id_, subject, CheckState.FAILED, advice=with_notes(str(error), error))


def not_done(id_: str, subject: str, advice: str) -> Check:
    """A check that was not done; `advice` says what it needs."""
    return Check(id_, subject, CheckState.NOT_DONE, advice=advice)
