"""The watch: looks for causes of alarms other than the end of a run, and knows which alarms are active.

The end of a run is stored with its alarm (`jointlab/runs/rows.py`). The watch looks for the others: a run without a
process, or one that does not end; a drive process, tester or database that does not answer; trips and failed jobs.
"""

import logging
import threading
import time
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

from jointlab.alarms.settings import AlarmSettings
from jointlab.alarms.unstored import UnstoredAlarms
from jointlab.drive.endpoint import NoDriveError
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState
from jointlab.supervision.manager import RunManager
from rig.runs.spool import spools_of
from rig.tester.status import stopping_text
from store.catalogue import Catalogue
from store.errors import StoreError
from store.measurements.runs import Run, latest_of_rig
from store.service.alarms import Alarm, NewAlarm, add_alarm, list_alarms
from store.service.jobs import list_jobs
from store.states import AlarmKind, JobState, RunState

POLL = 1.0  # s between two looks
SIGN_OF_LIFE = 3.0  # s that the drive process may take to answer
DRIVE_SILENT = 15.0  # s without an answer, after which that is an alarm
STUCK = 5.0  # s that a run may go on after its actuator was stopped; then an alarm is raised
OLD = timedelta(days=1)
"""Age from which on a failed job raises no alarm."""
log = logging.getLogger(__name__)


class ConditionTimer:
    """Measures for how long a condition has been true without a break."""

    def __init__(self) -> None:
        self._began: float | None = None
        self.at = datetime.now(UTC)
        """When it began, UTC."""
        self.is_told = False
        """Whether an alarm was raised since then."""

    @property
    def is_on(self) -> bool:
        """Whether it was true at the last look."""
        return self._began is not None

    def lasts(self, is_so: bool) -> float:
        """Seconds for which `is_so` has been true without a break; 0 while it is false."""
        if not is_so:
            self._began, self.is_told = None, False
            return 0.0
        if self._began is None:
            self._began, self.at = time.monotonic(), datetime.now(UTC)
        return time.monotonic() - self._began


