"""Alarms that the database does not have yet: kept in a file, told without it, and stored when it is back.

Two programs tell of alarms, each with a file of its own: the service, and the process beside the drive process that
tells while no service is there (`jointlab/alarms/alone.py`). They never send to a channel at the same time.
"""

import logging
import os
import threading
import time
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from store.catalogue import Catalogue
from store.database.file_lock import exclusive_lock
from store.service.alarms import NewAlarm, Sent, add_alarm

ALONE = "alarms-alone.json"
"""File in the folder of the drive process with what was told while no service was there."""
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Unstored:
    """An alarm, and the messages about it that were delivered."""

    alarm: NewAlarm
    sent: tuple[Sent, ...] = ()


_form = TypeAdapter(list[Unstored])


def sending(folder: Path, channel: str) -> AbstractContextManager[None]:
    """The context in which a program sends to a channel. Raises LockHeldError where another one does."""
    return exclusive_lock(folder / f"alarms-{channel}.lock")


class UnstoredAlarms:
    """The alarms in the file `path`, the latest `most`, also of a program that was killed. Any thread may call it.

    Attributes:
        folder: of the file.
    """

    def __init__(self, path: Path, most: int = 1_000) -> None:
        self.folder = path.parent
        self._path, self._most = path, most
        self._lock = threading.Lock()
        self._kept = dict[str, Unstored]()
        self._since = dict[str, float]()
        try:
            for each in _form.validate_json(path.read_bytes()):
                self._kept[each.alarm.cause] = each
        except FileNotFoundError:
            pass
        except (OSError, ValidationError) as error:
            log.error("alarms that were kept in %s cannot be read: %s", path, error)
        self._alarms = tuple(each.alarm for each in self._kept.values())

    @property
    def alarms(self) -> tuple[NewAlarm, ...]:
        """All alarms, oldest first. The call waits for no other thread."""
        return self._alarms

    def add(self, alarm: NewAlarm) -> None:
        """Keep an alarm; one of the same cause stays as it is."""
        with self._lock:
            if alarm.cause not in self._kept:
                self._kept[alarm.cause], self._since[alarm.cause] = Unstored(alarm), time.monotonic()
                for cause in [*self._kept][: -self._most]:
                    del self._kept[cause]
                self._write()

    def unsent(self, channel: str, waited: float) -> list[NewAlarm]:
        """Alarms that were not sent to the channel, and could not be stored for `waited` s."""
        before = time.monotonic() - waited
        with self._lock:
            return [
                each.alarm
                for cause, each in self._kept.items()
                if self._since.get(cause, before) <= before and all(sent.channel != channel for sent in each.sent)
            ]

    def note(self, cause: str, sent: Sent) -> None:
        """Note that a message was delivered, unless the alarm was stored meanwhile."""
        with self._lock:
            if (kept := self._kept.get(cause)) is not None:
                self._kept[cause] = replace(kept, sent=(*kept.sent, sent))
                self._write()

    def sent(self, cause: str, channel: str) -> Sent | None:
        """The message about an alarm that the channel has got; None where there is none."""
        kept = self._kept.get(cause)
        return None if kept is None else next((each for each in kept.sent if each.channel == channel), None)

    def store(self, catalogue: Catalogue) -> None:
        """Store all of them. Raises StoreError where that cannot be done now; nothing is lost."""
        with self._lock:
            waiting = list(self._kept.items())
        for cause, each in waiting:
            catalogue.write(partial(add_alarm, new=each.alarm, sent=each.sent))
            with self._lock:
                del self._kept[cause]
                self._write()

    def _write(self) -> None:
        """Replace the file; what cannot be written is in memory all the same."""
        self._alarms = tuple(each.alarm for each in self._kept.values())
        new = self._path.with_suffix(".new")
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            with new.open("wb") as file:
                file.write(_form.dump_json(list(self._kept.values())))
                file.flush()
                os.fsync(file.fileno())
            new.replace(self._path)
        except OSError as error:
            log.error("alarms cannot be kept in %s: %s", self._path, error)
