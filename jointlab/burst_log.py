"""Audit log of events that need no key, such as refused logins: a burst is one row in each `INTERVAL`.

The first one is noted at once; of the others within an interval, one more row has the number. So nobody fills the disk
with STOPs, which need no key, or with log-ins that fail.
"""

import logging
import threading
from dataclasses import asdict, dataclass, replace

from store.catalogue import Catalogue
from store.errors import StoreError
from store.service.audit import add_audit_entry

INTERVAL = 10.0  # s
MOST_BURSTS = 16
"""Bursts at a time, each with a thread of its own; further events are counted together, as those of many callers."""
MANY = "many callers"
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class AuditEvent:
    """Something that somebody without a key has caused; its fields are those of `add_audit_entry`."""

    who: str
    action: str
    target: str
    outcome: str


class BurstLog:
    """Notes bursts. Any thread may call it, the event loop too: it never waits for the database."""

    def __init__(self, interval: float = INTERVAL) -> None:
        self._interval = interval
        self._lock = threading.Lock()
        self._more = dict[AuditEvent, int]()
        self._threads = set[threading.Thread]()
        self._ending = threading.Event()

    def note(self, catalogue: Catalogue, event: AuditEvent) -> None:
        """Note that something has happened."""
        with self._lock:
            if event not in self._more and len(self._more) >= MOST_BURSTS:
                event = replace(event, who=MANY, target="")
            if event in self._more:
                self._more[event] += 1
                return
            self._more[event] = 0
            thread = threading.Thread(target=self._follow, args=(catalogue, event), name="burst log", daemon=True)
            self._threads.add(thread)
            thread.start()

    @property
    def is_open(self) -> bool:
        """Whether a burst may still last."""
        return bool(self._more)

    def close(self) -> None:
        """Note what is still counted."""
        self._ending.set()
        while self._threads:
            next(iter(self._threads)).join()

    def _follow(self, catalogue: Catalogue, event: AuditEvent) -> None:
        """Note the first one, and after every interval how many more there were, until there was none."""
        _write(catalogue, event, {})
        while True:
            self._ending.wait(self._interval)
            with self._lock:
                more = self._more[event]
                self._more[event] = 0
                if not more:
                    del self._more[event]
                    self._threads.discard(threading.current_thread())
                    return
            _write(catalogue, event, {"times": more, "within_s": self._interval})


def _write(catalogue: Catalogue, event: AuditEvent, details: dict[str, float]) -> None:
    try:
        with catalogue.writing() as session:
            add_audit_entry(session, **asdict(event), details=details)
    except StoreError as error:
        log.warning("%s could not be noted (%s): %s", event, details or "once", error)
