"""Fixtures that every test folder may use."""

import gc
import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, settings

from store.catalogue import Catalogue
from tests.databases import database_kind, database_url, postgresql
from tests.recordings import Recording, find_recording
from tests.stalls import Repetition

__all__ = ["database_kind", "database_url", "postgresql"]

# A shell that runs the tests in the background lets them ignore Ctrl-C, and every process they start inherits that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# What decides whether a change lands draws the same examples every time; elsewhere new ones are searched.
# How fast the machine is decides nothing.
settings.register_profile(
    "here", derandomize="CI" in os.environ, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("here")


def pytest_configure(config: pytest.Config) -> None:
    """Repeat tests that fail while the computer stands still."""
    config.pluginmanager.register(Repetition())


# Imports and tests that are collected are no garbage; looking for it among them took half of the time.
gc.disable()


def pytest_collection_finish() -> None:
    """Collect garbage from here on, of what tests leave."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def state_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Drive processes of tests meet none of this computer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(scope="session", autouse=True)
def lines_close_at_once() -> Iterator[None]:
    """Without the 0.3 s that pyserial sleeps after it has closed a socket; a run closes its thermometer three times."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("serial.urlhandler.protocol_socket.time", SimpleNamespace(sleep=lambda seconds: None))
        yield


@pytest.fixture(scope="session")
def recording() -> Recording:
    """Finds recorded data and examples; a test skips where those that it asks for are absent."""
    return find_recording


@pytest.fixture(scope="session")
def sqlite_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty catalogue, to be copied: that is faster than to make its tables."""
    path = tmp_path_factory.mktemp("sqlite") / "template.db"
    Catalogue.open(f"sqlite:///{path}").close()
    return path


@pytest.fixture
def catalogue(sqlite_template: Path, tmp_path: Path) -> Iterator[Catalogue]:
    """An empty catalogue of this test alone, on SQLite."""
    shutil.copy(sqlite_template, tmp_path / "lab.db")
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as opened:
        yield opened
