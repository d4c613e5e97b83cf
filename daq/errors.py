"""Errors of acquisition, one class for each remedy, and cleaning up after an error."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager


class DaqError(Exception):
    """Acquisition failed; the message says what failed, where, and what to do.

    Attributes:
        code: NI-DAQmx error code; None for an error that the driver did not report.
    """

    def __init__(self, message: str, code: int | None = None) -> None:
        super().__init__(message)
        self.code = code


class InstrumentAbsentError(DaqError):
    """The instrument is not there or no longer there: no driver, no server, device unplugged."""


class ChannelError(DaqError):
    """The channel table does not fit the instrument: unknown device or channel, range, duplicate name."""


class TriggerTimeoutError(DaqError):
    """The trigger did not come, or the record was not complete, within the time allowed; arm again to go on."""


class OverrunError(DaqError):
    """Samples were lost because they were not read in time; the record is invalid."""


class AcquisitionCancelledError(DaqError):
    """The caller cancelled the record; the task is stopped and can be started again."""


@contextmanager
def afterwards(clean_up: Callable[[], None], noted: type[Exception]) -> Iterator[None]:
    """Call `clean_up` when the context is left, whatever happens.

    An error raised inside the context has precedence; one of `clean_up`, of the type `noted`, is then a note of it.
    """
    try:
        yield
    except BaseException as error:
        try:
            clean_up()
        except noted as failure:
            error.add_note(str(failure))
        raise
    clean_up()
