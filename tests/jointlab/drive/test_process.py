"""The drive process itself: what it loads, who may be it, how it ends, and STOP whatever other programs do."""

import json
import os
import signal
import socketserver
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import httpx
import pytest

from api.commands.drive import ask_listener, reset_stop, stop
from api.page.frame import badge_of
from api.page.steering import prompt_text
from api.page.views.dashboard import interlocks_text
from jointlab.drive.phase import Phase
from jointlab.drive.process import HOLDER, LOG, STOP_ADDRESS, STOP_LATCHED, DriveBusyError, driving, run
from jointlab.drive.protocol import Ask, Begin
from jointlab.drive.state import NOT_READ
from jointlab.settings import DriveSettings, Settings
from jointlab.supervision.drive_link import NEEDED, DriveLink
from jointlab.supervision.drive_mirror import DriveMirror
from rig.errors import RigError, RunStoppedError
from rig.registers import State
from rig.runs.records import RunOrder
from rig.tester.limits import TesterLimits
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.tester_server import TesterFault
from store.errors import StoreError
from store.states import RunState
from tests.jointlab.drive.conftest import Heard, begin, is_at_rest
from tests.waiting import LONG, until

HEAVY = ("sqlalchemy", "alembic", "psycopg", "fastapi", "starlette", "uvicorn", "nicegui", "typer", "matplotlib")
CLIENT = """
import socket, sys, time
from pathlib import Path
from jointlab.settings import Settings
from jointlab.supervision.drive_link import DriveLink
settings = Settings.model_validate_json(Path(sys.argv[1]).read_bytes())
link = DriveLink(settings, "client", lambda n: None, lambda w: None, lambda w: None, starts=False)
print(link.take_lease("client"), flush=True)
time.sleep(600)
"""


def _may_come_first() -> bool:
    """Whether a process may take a real-time priority here; asked in one of its own, which ends with it."""
    asked = "import os; os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))"
    return not subprocess.run([sys.executable, "-c", asked], check=False, capture_output=True).returncode


MAY_COME_FIRST = _may_come_first()


class Greeting(socketserver.BaseRequestHandler):
    """Another program, which sends a greeting to each client."""

    def handle(self) -> None:
        self.request.recv(100)
        self.request.sendall(b"220 welcome\n")


