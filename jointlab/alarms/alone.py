"""Telling people that a run has ended while no service is there: `python -m jointlab.alarms.alone FOLDER RIG`.

The drive process starts it, and writes 1 or 0 to its standard input: whether no program steers the rig. It is a process
of its own, at an ordinary priority: the drive process neither waits for it nor needs it. It sends the alarm about
each run that has ended by itself and whose spool is still in FOLDER; the service sends the alarms about stored runs. It
notes in a file what it has delivered, so that the service does not repeat it.
"""

import logging
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path

from jointlab.alarms.alarms import channels_of
from jointlab.alarms.channel import AlarmChannel
from jointlab.alarms.deliverer import Attempts
from jointlab.alarms.new import ended_run
from jointlab.alarms.relay import Relay
from jointlab.alarms.settings import AlarmSettings, RelaySettings
from jointlab.alarms.unstored import ALONE, UnstoredAlarms, sending
from jointlab.drive.process import SPOOLS
from jointlab.errors import JointlabError
from jointlab.settings import load_settings
from rig.runs.records import EndRecord
from rig.runs.spool import SpoolReader, is_written, spools
from store.database.file_lock import LockHeldError, exclusive_lock
from store.errors import StoreError
from store.service.alarms import NewAlarm

POLL = 1.0  # s between two looks
KEPT = 100
"""Alarms whose messages are noted: the latest ones."""
log = logging.getLogger(__name__)


class Alone:
    """Tells by each channel in a thread of its own, while `is_alone` says so and until it is closed.

    Args:
        channels: by which people are told.
        is_alone: whether no program steers the rig.
    """

    def __init__(
        self,
        folder: Path,
        rig: str,
        settings: AlarmSettings,
        channels: tuple[AlarmChannel, ...],
        is_alone: threading.Event,
    ) -> None:
        self._folder, self._rig = folder, rig
        self._is_alone = is_alone
        self._relay: Relay | None = None
        self._given, self._names = settings, [each.name for each in channels]
        self._noted = UnstoredAlarms(folder / ALONE, KEPT)
        self._seen = dict[Path, NewAlarm | None]()  # by the spool; None where its run did not end by itself
        self._looks = 0  # that have begun
        self._closed = threading.Event()
        works: list[Callable[[], None]] = [self._look]
        works += [partial(self._tell, each, Attempts(each, self._noted)) for each in channels]
        self._threads = [threading.Thread(target=self._repeat, args=(each,), daemon=True) for each in works]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """End after the attempts that are under way; the relay stays as it is."""
        self._closed.set()
        for thread in self._threads:
            thread.join()
        self._switch(None)

    def finish(self) -> None:
        """Return when each channel has delivered every alarm that no service has stored, also for a run ending now."""
        enough = self._looks + 2  # when this look begins, a look that began after this line has ended
        while self._looks < enough or any(
            self._noted.sent(each.cause, name) is None for each in self.standing().values() for name in self._names
        ):
            time.sleep(POLL)

    def _repeat(self, work: Callable[[], None]) -> None:
        while not self._closed.is_set():
            try:
                work()
            except Exception:  # whatever it is: later alarms have to be told
                log.exception("telling of an alarm ended with an unexpected error")
            self._closed.wait(POLL)

    def standing(self) -> dict[Path, NewAlarm]:
        """The alarms that no service has stored, by the spool."""
        return {path: alarm for path, alarm in self._seen.items() if alarm is not None}

    def _switch(self, given: RelaySettings | None) -> None:
        """Keep a relay on, or leave it to others."""
        if self._relay is not None and given is None:
            self._relay.close()
            self._relay = None
        elif self._relay is None and given is not None:
            self._relay = Relay(given, lambda: True)

    def _look(self) -> None:
        self._looks += 1
        found = spools(self._folder / SPOOLS) if self._is_alone.is_set() else []
        seen = {path: alarm for path, alarm in self._seen.items() if path in found}
        for path in found:
            if path not in seen and not is_written(path):
                seen[path] = alarm = _alarm_of(path, self._rig)
                if alarm is not None:
                    self._noted.add(alarm)
        self._seen = seen
        self._switch(self._given.relay if self.standing() else None)

    def _tell(self, channel: AlarmChannel, attempts: Attempts) -> None:
        for path, alarm in self.standing().items():
            try:
                with sending(self._folder, channel.name):  # then no service sends at the same time
                    if path in spools(path.parent) and self._noted.sent(alarm.cause, channel.name) is None:
                        attempts.tell(alarm)
            except LockHeldError:
                continue  # a service is there again


def _alarm_of(path: Path, rig: str) -> NewAlarm | None:
    """The alarm about a spool that nothing writes any more; None where its run did not end by itself."""
    reader, last = SpoolReader(path), None
    try:
        for spooled in reader.records():
            last = spooled.record
    except StoreError as error:
        log.warning("nobody is told how the run of %s has ended: %s", path, error)
    if reader.order is None or not isinstance(last, EndRecord) or not last.by_itself:
        return None
    return ended_run(reader.order, rig, last)


def main() -> None:
    """Send alarms while the drive process asks for it; when that process has ended, send the remaining ones."""
    folder, rig = Path(sys.argv[1]), sys.argv[2]
    try:
        settings = load_settings().alarms
        channels = channels_of(settings)
        held = _only_one(folder)
    except (JointlabError, StoreError) as error:
        sys.exit(f"nobody is told of alarms while no service runs: {error}")
    is_alone = threading.Event()
    with held, closing(Alone(folder, rig, settings, channels, is_alone)) as alone:
        while said := sys.stdin.buffer.read(1):
            (is_alone.set if said == b"1" else is_alone.clear)()
        alone.finish()


def _only_one(folder: Path) -> ExitStack:
    """The lock of this program; waits while the program of an earlier drive process still sends alarms."""
    held = ExitStack()
    while True:
        try:
            held.enter_context(exclusive_lock(folder / "alarms-alone.lock"))
        except LockHeldError:
            time.sleep(POLL)
        else:
            return held


if __name__ == "__main__":
    main()
