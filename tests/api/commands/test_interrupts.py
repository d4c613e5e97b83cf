"""Keys at the terminal while a run is on: Ctrl-Z pauses it and lets it go on, Ctrl-C stops it."""

import os
import pty
import select
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
import yaml
from rich.console import Console

from api.commands.interrupts import steering_by_keys
from api.commands.sequences import Keys
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.control import RunControl
from rig.errors import RigError
from rig.registers import State
from simlab.laboratory import Laboratory
from store.errors import StoreError
from tests.api.commands.keyboard import press
from tests.api.conftest import Command, Query, Write
from tests.waiting import LONG, until

AT_A_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)  # keys typed there are signals here
sys.argv = ["jointlab", *sys.argv[1:]]
from api.cli import main
main()
"""


@pytest.mark.usefixtures("drive")
def test_ctrl_z_pauses_a_run_with_the_actuator_at_rest_and_once_more_lets_it_go_on(
    jointlab: Command,
    sequence: Write,
    query: Query,
    laboratory: Laboratory,
    operator: SimulatedOperator,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plain_mount, states = operator.mount, list[State]()

    def actions() -> list[str]:
        return [action for (action,) in query("SELECT action FROM audit_entries ORDER BY id")]

    def go_on() -> None:
        until(lambda: actions() == ["start run", "pause run"])
        states.append(State(int(str(laboratory.tester.device.status()["state"]))))
        press(signal.SIGTSTP)

    somebody = threading.Thread(target=go_on)

    def mount(specimen: str, configuration: str) -> None:
        plain_mount(specimen, configuration)
        if configuration == "shear":
            press(signal.SIGTSTP)
            until(lambda: "pause run" in actions())  # the prompt is answered while the run is held
            somebody.start()

    monkeypatch.setattr(operator, "mount", mount)
    answer = jointlab("run", sequence())
    somebody.join()
    assert answer.returncode == 0, answer.stderr
    assert states[0] in (State.HYDRAULICS_OFF, State.HELD, State.IDLE)
    assert actions() == ["start run", "pause run", "resume run"]
    said = answer.stderr
    assert said.index("pausing: ") < said.index("paused; Ctrl-Z goes on, Ctrl-C stops") < said.index("going on")
    assert query("SELECT state, blows_accepted, sine_records FROM v_runs") == [("finished", 8, 6)]


class Terminal:
    """A terminal with `jointlab` on it."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._ours, its = pty.openpty()
        self._shown = bytearray()
        command = [sys.executable, "-c", AT_A_TERMINAL, *arguments]
        self.process = subprocess.Popen(command, cwd=folder, stdin=its, stdout=its, stderr=its, start_new_session=True)
        os.close(its)

    def wait_for(self, text: str) -> None:
        end = time.monotonic() + LONG
        while text.encode() not in self._shown:
            assert time.monotonic() < end, self._shown.decode(errors="replace")
            if select.select([self._ours], [], [], 0.1)[0]:
                self._shown.extend(os.read(self._ours, 4096))

    def forget(self) -> None:
        """Forget what was shown before."""
        self._shown.clear()

    def type_keys(self, keys: bytes) -> None:
        self.forget()
        os.write(self._ours, keys)

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self._ours)


@pytest.mark.usefixtures("laboratory")
def test_keys_typed_at_a_real_terminal_pause_a_run_and_stop_it(sequence: Write, query: Query, tmp_path: Path) -> None:
    file = sequence()
    document = yaml.safe_load(file.read_text("utf-8"))
    document["steps"] = [{"step": "wait", "seconds": 600}]
    file.write_text(yaml.safe_dump(document), encoding="utf-8")
    with closing(Terminal(tmp_path, "run", str(file))) as terminal:
        terminal.wait_for("waiting for 600 s")
        terminal.type_keys(b"\x1a")
        terminal.wait_for("paused; Ctrl-Z goes on")
        terminal.type_keys(b"\x1a")
        terminal.wait_for("going on")
        terminal.type_keys(b"\x03")
        terminal.wait_for("run 1 stopped; jointlab resume 1 goes on with it")
        assert terminal.process.wait(LONG) == 130
    assert query("SELECT state, reason FROM v_runs") == [("stopped", "stopped by hand")]


def test_ctrl_z_after_ctrl_c_pauses_nothing() -> None:
    control, console = RunControl(), Console(record=True, width=120)
    with steering_by_keys(control, console):
        press(signal.SIGINT)
        press(signal.SIGTSTP)
    assert not control.is_paused()
    assert "pausing" not in console.export_text()


def test_a_pause_that_is_not_confirmed_is_said_and_the_run_stays_paused() -> None:
    class Restless(RunControl):
        """Whose tester does not confirm."""

        def pause(self) -> int:
            super().pause()
            raise RigError("the actuator was not confirmed at rest")

    control, console = Restless(), Console(record=True, width=120)
    with steering_by_keys(control, console):
        press(signal.SIGTSTP)
        until(lambda: "not confirmed" in console.export_text(clear=False))
        assert control.is_paused()
    assert "paused;" not in console.export_text()
    assert signal.getsignal(signal.SIGTSTP) is signal.SIG_DFL


class Unstoppable(RunControl):
    """Whose tester does not confirm."""

    def stop(self, why: str | None = None, who: str | None = None) -> None:
        super().stop(why, who)
        raise RigError("the actuator was not confirmed at rest")


def test_a_stop_that_is_not_confirmed_is_said_and_ctrl_c_is_as_before_afterwards() -> None:
    before = signal.getsignal(signal.SIGINT)
    control, console = Unstoppable(), Console(record=True, width=120)
    with steering_by_keys(control, console):
        press(signal.SIGINT, 2)
    assert control.is_interrupted()
    assert signal.getsignal(signal.SIGINT) is before
    said = console.export_text()
    assert said.count("stopping: bringing an actuator that the run drives to rest") == 2
    assert said.count("the actuator was not confirmed at rest") == 2
    assert not any(thread.name == "keys" for thread in threading.enumerate())


class Unnoted(RunControl):
    """Whose pause cannot be noted."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self._error = error

    def pause(self) -> int:
        super().pause()
        raise self._error


@pytest.mark.parametrize("error", [StoreError("the database does not answer"), ValueError("nobody expects this")])
def test_ctrl_c_stops_a_run_also_after_a_key_whose_request_has_failed(error: Exception) -> None:
    control, console = Unnoted(error), Console(record=True, width=120)
    with steering_by_keys(control, console):
        press(signal.SIGTSTP)
        until(control.is_paused)
        press(signal.SIGINT)
    said = console.export_text()
    assert said.index(str(error)) < said.index("stopping: ")


def test_a_database_that_is_away_neither_keeps_a_paused_run_from_going_on_nor_hides_that_it_moves() -> None:
    rig: Any = SimpleNamespace(state=RigState(Phase.PAUSED, 7), pause=Mock(return_value=3), pause_number=3)
    away: Any = SimpleNamespace(writing=Mock(side_effect=StoreError("the database does not answer")))
    keys = Keys(rig, away)
    keys.pause()
    assert keys.is_paused()
    rig.pause.side_effect = RigError("the actuator was not confirmed at rest")
    with pytest.raises(RigError, match="not confirmed at rest"):
        keys.pause()
