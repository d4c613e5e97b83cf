"""Channels that tell people of an alarm: their interface, their errors, and their time limit."""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Protocol

from store.service.alarms import NewAlarm
from store.states import AlarmKind

LONGEST_RESULT = 200
"""Characters of what a receiver has answered that are stored."""
CUT_AGAIN = 0.1  # s
TITLES = {
    AlarmKind.RUN_ENDED: "a run has ended by itself",
    AlarmKind.RUN_CUT_OFF: "a run was cut off",
    AlarmKind.DRIVE_SILENT: "the drive process does not answer",
    AlarmKind.TESTER_SILENT: "the tester does not answer",
    AlarmKind.TESTER_TRIPPED: "the tester has tripped while no run drove it",
    AlarmKind.RUN_STUCK: "a run does not end",
    AlarmKind.DATABASE_AWAY: "the database is away",
    AlarmKind.JOB_FAILED: "a job has failed",
    AlarmKind.AUDIT_DAMAGED: "the audit log is damaged",
    AlarmKind.RECORD_REFUSED: "a record of a run is not stored",
    AlarmKind.TEST: "a test",
}
"""Each kind of alarm in a few words."""


class NotDeliveredError(Exception):
    """A message was not delivered, as far as is known; the text says why."""

    def __init__(self, why: object) -> None:
        super().__init__(printable(str(why) or "the connection failed, and no reason was given"))


class AlarmChannel(Protocol):
    """One way in which people are told."""

    @property
    def name(self) -> str:
        """Names it in the store."""

    def compose(self, alarm: NewAlarm) -> str:
        """Exactly what is sent about an alarm, however often."""

    def send(self, uid: str, body: str) -> str:
        """Send it, and return what the receiver has answered; within the deadline of the channel.

        Raises NotDeliveredError.
        """


def printable(text: str) -> str:
    """The answer of a receiver, as text of limited length in one line."""
    return "".join(sign if sign.isprintable() else " " for sign in text[:LONGEST_RESULT])


@contextmanager
def cut_after(seconds: float, connection: Callable[[], socket.socket | None]) -> Iterator[None]:
    """Cut a connection where the context lasts longer than `seconds`; limits of single reads do not bound their sum."""
    over = threading.Event()

    def cut() -> None:
        over.wait(seconds)
        while not over.is_set():
            found = connection()
            if found is not None:
                with suppress(OSError):
                    socket.socket.shutdown(found, socket.SHUT_RDWR)  # TLS would wait for its lock
            over.wait(CUT_AGAIN)

    watch = threading.Thread(target=cut, name="deadline", daemon=True)
    watch.start()
    try:
        yield
    finally:
        over.set()
        watch.join()
