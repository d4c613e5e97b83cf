"""Delivery of the messages of one channel, from stored rows, in a thread that nothing waits for."""

import logging
import time
from datetime import UTC, datetime, timedelta

from jointlab.alarms.channel import AlarmChannel, NotDeliveredError
from jointlab.alarms.unstored import ALONE, UnstoredAlarms, sending
from jointlab.background import BackgroundThread
from store.catalogue import Catalogue
from store.database.file_lock import LockHeldError
from store.errors import StoreError
from store.service.alarms import LONGEST_PAUSE, NewAlarm, Sent, claim_delivery, is_delivery_due, note_delivery

POLL = 1.0  # s between two looks for messages
FIRST_PAUSE = 5.0  # s before the second attempt; each further one waits twice as long, up to LONGEST_PAUSE
PATIENCE = 5.0  # s that an alarm may wait for the database, before it is told without it
log = logging.getLogger(__name__)


def pause_after(attempts: int) -> timedelta:
    """The time until the next attempt, after `attempts` that failed."""
    return min(timedelta(seconds=FIRST_PAUSE * 2 ** min(attempts - 1, 20)), LONGEST_PAUSE)


class Attempts:
    """Tells one channel of alarms that the database does not have, each of them until it is delivered.

    Attributes:
        delivered: the result of each delivery, by the alarm's uid.
    """

    def __init__(self, channel: AlarmChannel, unstored: UnstoredAlarms) -> None:
        self._channel = channel
        self._unstored = unstored
        self.delivered = dict[str, str]()
        self._tried = dict[str, tuple[int, float]]()  # attempts, and when the next one is due

    def tell(self, alarm: NewAlarm) -> None:
        """Make the next attempt, where it is due."""
        attempts, due = self._tried.get(alarm.uid, (0, 0.0))
        if time.monotonic() < due:
            return
        attempts, body = attempts + 1, self._channel.compose(alarm)
        result, delivered = attempt(self._channel, alarm, body, attempts)
        self._tried[alarm.uid] = attempts, time.monotonic() + pause_after(attempts).total_seconds()
        if delivered:
            self.delivered[alarm.uid] = result  # it may have been stored meanwhile, without this message
            self._unstored.note(
                alarm.cause, Sent(self._channel.name, body, attempts, result, delivered_at=datetime.now(UTC))
            )


def attempt(channel: AlarmChannel, alarm: NewAlarm, body: str, attempts: int) -> tuple[str, bool]:
    """Send a message; what came of it, and whether it is delivered."""
    try:
        result = channel.send(alarm.uid, body)
    except NotDeliveredError as error:
        log.warning("alarm %s was not delivered by %s, attempt %s: %s", alarm.uid, channel.name, attempts, error)
        return str(error), False
    log.info("alarm %s was delivered by %s: %s", alarm.uid, channel.name, result)
    return result, True


class Deliverer(BackgroundThread):
    """Sends what is to be sent through one channel, until it is closed; what is not delivered then is stored.

    Args:
        deadline: s that an attempt may take.
        unstored: alarms that the database does not have.
    """

    def __init__(
        self, catalogue: Catalogue, rig: str, channel: AlarmChannel, deadline: float, unstored: UnstoredAlarms
    ) -> None:
        self._catalogue = catalogue
        self._rig = rig
        self._channel = channel
        self._lasts = timedelta(seconds=2 * deadline)
        self._unstored = unstored
        self._attempts = Attempts(channel, unstored)
        self._delivered = self._attempts.delivered  # also of messages that the database does not know as delivered yet
        super().__init__(f"alarms by {channel.name}")

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                is_sent = self._send_stored()
            except LockHeldError:
                is_sent = False  # who has told while no service was there ends after this attempt
            except StoreError as error:
                log.warning("alarms are told without the database: %s", error)
                is_sent = False
            except Exception:  # whatever it is: later alarms have to be told
                log.exception("telling of an alarm ended with an unexpected error")
                is_sent = False
            try:
                for alarm in self._unstored.unsent(self._channel.name, PATIENCE):
                    self._attempts.tell(alarm)
            except Exception:  # as above
                log.exception("telling of an alarm ended with an unexpected error")
            if not is_sent:
                self._closed.wait(POLL)

    def _send_stored(self) -> bool:
        """Send the next message that is due; whether there was one. Raises StoreError, LockHeldError."""
        name, now = self._channel.name, datetime.now(UTC)
        with self._catalogue.reading() as session:  # most often nothing is to be written
            if not is_delivery_due(session, self._rig, name, now):
                return False
        with sending(self._unstored.folder, name):
            with self._catalogue.writing() as session:
                found = claim_delivery(session, self._rig, name, now, self._lasts, self._channel.compose)
            if found is None:
                return False
            alarm, message = found
            earlier = self._result_before(alarm)
            if earlier is None:
                result, delivered = attempt(self._channel, alarm, message.body, message.attempts)
            else:
                result, delivered = earlier, True
        if delivered:
            self._delivered[alarm.uid] = result  # what follows may fail
        next_at = datetime.now(UTC) + pause_after(message.attempts)
        self._catalogue.write(
            lambda session: note_delivery(session, message.id, result, delivered=delivered, next_at=next_at)
        )
        self._delivered.pop(alarm.uid, None)
        return True

    def _result_before(self, alarm: NewAlarm) -> str | None:
        """What the receiver has answered to a message about the alarm that the database does not know as delivered."""
        if alarm.uid in self._delivered:
            return self._delivered[alarm.uid]
        alone = UnstoredAlarms(self._unstored.folder / ALONE).sent(alarm.cause, self._channel.name)
        return None if alone is None else alone.result
