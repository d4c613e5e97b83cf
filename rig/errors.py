"""The base of the errors of the rig, and their description for people."""

UNEXPECTED = "an unexpected error in the program; its log has the details"


class RigError(Exception):
    """A sequence or an instrument of the rig could not do what was asked; the message says what to do."""


class RequestError(RigError):
    """The request is wrong, whatever the instruments are like; nothing moved."""


class RunStoppedError(RigError):
    """The run was stopped as asked, or STOP is in force; what was measured before is kept."""

    def __init__(self, message: str = "the run was stopped as asked; what was measured before is kept") -> None:
        super().__init__(message)


def failure_reason(error: Exception, expected: tuple[type[Exception], ...]) -> str:
    """Why something failed, for people: the message of an `expected` error; for any other a reference to the log.

    What was noted of the error follows in both cases.
    """
    return with_notes(str(error) if isinstance(error, expected) else UNEXPECTED, error)


def with_notes(message: str, error: BaseException) -> str:
    """`message`, then what was noted of `error`, such as that rest is not confirmed; each once."""
    return "; ".join(dict.fromkeys((message, *getattr(error, "__notes__", ()))))
