"""Both databases, a simulated laboratory with a run manager, receivers, and an alarm."""

import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from store.alarms import Alarm, NewAlarm, add_alarm
from store.catalogue import Catalogue
from store.states import AlarmKind
from tests.api.service.conftest import managing
from tests.jointlab.alarms.receivers import Received, web_server
from tests.jointlab.runs.conftest import (
    catalogue,
    database_kind,
    database_url,
    distant_url,
    postgresql,
    proxy,
    sqlite_template,
)

__all__ = [
    "catalogue", "database_kind", "database_url", "distant_url", "managing", "postgresql", "proxy", "sqlite_template",
]  # fmt: skip
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
    program = shutil.which("openssl")
    if program is None:
        pytest.skip("no openssl here to make a certificate")
    paths = tmp_path / "certificate.pem", tmp_path / "key.pem"
    subprocess.run(
        [
            program, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost",
            "-addext", "subjectAltName=DNS:localhost", "-out", paths[0], "-keyout", paths[1],
        ],
        check=True, capture_output=True,
    )  # fmt: skip
    return paths
