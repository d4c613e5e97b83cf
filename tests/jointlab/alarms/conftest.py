"""Both databases, a simulated laboratory with a run manager, receivers, and an alarm."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from store.catalogue import Catalogue
from store.service.alarms import Alarm, NewAlarm, add_alarm
from store.states import AlarmKind
from tests.api.service.conftest import managing
from tests.certificates import certificate_in
from tests.jointlab.alarms.receivers import Received, web_server
from tests.jointlab.runs.conftest import catalogue, distant_url, proxy

__all__ = ["catalogue", "distant_url", "managing", "proxy"]
Raise = Callable[..., Alarm]


@pytest.fixture
def receiver() -> Iterator[Received]:
    with web_server() as received:
        yield received


@pytest.fixture
def raise_alarm(catalogue: Catalogue) -> Raise:
    """Store an alarm of this cause."""

    def raise_one(cause: str = "the pump stopped") -> Alarm:
        with catalogue.writing() as session:
            alarm = add_alarm(session, NewAlarm(AlarmKind.TEST, "rig", f"it is said that {cause}", cause))
        assert alarm is not None
        return alarm

    return raise_one


@pytest.fixture
def certificate(tmp_path: Path) -> tuple[Path, Path]:
    """A certificate of this computer, and its key."""
    return certificate_in(tmp_path, "DNS:localhost")