class AlarmWatch:
    """Watches one rig and its database from a thread of its own, until it is closed.

    Args:
        runs: steers the rig; None where this program drives none.
        unstored: alarms that the database does not have.
        spool_folders: where spools of runs of the rig are.
    """

    def __init__(
        self,
        catalogue: Catalogue,
        rig: str,
        runs: RunManager | None,
        settings: AlarmSettings,
        unstored: UnstoredAlarms,
        spool_folders: Iterable[Path],
    ) -> None:
        self._catalogue = catalogue
        self._rig = rig
        self._runs = runs
        self._settings = settings
        self._unstored = unstored
        self._folders = tuple(spool_folders)
        self._stored = tuple[Alarm, ...]()
        self._problem: str | None = None
        self._away, self._silent, self._tester_silent, self._stuck = (ConditionTimer() for _ in range(4))
        self._tripped = ConditionTimer()
        self._was_ready = False  # whether the tester was seen without a trip since the last alarm about one
        self._drove = False  # whether a run was carried out when that was last known
        self._was_at_work = False
        self._looked = threading.Condition()
        self._asked = self._done = 0
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="alarms", daemon=True)
        self._thread.start()

    @property
    def standing(self) -> tuple[NewAlarm, ...]:
        """The alarms that nobody has acknowledged, as the last look has found them; newest first."""
        known = {alarm.cause for alarm in self._stored}
        return (*(each for each in reversed(self._unstored.alarms) if each.cause not in known), *self._stored)

    def look(self, timeout: float = 5.0) -> None:
        """Look at once, because an alarm was raised or acknowledged; returns when that is done, `timeout` s at most."""
        with self._looked:
            self._asked = asked = self._asked + 1
            self._looked.notify_all()
            self._looked.wait_for(lambda: self._done >= asked or self._closed, timeout)

    def close(self) -> None:
        """Stop watching."""
        with self._looked:
            self._closed = True
            self._looked.notify_all()
        self._thread.join()

    def _run(self) -> None:
        while not self._closed:
            asked = self._asked
            try:
                self._look()
            except Exception:  # whatever it is: what comes after it has to be told
                log.exception("looking for alarms ended with an unexpected error")
            with self._looked:
                self._done = asked
                self._looked.notify_all()
                if self._asked == asked and not self._closed:
                    self._looked.wait(POLL)

    def _look(self) -> None:
        try:
            self._unstored.store(self._catalogue)
            self._raise_stored()
            with self._catalogue.reading() as session:
                self._stored = tuple(list_alarms(session, rig=self._rig, standing=True))
            self._problem = None
        except StoreError as error:
            self._problem = str(error)
        self._watch_database()
        self._watch_drive()

    def _raise_stored(self) -> None:
        found = [] if self._runs is None else [cut_off_run(self._catalogue, self._rig, self._folders)]
        if self._settings.failed_jobs:
            found += self._failed_jobs()
        for alarm in found:
            if alarm is not None:
                self._catalogue.write(partial(add_alarm, new=alarm))

    def _failed_jobs(self) -> list[NewAlarm | None]:
        oldest = datetime.now(UTC) - OLD
        failed = self._catalogue.read(list_jobs, state=JobState.FAILED, limit=20)
        return [
            NewAlarm(
                AlarmKind.JOB_FAILED, self._rig, f"job {job.id} ({job.kind}), asked for by {job.asked_by}: {job.error}",
                f"job {job.id} failed", happened_at=job.finished_at,
            )
            for job in failed if job.finished_at is not None and job.finished_at > oldest
        ]  # fmt: skip

    def _raise(self, since: ConditionTimer, kind: AlarmKind, text: str) -> None:
        """Raise one alarm about something that lasts."""
        if not since.is_told:
            since.is_told = True
            self._unstored.add(NewAlarm(kind, self._rig, text, f"{kind} since {since.at.isoformat()}"))

    def _watch_database(self) -> None:
        """Raise an alarm where what a run records cannot be stored for too long."""
        runs = self._runs
        if runs is None:
            return
        problem = self._problem or runs.records_wait
        lasts = self._away.lasts(problem is not None)
        is_at_work = runs.state.phase.is_of_a_run or runs.records_wait is not None
        self._was_at_work = problem is not None and (self._was_at_work or is_at_work)
        if lasts >= self._settings.database_away and self._was_at_work:
            text = f"what is measured on {self._rig} cannot be stored since {self._away.at:%H:%M:%S} UTC: {problem}"
            self._raise(self._away, AlarmKind.DATABASE_AWAY, text)

    def _watch_drive(self) -> None:
        """Raise an alarm where drive process or tester give no sign of life while a run is carried out."""
        runs = self._runs
        if runs is None:
            return
        state = runs.state
        is_lost = state.phase is Phase.UNKNOWN
        is_at_work, run = state.phase.is_of_a_run or (is_lost and self._drove), f"run {state.run_id}"
        self._drove = is_at_work
        is_silent = is_at_work and not is_lost and state.tester_silent is not None
        self._tester_silent.lasts(is_silent)
        if is_silent:
            text = f"the tester of {self._rig} does not answer while {run} waits: {state.tester_silent}"
            self._raise(self._tester_silent, AlarmKind.TESTER_SILENT, text)
        self._watch_trip(state)
        is_unknown = state.phase is Phase.STOPPING and state.rest_unknown is not None
        if self._stuck.lasts(is_at_work and (is_unknown or state.shut_down is not None)) >= STUCK:
            why = (
                f"and its actuator was not confirmed at rest: {state.rest_unknown}"
                if is_unknown
                else f"although its actuator is shut down: {state.shut_down}"
            )
            self._raise(self._stuck, AlarmKind.RUN_STUCK, f"{run} on {self._rig} does not end, {why}")
        problem = self._drive_problem(runs) if is_at_work else None
        if self._silent.lasts(problem is not None) >= DRIVE_SILENT:
            text = f"the drive process of {self._rig} does not answer while {run} is carried out: {problem}"
            self._raise(self._silent, AlarmKind.DRIVE_SILENT, text)

    def _watch_trip(self, state: RigState) -> None:
        """Raise an alarm where the tester trips while no run is carried out, or a run goes on waiting after it."""
        is_of_a_run = state.phase.is_of_a_run
        is_known = state.phase is not Phase.UNKNOWN and state.tester_silent is None
        self._was_ready = self._was_ready or (is_known and not state.is_tripped)
        lasts = self._tripped.lasts(state.is_tripped and (state.idle_trip or is_of_a_run))
        is_due = self._tripped.is_on and (state.idle_trip or lasts >= STUCK)
        # an alarm that stands may be about this trip, raised before the service or the drive process was started again
        may_stand = not self._was_ready and any(alarm.kind is AlarmKind.TESTER_TRIPPED for alarm in self.standing)
        if is_due and not may_stand:
            self._was_ready = False
            when = f"while run {state.run_id} waits" if is_of_a_run else "while no run was carried out"
            text = f"the tester of {self._rig} was stopped by {stopping_text(state.interlocks)} {when}"
            self._raise(self._tripped, AlarmKind.TESTER_TRIPPED, text)

    def _drive_problem(self, runs: RunManager) -> str | None:
        try:
            runs.check_drive(SIGN_OF_LIFE)
        except NoDriveError as error:
            return str(error)
        return None


def cut_off_run(catalogue: Catalogue, rig: str, folders: Iterable[Path]) -> NewAlarm | None:
    """The alarm where the run that was begun or resumed last on the rig was cut off; None where it was not.

    Args:
        folders: where spools of its runs are.
    """
    before = _running(catalogue, rig)
    if before is None or any(_writes(folder, before[0]) for folder in folders) or _running(catalogue, rig) != before:
        return None
    run, events = before
    text = f"run {run.id} ({run.title}) on {rig} was cut off: nothing carries it out any more"
    return NewAlarm(AlarmKind.RUN_CUT_OFF, rig, text, f"run {run.id} cut off, event {events} of its history", run.id)


def _running(catalogue: Catalogue, rig: str) -> tuple[Run, int] | None:
    found = catalogue.read(latest_of_rig, rig)
    return found if found is not None and found[0].state is RunState.RUNNING else None


def _writes(folder: Path, run: Run) -> bool:
    """Whether a spool of the run is there that is written, or not stored yet."""
    return bool(spools_of(folder, run.waveform_file))
