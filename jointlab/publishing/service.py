"""One service as programs see it that publish its rig: they ask for its state, and follow its events."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import NoReturn

from jointlab.client import Client, ProblemError
from jointlab.client.connection import RigEvent
from jointlab.documents.alarms import AlarmDocument
from jointlab.documents.results import AnalysisDocument
from jointlab.documents.rig import RigDocument
from jointlab.errors import JointlabError
from jointlab.publishing.settings import SERVICE_KEY

log = logging.getLogger(__name__)

TIMEOUT = 5.0
"""Seconds that an answer of the service may take; it is asked up to four times before it counts as away."""
PAUSE = 1.0
"""Seconds before the events are asked for again after the connection was lost."""
LISTED = 100
"""Alarms and results at most that are published at a time."""
LONGEST_REASON = 300
BEFORE_THE_FIRST = "none-0"
"""As the number of the last event seen, asks for all that the service has kept."""


class ServiceAwayError(Exception):
    """The service does not say what the rig does; the message says why."""


class Service:
    """A service that is read. Methods raise `ServiceAwayError` where it does not answer as it should.

    Args:
        address: such as ``http://127.0.0.1:8000``.
        key: with the scope read:data; None where none is needed.
    """

    def __init__(self, address: str, key: str | None) -> None:
        self._client = Client(address, key, timeout=TIMEOUT)

    def close(self) -> None:
        """Close the connection."""
        self._client.close()

    def rig(self) -> RigDocument:
        """The state of the rig."""
        with _asked():
            return self._client.rig()

    def standing_alarms(self, rig: str) -> list[AlarmDocument]:
        """Alarms of a rig that nobody has acknowledged, newest first."""
        with _asked():
            return list(islice((each for each in self._client.alarms(standing=True) if each.rig == rig), LISTED))

    def results(self, run: int) -> list[AnalysisDocument]:
        """Results of a run, newest first."""
        with _asked():
            return list(islice(self._client.analyses(run), LISTED))

    def latest_event(self) -> str:
        """What to follow the events after, so that only new ones come."""
        latest = self.rig().latest_event
        with _asked(), self._client.events(BEFORE_THE_FIRST) as events:
            kept = events if latest else iter(())
            return next((each.id for each in kept if number_of(each) >= latest), BEFORE_THE_FIRST)

    def follow(self, after: str, tell: Callable[[RigEvent], None]) -> NoReturn:
        """Tell every event after the one with this id, in order; where the service is away, go on when it is back.

        The service keeps the events meanwhile: while `tell` waits, no further one is taken.
        """
        while True:
            try:
                with self._client.events(after) as events:
                    for event in events:
                        tell(event)
                        after = event.id
            except ProblemError as problem:
                log.debug("no events: %s", problem)  # who asks for the state says that the service is away
            time.sleep(PAUSE)


@contextmanager
def answering_at_the_start() -> Iterator[None]:
    """Raises JointlabError where the service is away within: at the start its address or key is wrong."""
    try:
        yield
    except ServiceAwayError as away:
        raise JointlabError(
            f"{away}; correct the address of the service with --service, or its key in {SERVICE_KEY}"
        ) from away


def number_of(event: RigEvent) -> int:
    """The number of an event in the journal of its rig."""
    return int(event.id.rpartition("-")[2])


@contextmanager
def _asked() -> Iterator[None]:
    try:
        yield
    except ProblemError as problem:
        raise ServiceAwayError(" ".join(str(problem).split())[:LONGEST_REASON]) from problem  # it may be a page of HTML
    except ValueError as error:  # of pydantic or json
        raise ServiceAwayError("what answers is no service of Jointlab") from error
