"""A copy of the state and the events of the drive process of a rig, kept up to date by its news."""

import math
import threading
import time
from collections.abc import Callable, Sequence

from jointlab.drive.journal import Entry, Journal
from jointlab.drive.phase import Phase
from jointlab.drive.protocol import SNAPSHOT, Ask, DriveRequest, News, Reply, Snapshot, Welcome
from jointlab.drive.state import RigState
from jointlab.errors import ConflictError
from jointlab.settings import Settings
from jointlab.supervision.drive_link import ANSWER_TIMEOUT, DriveLink

UNKNOWN = RigState(Phase.UNKNOWN)
"""Before the process has said anything."""
END_TIMEOUT = 5.0  # s that a run that is resumed while it is being stopped may take to end
NEWS_TIMEOUT = 2.0  # s that a caller waits until this program knows what it has done


class DriveMirror:
    """The state and the events of a drive process, as they are known here, until it is closed. Any thread may call it.

    Args:
        settings, name, found, starts: as for `DriveLink`.
        before: gets new entries of the journal before they are shown here.
        after: is called when news are shown here.

    Attributes:
        link: to the process.
        journal: its events.

    Raises:
        RigError: as for `DriveLink`.
    """

    def __init__(
        self,
        settings: Settings,
        name: str,
        *,
        before: Callable[[Sequence[Entry]], object],
        after: Callable[[Snapshot], object],
        found: Callable[[Welcome], object],
        starts: bool,
    ) -> None:
        self.journal = Journal()
        self._before = before
        self._after = after
        self._snapshot = Snapshot(state=UNKNOWN)
        self._changed = threading.Condition()
        self.link = DriveLink(settings, name, self._hear, self._lose, found, starts=starts)
        try:
            self.journal.mirror(self.link.welcome.epoch, ())  # its epoch is known before its first news
            now = self.fresh()
        except BaseException:
            self.link.close()  # nobody else could, and the process would believe that it is steered
            raise
        with self._changed:
            if self._snapshot.state is UNKNOWN:  # no news came meanwhile
                self._snapshot = now

    @property
    def snapshot(self) -> Snapshot:
        """The latest snapshot of the process."""
        return self._snapshot

    def ask(self, request: DriveRequest, timeout: float = ANSWER_TIMEOUT) -> Reply:
        """The reply to a request, when what it did is known here, too. Raises as `DriveLink.ask`."""
        reply = self.link.ask(request, timeout)
        with self._changed:
            self._changed.wait_for(lambda: self.journal.latest >= reply.latest, NEWS_TIMEOUT)
        return reply

    def show(self, snapshot: Snapshot) -> None:
        """Show what the process has answered, unless newer is shown; not everything that changes it is an event."""
        with self._changed:
            if _age(snapshot) >= _age(self._snapshot):
                self._snapshot = snapshot

    def wait(self, condition: Callable[[Snapshot], bool], end: float) -> bool:
        """Wait until the snapshot fulfils `condition`; False where it does not by `end` of `time.monotonic`."""
        timeout = None if end == math.inf else max(end - time.monotonic(), 0.0)
        with self._changed:
            return self._changed.wait_for(lambda: condition(self._snapshot), timeout)

    def fresh(self) -> Snapshot:
        """The present snapshot of the process, asked for now. Raises NoDriveError where it does not answer."""
        return SNAPSHOT.validate_python(self.link.ask(Ask()).value)

    def wait_until_ended(self, run_id: int) -> None:
        """Wait for the end of run `run_id`, where it is being stopped.

        Raises ConflictError where it is carried out and not stopped, or takes longer than `END_TIMEOUT`.
        """
        known = self._snapshot.state
        if known.run_id != run_id or not known.phase.is_of_a_run:
            return
        now = self.fresh().state.phase  # it may have ended, and the news of that are on their way
        if now.is_of_a_run and now is not Phase.STOPPING:
            raise ConflictError(
                f"run {run_id} has not ended; a resume names the pause that it ends: `pause` in the state of the rig"
            )
        if not self.wait(lambda shown: not shown.state.phase.is_of_a_run, time.monotonic() + END_TIMEOUT):
            raise ConflictError(f"run {run_id} is still being stopped; resume it when it has ended")

    def close(self) -> None:
        """End the link, as `DriveLink.close` does. The journal stays open."""
        self.link.close()

    def _hear(self, news: News) -> None:
        known = self.journal.latest if news.epoch == self.journal.epoch else 0
        entries = [entry for entry in news.entries if entry.number > known]
        self._before(entries)
        with self._changed:
            self._snapshot = news.snapshot
            self.journal.mirror(news.epoch, entries)
            self._changed.notify_all()
        if news.snapshot.latest <= self.journal.latest:
            self._after(news.snapshot)

    def _lose(self, why: str) -> None:
        """Show what outlives a process: a STOP in force, and that rest was not confirmed. Nothing else is known."""
        with self._changed:
            known = self._snapshot.state
            state = RigState(
                Phase.UNKNOWN,
                run_id=known.run_id,
                title=known.title,
                tester_silent=why,
                rest_unknown=known.rest_unknown,
                is_driven=known.is_driven,
            )
            self._snapshot = Snapshot(state=state, stop=self._snapshot.stop)
            self._changed.notify_all()


def _age(snapshot: Snapshot) -> tuple[int, int]:
    return snapshot.latest, snapshot.stop_epoch or 0
