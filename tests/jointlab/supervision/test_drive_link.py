"""The link to a drive process: how it says that none can be started, and that it ends where nobody could use it."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from jointlab.drive.endpoint import NoDriveError
from jointlab.drive.process import Drive, driving
from jointlab.drive.protocol import DriveRequest, Reply
from jointlab.errors import ConflictError
from jointlab.settings import DriveSettings, Settings
from jointlab.supervision import drive_link
from jointlab.supervision.drive_link import SETTINGS, DriveLink, _Line
from jointlab.supervision.drive_mirror import DriveMirror
from jointlab.supervision.manager import RunManager
from jointlab.trials.simulated_laboratory import CHANNELS
from rig.errors import RigError
from store.catalogue import Catalogue
from tests.waiting import LONG, until

OWN = {"drive news", "drive session", "ingest", "automatic operator", "lease end"}
"""Names of the threads of a manager."""


def ignore(_: object) -> None:
    """Hear nothing."""


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    drive = DriveSettings(folder=tmp_path / "drive", stop_port=0)
    return Settings(tester_url=None, channels=CHANNELS, drive=drive, rig="rig under test")


@pytest.fixture
def drive(settings: Settings) -> Iterator[Drive]:
    with driving(settings) as driven:
        yield driven


def test_a_folder_that_cannot_be_written_is_told_as_an_error_of_the_rig(settings: Settings, tmp_path: Path) -> None:
    (tmp_path / "drive" / SETTINGS).mkdir(parents=True)
    with pytest.raises(RigError, match=r"the drive process cannot be started: .*settings\.json"):
        DriveLink(settings, "test", ignore, ignore, ignore)


@pytest.mark.usefixtures("drive")
def test_a_process_that_does_not_end_keeps_no_link_open(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    with closing(DriveLink(settings, "test", ignore, ignore, ignore, starts=False)) as link:
        hanging = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        monkeypatch.setattr(link, "_process", hanging)
        monkeypatch.setattr(drive_link, "ANSWER_TIMEOUT", 0.1)
        try:
            link.close()
        finally:
            hanging.kill()
            hanging.wait()


@pytest.mark.usefixtures("drive")
def test_a_process_that_goes_on_with_its_run_keeps_no_link_open(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_link: DriveLink, _request: DriveRequest, _timeout: float = 0.0) -> Reply:
        raise ConflictError("a run is in progress; stop it first")

    before = set(threading.enumerate())
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as running:
        link = DriveLink(settings, "test", ignore, ignore, ignore, starts=False)
        monkeypatch.setattr(link, "_process", running)
        monkeypatch.setattr(DriveLink, "ask", refuse)
        link.close()
        assert running.poll() is None
    assert not started_since(before)


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """The drive process takes each link, and answers nothing that is asked then."""

    def ask(link: DriveLink, _request: DriveRequest, _timeout: float = 0.0) -> Reply:
        raise NoDriveError(f"no answer in {link.folder}")

    monkeypatch.setattr(DriveLink, "ask", ask)


def started_since(before: set[threading.Thread]) -> list[str]:
    """Names of own threads that are new; libraries keep threads of theirs, and start them when they like."""
    return [each.name for each in threading.enumerate() if each not in before and each.name in OWN]


@pytest.mark.usefixtures("drive")
def test_a_link_that_is_closed_while_it_connects_ends_without_an_error(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    wait, closing_it = _Line.wait_without_limit, threading.Event()

    def wait_once_closed(line: _Line) -> None:
        closing_it.wait(LONG)
        line.close()
        wait(line)

    monkeypatch.setattr(_Line, "wait_without_limit", wait_once_closed)
    before = set(threading.enumerate())
    with closing(DriveLink(settings, "test", ignore, ignore, ignore, starts=False)):
        closing_it.set()
    assert not started_since(before)


@pytest.mark.usefixtures("drive")
def test_the_threads_of_a_manager_end_with_it(settings: Settings, catalogue: Catalogue) -> None:
    before = set(threading.enumerate())
    with closing(RunManager(catalogue, settings, starts=False)):
        assert set(started_since(before)) == OWN
    assert not started_since(before)


@pytest.mark.usefixtures("silent")
def test_a_mirror_that_cannot_be_made_leaves_no_link_open(drive: Drive, settings: Settings) -> None:
    before = set(threading.enumerate())
    with pytest.raises(NoDriveError, match="no answer"):
        DriveMirror(settings, "test", before=ignore, after=ignore, found=ignore, starts=False)
    until(lambda: not drive.server._connections)
    until(lambda: not started_since(before))


@pytest.mark.usefixtures("silent")
def test_a_manager_that_cannot_be_made_leaves_no_thread(drive: Drive, settings: Settings, catalogue: Catalogue) -> None:
    before = set(threading.enumerate())
    with pytest.raises(NoDriveError, match="no answer"):
        RunManager(catalogue, settings, starts=False)
    until(lambda: not drive.server._connections)
    until(lambda: not started_since(before))
