"""What a person at the command line or the API is told when something cannot be done."""

from __future__ import annotations

from analysis.errors import AnalysisError
from daq.errors import ChannelError, DaqError
from rig.errors import RequestError, RigError
from store.errors import StoreError


class JointlabError(Exception):
    """A request that cannot be met as it stands; the message says what to change."""


class ConflictError(JointlabError):
    """What is asked for does not go with how things stand now; the message says how they stand."""


class SettingsError(JointlabError):
    """The configuration is missing or does not fit."""


BAD_INPUT = 3
INSTRUMENT = 4

# One table for the command line and the REST API: which error means what to the caller.
EXIT_CODES: dict[type[Exception], int] = {
    JointlabError: BAD_INPUT,
    AnalysisError: BAD_INPUT,
    StoreError: BAD_INPUT,
    ChannelError: BAD_INPUT,
    RequestError: BAD_INPUT,
    DaqError: INSTRUMENT,
    RigError: INSTRUMENT,
}
EXPECTED = tuple(EXIT_CODES)


def exit_code(error: Exception) -> int:
    """Exit code of the command line for an expected error: 3 for bad input, 4 for an instrument."""
    return next(code for kind, code in EXIT_CODES.items() if isinstance(error, kind))
