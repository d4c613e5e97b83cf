"""The journal of the rig: the latest events, numbered, for observers in any thread or event loop."""

import asyncio
import threading
from collections import deque
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from enum import Enum
from typing import Any, get_type_hints
from uuid import uuid4

from analysis.dof import Dof
from jointlab.drive.events import EVENTS
from rig.events import Event
from rig.registers import Interlock, interlock_names, interlocks_named

KEPT = 5_000


@dataclass(frozen=True)
class Entry:
    """One event.

    Attributes:
        number: counts from 1.
        at: UTC.
        name: the event's class, such as BlowAccepted.
        data: its fields as plain values; a point is 3y, interlocks are their names.
    """

    number: int
    at: datetime
    name: str
    data: dict[str, Any]


class Journal:
    """Events in the order in which they happened; the oldest are dropped. An observer of a sequence.

    Attributes:
        epoch: names this journal; numbers of another one, from before the program was restarted, mean nothing here.
    """

    def __init__(self, kept: int = KEPT) -> None:
        self.epoch = uuid4().hex[:8]
        self._entries = deque[Entry](maxlen=kept)
        self._latest = 0
        self._closed = False
        self._lock = threading.Lock()
        self._happened = threading.Condition(self._lock)
        self._waiting = set[tuple[asyncio.AbstractEventLoop, asyncio.Event]]()

    def __call__(self, event: Event) -> None:
        """Add `event` and wake the followers."""
        with self._lock:
            self._latest += 1
            self._entries.append(Entry(self._latest, datetime.now(UTC), type(event).__name__, plain_fields(event)))
            self._wake()

    def mirror(self, epoch: str, entries: Iterable[Entry]) -> None:
        """Add events of another journal, which `epoch` names; those of a former one mean nothing beside them."""
        with self._lock:
            if epoch != self.epoch:
                self.epoch, self._latest = epoch, 0
                self._entries.clear()
            for entry in entries:
                if entry.number > self._latest:
                    self._latest = entry.number
                    self._entries.append(entry)
            self._wake()

    @property
    def latest(self) -> int:
        """Number of the latest event; 0 before the first."""
        return self._latest

    def after(self, number: int) -> list[Entry]:
        """The events after `number` that are still kept, oldest first."""
        with self._lock:
            return [entry for entry in self._entries if entry.number > number]

    def wait(self, after: int, timeout: float) -> list[Entry]:
        """The events after number `after` that are still kept, as soon as there are any; none after `timeout` s."""
        with self._happened:
            self._happened.wait_for(lambda: self._latest > after or self._closed, timeout)
        return self.after(after)

    async def follow(self, after: int) -> AsyncIterator[Entry]:
        """Every event after `after` as it happens, until the journal is closed; a slow follower misses dropped ones."""
        happened = asyncio.Event()
        waiting = (asyncio.get_running_loop(), happened)
        with self._lock:
            self._waiting.add(waiting)
        try:
            while True:
                happened.clear()
                for entry in self.after(after):
                    after = entry.number
                    yield entry
                if self._closed:
                    return
                await happened.wait()
        finally:
            with self._lock:
                self._waiting.discard(waiting)

    def close(self) -> None:
        """End all followers."""
        with self._lock:
            self._closed = True
            self._wake()

    def _wake(self) -> None:
        self._happened.notify_all()
        for loop, happened in self._waiting:
            if not loop.is_closed():
                loop.call_soon_threadsafe(happened.set)


def plain_fields(event: Event) -> dict[str, Any]:
    """The fields of an event as values that JSON has."""
    return {field.name: _plain(getattr(event, field.name)) for field in fields(event)}


def _plain(value: object) -> object:
    if isinstance(value, Dof):
        return str(value)
    return interlock_names(value) if isinstance(value, Interlock) else value


def event_of(entry: Entry) -> Event:
    """The event of an entry."""
    kind = EVENTS[entry.name]
    hints = get_type_hints(kind)
    return kind(**{name: _typed(value, hints[name]) for name, value in entry.data.items()})


def _typed(value: Any, hint: Any) -> Any:
    if hint is Dof:
        return Dof.parse(value)
    if hint is Interlock:
        return interlocks_named(value)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return hint(value)
    return tuple(value) if isinstance(value, list) else value