@contextmanager
def drive_process(settings: Settings, folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A drive process."""
    folder.mkdir(parents=True, exist_ok=True)
    given = folder / "settings.json"
    given.write_text(settings.model_dump_json(include=NEEDED), encoding="utf-8")
    process = subprocess.Popen([sys.executable, "-m", "jointlab.drive", str(given)])
    try:
        until(lambda: process.poll() is not None or (folder / "drive.socket").exists())
        yield process
    finally:
        process.terminate()
        process.wait(LONG)


@contextmanager
def linked(settings: Settings, heard: Heard) -> Iterator[DriveLink]:
    with closing(
        DriveLink(settings, "test", heard.news.append, heard.losses.append, lambda welcome: None, starts=False)
    ) as link:
        yield link


def test_it_loads_neither_database_nor_page_nor_simulation() -> None:
    said = subprocess.run(
        [sys.executable, "-c", "import sys, jointlab.drive.__main__; print('\\n'.join(sys.modules))"],
        capture_output=True, text=True, check=True, env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip
    loaded = {name.split(".")[0] for name in said.stdout.splitlines()}
    assert not loaded & {*HEAVY, "simlab", "api"}
    assert "jointlab.supervision" not in said.stdout


def test_it_loads_where_there_are_no_unix_sockets() -> None:
    without = "import socket; del socket.AF_UNIX; import jointlab.drive.__main__"
    subprocess.run([sys.executable, "-c", without], check=True, env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"})


@pytest.mark.parametrize("name", ["stop.json", "drive.binding"])
def test_a_file_of_its_folder_that_cannot_be_written_is_told_as_an_error_of_the_store(
    drive_settings: Settings, tmp_path: Path, name: str
) -> None:
    in_the_way = tmp_path / "drive" / name
    in_the_way.mkdir(parents=True)
    with pytest.raises(StoreError, match="the drive process cannot use") as raised, driving(drive_settings):
        pass
    assert str(tmp_path / "drive") in str(raised.value)
    in_the_way.rmdir()
    with driving(drive_settings):  # nothing of the attempt is left
        pass


def test_an_error_of_those_who_use_the_drive_process_stays_as_it_is(drive_settings: Settings) -> None:
    with pytest.raises(OSError, match="of another place"), driving(drive_settings):
        raise OSError("of another place")


def test_a_log_that_cannot_be_written_is_told_as_an_error_of_the_store(
    drive_settings: Settings, tmp_path: Path
) -> None:
    (tmp_path / "drive" / LOG).mkdir(parents=True)
    with pytest.raises(StoreError, match=f"the drive process cannot use .*{LOG}"):
        run(drive_settings)


def test_one_process_drives_a_rig_and_a_tester(drive_settings: Settings, tmp_path: Path) -> None:
    with driving(drive_settings):
        with pytest.raises(DriveBusyError, match=r"'rig under test' is driven by .+@.+, process \d+"):
            driving(drive_settings).__enter__()
        elsewhere = {"drive": DriveSettings(folder=tmp_path / "elsewhere", stop_port=0), "rig": "another"}
        with pytest.raises(DriveBusyError, match="'another' is driven by"):
            driving(drive_settings.model_copy(update=elsewhere)).__enter__()
    with driving(drive_settings):
        pass


@pytest.mark.skipif(sys.platform != "linux", reason="the lock that all users see is one of Linux")
def test_a_process_of_another_user_does_not_drive_the_same_tester(
    drive_settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with drive_process(drive_settings, tmp_path / "drive"):
        monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "of-another-user"))
        theirs = {"drive": DriveSettings(folder=tmp_path / "theirs", stop_port=0), "rig": "another"}
        with pytest.raises(DriveBusyError, match="driven by a process of another user"):
            driving(drive_settings.model_copy(update=theirs)).__enter__()
    with driving(drive_settings):
        pass


def test_a_signal_ends_it_with_the_run_ended_and_the_actuator_at_rest(
    drive_settings: Settings, tmp_path: Path, laboratory: Laboratory, order: RunOrder, hand: OperatorClient
) -> None:
    heard = Heard()
    with drive_process(drive_settings, tmp_path / "drive") as process, linked(drive_settings, heard) as link:
        begin(link, heard, order, link.take_lease("test"))
        process.terminate()
        assert process.wait(LONG) == 0
    assert heard.now.state.ended_as is RunState.STOPPED
    assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


@pytest.mark.skipif(not MAY_COME_FIRST, reason="the system allows this user no real-time priority")
def test_every_thread_of_it_comes_before_other_processes(
    drive_settings: Settings, tmp_path: Path, order: RunOrder, hand: OperatorClient
) -> None:
    heard = Heard()
    with drive_process(drive_settings, tmp_path / "drive") as process, linked(drive_settings, heard) as link:
        begin(link, heard, order, link.take_lease("test"))  # with heartbeat, monitor and the thread of the run
        threads = [int(each.name) for each in Path(f"/proc/{process.pid}/task").iterdir()]
        assert len(threads) > 8
        assert {os.sched_getscheduler(each) for each in threads} == {os.SCHED_RR}
    assert "with real-time priority 1" in (tmp_path / "drive" / "drive.log").read_text()


@pytest.mark.parametrize("blow", [signal.SIGSTOP, signal.SIGKILL], ids=["frozen", "killed"])
def test_stop_works_where_the_program_that_steers_is_frozen_or_killed(
    blow: signal.Signals, drive_settings: Settings, tmp_path: Path, laboratory: Laboratory, order: RunOrder,
    hand: OperatorClient,
) -> None:  # fmt: skip
    heard = Heard()
    with drive_process(drive_settings, tmp_path / "drive"), linked(drive_settings, heard) as link:
        client = subprocess.Popen(
            [sys.executable, "-c", CLIENT, str(tmp_path / "drive" / "settings.json")], stdout=subprocess.PIPE
        )
        assert client.stdout is not None
        begin(link, heard, order, int(client.stdout.readline()))
        client.send_signal(blow)
        measured = heard.now.state.sines
        until(lambda: heard.now.state.sines > measured)  # the run goes on by itself
        assert json.loads(ask_listener(drive_settings, b"STOP\n"))["at_rest"] is True
        assert is_at_rest(laboratory)
        client.kill()
        client.wait()
        client.stdout.close()


def test_a_run_is_ended_when_nobody_steers_any_more_where_that_is_configured(
    drive_settings: Settings, tmp_path: Path, laboratory: Laboratory, order: RunOrder, hand: OperatorClient
) -> None:
    alone = drive_settings.drive.model_copy(update={"when_alone": "stop"})
    heard = Heard()
    with drive_process(drive_settings.model_copy(update={"drive": alone}), tmp_path / "drive"):
        with linked(drive_settings, heard) as link:
            begin(link, heard, order, link.take_lease("test"))
        until(lambda: is_at_rest(laboratory) and laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF)
        with linked(drive_settings, heard) as link:
            assert heard.end() is RunState.STOPPED
            assert heard.now.state.reason == "no program steers the rig any more"


def test_stop_is_not_confirmed_by_another_program_on_its_port(
    drive_settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socketserver.TCPServer(("127.0.0.1", 0), Greeting) as other:
        threading.Thread(target=other.handle_request, daemon=True).start()
        drive = drive_settings.drive.model_copy(update={"stop_port": other.server_address[1]})
        settings = drive_settings.model_copy(update={"drive": drive})
        monkeypatch.setattr("api.commands.drive.load_settings", lambda: settings)
        with pytest.raises(RigError, match=r"no drive process: STOP is not confirmed; press the red button"):
            stop(state=False, reset=False)


def test_stop_works_while_the_protocol_is_flooded(
    drive_settings: Settings, tmp_path: Path, laboratory: Laboratory, order: RunOrder, hand: OperatorClient
) -> None:
    heard, over = Heard(), threading.Event()
    with drive_process(drive_settings, tmp_path / "drive"), linked(drive_settings, heard) as link:

        def flood() -> None:
            while not over.is_set():
                link.ask(Ask(), LONG)

        begin(link, heard, order, link.take_lease("test"))
        flooding = [threading.Thread(target=flood) for _ in range(8)]
        for each in flooding:
            each.start()
        assert json.loads(ask_listener(drive_settings, b"STOP\n"))["at_rest"] is True
        over.set()
        for each in flooding:
            each.join()
    assert is_at_rest(laboratory)


def test_a_stop_that_was_not_reset_outlives_its_process(
    drive_settings: Settings, tmp_path: Path, order: RunOrder, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "drive"
    with drive_process(drive_settings, folder) as process:
        ask_listener(drive_settings, b"STOP\n")
        until(lambda: b'"epoch":' in _kept(folder))
        process.kill()
        process.wait()
    heard = Heard()
    with driving(drive_settings), linked(drive_settings, heard) as link:
        until(lambda: heard.now.stop is not None)
        assert heard.now.stop is not None
        assert heard.now.stop.who == "STOP listener, from 127.0.0.1"
        with pytest.raises(RunStoppedError, match="STOP is in force"):
            link.ask(Begin(order=order, limits=TesterLimits(), lease=link.take_lease("test")))
    (folder / STOP_LATCHED).write_bytes(b"")  # as where the disk was full
    with driving(drive_settings):
        assert json.loads(ask_listener(drive_settings, b"STATE\n"))["stop"]["who"] == "an earlier process"
        monkeypatch.setattr("typer.confirm", lambda said, abort: None)
        reset_stop(drive_settings)
    assert not (folder / STOP_LATCHED).exists()
    with driving(drive_settings):
        assert json.loads(ask_listener(drive_settings, b"STATE\n"))["stop"] is None


def _kept(folder: Path) -> bytes:
    try:
        return (folder / STOP_LATCHED).read_bytes()
    except FileNotFoundError:
        return b""


def test_stop_is_asked_for_by_its_address_where_the_service_and_its_protocol_are_not(
    drive_settings: Settings, tmp_path: Path
) -> None:
    with driving(drive_settings) as drive:
        address, port = json.loads((tmp_path / "drive" / STOP_ADDRESS).read_text(encoding="ascii"))
        assert (address, port) == ("127.0.0.1", drive.listener.port)
        assert httpx.get(f"http://{address}:{port}/state").json() == {
            "rig": "rig under test", "phase": "idle", "run_id": None, "activity": "", "reason": None,
                "interlocks": [], "tripped": False, "tester_silent": None, "rest_unknown": None,
                "is_driven": True, "stop": None,
        }  # fmt: skip
        assert json.loads(ask_listener(drive_settings, b"STATE\n"))["stop"] is None


def test_the_holder_of_the_lock_is_named(drive_settings: Settings, tmp_path: Path) -> None:
    with driving(drive_settings):
        assert f"process {os.getpid()}" in (tmp_path / "drive" / HOLDER).read_text(encoding="utf-8")


def test_an_order_comes_back_as_it_was(order: RunOrder) -> None:
    sent = Begin(order=order, limits=TesterLimits(), lease=3)
    assert Begin.model_validate_json(sent.model_dump_json()) == sent


def test_a_stop_in_force_is_shown_where_its_drive_process_does_not_answer_any_more(drive_settings: Settings) -> None:
    with driving(drive_settings) as drive:
        mirror = DriveMirror(drive_settings, "test", before=ignore, after=ignore, found=ignore, starts=False)
        drive.rig.halter.press("test", "there is smoke")
        until(lambda: mirror.snapshot.stop is not None)
    until(lambda: mirror.snapshot.state.tester_silent is not None)
    stop = mirror.snapshot.stop
    assert stop is not None
    assert stop.why == "there is smoke"
    mirror.close()


def ignore(_news: object) -> None:
    """Take what a mirror tells, and do nothing."""


def test_a_rig_whose_process_is_lost_is_told_as_not_known_and_not_as_at_rest(drive_settings: Settings) -> None:
    def ignore(_told: object) -> None:
        pass

    with ExitStack() as stack:
        with driving(drive_settings):
            mirror = DriveMirror(drive_settings, "test", before=ignore, after=ignore, found=ignore, starts=False)
            stack.callback(mirror.close)
            assert mirror.snapshot.state.phase is Phase.IDLE
        until(lambda: mirror.snapshot.state.phase is Phase.UNKNOWN)
        state = mirror.snapshot.state
        assert badge_of(state) == ("not known: the drive process does not answer", "tripped")
        assert "The drive process does not answer: what the machine does is not known" in interlocks_text(state)
        assert "No interlock has stopped" not in interlocks_text(state)
        assert prompt_text(state, None, None).startswith("The drive process does not answer")
        with driving(drive_settings):
            until(lambda: mirror.snapshot.state.phase is Phase.IDLE)


def test_a_tester_that_was_not_read_since_its_process_began_is_not_told_as_at_rest(
    drive_settings: Settings, laboratory: Laboratory
) -> None:
    laboratory.tester.faults.set(TesterFault.SILENT)
    with driving(drive_settings) as drive:
        told = [badge_of(drive.rig.snapshot().state)[0]]

        def is_told_why() -> bool:
            told.append(badge_of(drive.rig.snapshot().state)[0])
            return drive.rig.snapshot().state.tester_silent not in (None, NOT_READ)

        until(is_told_why)
        laboratory.tester.faults.clear()
        until(lambda: drive.rig.snapshot().state.tester_silent is None)
    assert "at rest" not in told
