"""Errors that a user of the command line or the API sees, and their exit codes."""

from analysis.errors import AnalysisError
from daq.errors import ChannelError, DaqError
from rig.errors import RequestError, RigError
from store.errors import StoreError


class JointlabError(Exception):
    """The request cannot be met; the message says what to change."""


class ConflictError(JointlabError):
    """The request does not fit the present state; the message says what that is."""


class SettingsError(JointlabError):
    """The configuration is missing or does not fit."""


BAD_INPUT = 3
INSTRUMENT = 4

# Exit code for each kind of error; the first that fits counts.
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
