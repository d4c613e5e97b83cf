"""The parts that routes work with: the catalogue, the rig's run manager and the queue of jobs.

The dependencies of STOP are coroutines, because these wait for no thread.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Annotated

from fastapi import Depends, Request

from api.service.downloads import DownloadPlaces
from api.service.monotonic_clock import MonotonicClock
from api.service.recent_keys import RecentKeys
from jointlab.alarms.alarms import Alarms
from jointlab.audit import RefusalLog
from jointlab.burst_log import BurstLog
from jointlab.channel_file import ChannelFile
from jointlab.drive.state import RigState
from jointlab.errors import ConflictError
from jointlab.hall import Hall
from jointlab.jobs.queue import JobQueue
from jointlab.supervision.manager import RunManager
from store.catalogue import Catalogue


@dataclass(frozen=True)
class Services:
    """The parts of a service.

    Attributes:
        runs: drives the rig; None where this service only reads.
        loopback: whether the service can be reached from this computer alone.
        jobs: queue of long computations; None where this service has none.
        alarms: tells people of what has happened; None where this service does not.
        channel_file: has the channel table; None where the instruments are simulated ones of its own.
        hall: looks at other rigs; None where the configuration names none.
        now: the time by which keys end.
        has_keys: set once the store has been seen to have a key; there is no way back.
        recent_keys: keys that were looked up a moment ago, for reads.
        session_lasts: time after which a log-in to the page ends.
        refusals: notes refused actions.
        bursts: notes what callers without a key cause.
        downloads: places for files that are sent.
    """

    catalogue: Catalogue
    runs: RunManager | None = None
    loopback: bool = True
    jobs: JobQueue | None = None
    alarms: Alarms | None = None
    hall: Hall | None = None
    channel_file: ChannelFile | None = None
    now: Callable[[], datetime] = field(default_factory=MonotonicClock)
    has_keys: threading.Event = field(default_factory=threading.Event)
    recent_keys: RecentKeys = field(default_factory=RecentKeys)
    session_lasts: timedelta = timedelta(hours=12)
    refusals: RefusalLog = field(default_factory=RefusalLog)
    bursts: BurstLog = field(default_factory=BurstLog)
    downloads: DownloadPlaces = field(default_factory=DownloadPlaces)

    @property
    def written_folders(self) -> tuple[Path, ...]:
        """The folders of this computer that are written to, beside that of the waveforms."""
        return () if self.runs is None else (self.runs.drive_folder,)

    @property
    def rig_state(self) -> RigState | None:
        """The state of the rig; None where this service drives none."""
        return None if self.runs is None else self.runs.state

    @property
    def rig_name(self) -> str | None:
        """The name of the rig; None where this service drives none."""
        return None if self.runs is None else self.runs.instruments.rig


async def services(request: Request) -> Services:
    """The services of the application that a request came to."""
    found: Services = request.app.state.services
    return found


Context = Annotated[Services, Depends(services)]


async def rig(context: Context) -> RunManager:
    """The run manager.

    Raises:
        ConflictError: this service drives no rig.
    """
    if context.runs is None:
        raise ConflictError("this service drives no rig: its channel table is empty; write [[channels]] and restart it")
    return context.runs


Rig = Annotated[RunManager, Depends(rig)]


def queue(context: Context) -> JobQueue:
    """The queue of jobs.

    Raises:
        ConflictError: this service has none.
    """
    if context.jobs is None:
        raise ConflictError("this service does no jobs; ask the one that was started with jointlab serve")
    return context.jobs


Jobs = Annotated[JobQueue, Depends(queue)]
