"""What happens at the rig while `jointlab run` waits for Enter is shown at once, and a run that is lost is left."""

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest
import yaml

from api.commands import following
from api.commands.console import PlainConsole
from api.commands.following import RunFollower
from jointlab.drive.endpoint import NoDriveError
from jointlab.drive.process import driving
from jointlab.errors import INSTRUMENT
from jointlab.settings import Settings
from jointlab.supervision.manager import RunManager
from rig.events import ignore_event
from rig.sequences.sequence import sequence_from
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from tests.api.commands.test_interrupts import Terminal
from tests.api.conftest import paper
from tests.api.service.conftest import catalogue, rig_settings
from tests.drive_holder import drive_process
from tests.waiting import LONG

__all__ = ["catalogue", "rig_settings"]
MOUNT = "mount the cylinders of joint I in shear, step back, then press Enter"
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 40, "last": 120, "step": 80},
}  # fmt: skip


@pytest.fixture
def terminal(laboratory: Laboratory, tmp_path: Path) -> Iterator[Terminal]:
    """`jointlab run` at a terminal, which waits for a person to mount."""
    file = tmp_path / "sequence.yaml"
    file.write_text(yaml.safe_dump(paper() | {"steps": [SWEEP]}), encoding="utf-8")
    with closing(Terminal(tmp_path, "run", str(file))) as terminal:
        terminal.wait_for(MOUNT)
        yield terminal


def test_a_trip_is_shown_while_a_person_is_waited_for_and_the_prompt_after_it(
    terminal: Terminal, laboratory: Laboratory
) -> None:
    terminal.forget()
    laboratory.tester.emergency_stop()
    terminal.wait_for("the tester has stopped the actuator: emergency stop")
    terminal.wait_for(MOUNT)
    terminal.type_keys(b"\x03")
    terminal.wait_for("run 1 stopped; jointlab resume 1 goes on with it")
    assert terminal.process.wait(LONG) == 130


def test_a_run_that_another_program_ends_while_a_person_is_waited_for_ends_at_once(
    terminal: Terminal, rig_settings: Settings, catalogue: Catalogue
) -> None:
    terminal.forget()
    with closing(RunManager(catalogue, rig_settings, starts=False)) as other:
        other.end_run(1, "ann")
    terminal.wait_for("run 1 stopped; jointlab resume 1 goes on with it")
    assert terminal.process.wait(LONG) == 130


def test_a_drive_process_that_is_killed_while_a_person_is_waited_for_ends_the_command(
    terminal: Terminal, tmp_path: Path
) -> None:
    terminal.forget()
    os.kill(drive_process(tmp_path), signal.SIGKILL)
    terminal.wait_for("the drive process is lost")
    terminal.wait_for("run 1 was cut off")
    assert terminal.process.wait(LONG) == INSTRUMENT


def look_on(follower: RunFollower) -> None:
    """Until it raises."""
    while True:
        follower.look()


def test_where_no_drive_process_can_be_started_again_the_run_is_left_after_a_time(
    catalogue: Catalogue, rig_settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(following, "LOST_TIMEOUT", 0.3)
    console = PlainConsole(stderr=True)
    with ExitStack() as held:
        with driving(rig_settings):
            rig = held.enter_context(closing(RunManager(catalogue, rig_settings, starts=False)))
            rig.lease.take("test", "test")
            follower = RunFollower(rig, ignore_event, console)
            run = rig.run(sequence_from(paper() | {"steps": [{"step": "wait", "seconds": 600}]}), "test")
            follower.look()
        with pytest.raises(NoDriveError, match=f"no drive process has answered for 0.3 s .*: run {run} is lost"):
            look_on(follower)
