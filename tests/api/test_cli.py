"""The command `jointlab`: help that helps, exit codes, and no traceback."""

import pkgutil
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
import typer

import api.commands
from analysis.errors import AnalysisError
from api.cli import COMMANDS as LISTED
from api.cli import app
from daq.errors import ChannelError, DaqError, InstrumentAbsentError
from jointlab.errors import EXIT_CODES, JointlabError, SettingsError, exit_code
from rig.errors import RigError
from rig.registers import Refusal
from rig.sequences.sequence import SequenceError
from rig.sequences.sweep_plan import PlanError
from rig.tester.limits import LimitExceededError
from rig.tester.status import TesterRefusedError
from store.errors import NotFoundError, StoreError
from store.version import software_version
from tests.api.conftest import Command

PROMISED = ("demo", "simulate", "run", "import", "export", "identify", "modes", "report", "serve", "config")
COMMANDS = sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]  # of a group


def test_help_lists_every_command_with_what_it_does(jointlab: Command) -> None:
    answer = jointlab("--help")
    assert answer.returncode == 0
    assert set(COMMANDS) >= set(PROMISED)
    for command in COMMANDS:
        assert re.search(rf"^\W*{command}\s+[A-Z][a-z ]+", answer.stdout, re.MULTILINE), command


def test_the_version_names_release_and_commit(jointlab: Command) -> None:
    answer = jointlab("--version")
    assert (answer.returncode, answer.stdout.strip()) == (0, f"jointlab {software_version()}")


def test_every_command_of_every_module_is_listed() -> None:
    told: dict[str, str] = {}
    for module in pkgutil.iter_modules(api.commands.__path__):
        names = re.findall(r"`jointlab ([a-z]+)", import_module(f"api.commands.{module.name}").__doc__ or "")
        told |= dict.fromkeys(names, module.name)
    assert told == {name: module for name, (module, _) in LISTED.items()}


def test_help_needs_no_instrument_or_solver() -> None:
    code = "import sys, api.cli; sys.argv = ['jointlab', '--help']\ntry: api.cli.main()\nfinally: print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "Usage: jointlab" in done.stdout
    assert {"numpy", "scipy", "nidaqmx", "pymodbus", "sqlalchemy"}.isdisjoint(done.stdout.split("\n")[-2].split())


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_says_what_it_does_and_what_each_option_means(jointlab: Command, command: str) -> None:
    answer = jointlab(command, "--help")
    assert answer.returncode == 0
    assert f"Usage: jointlab {command}" in answer.stdout
    assert len(answer.stdout.split()) > 15
    assert "Raises:" not in answer.stdout
    assert "Args:" not in answer.stdout


def test_a_command_that_is_not_there_is_wrong_usage(jointlab: Command) -> None:
    answer = jointlab("measure")
    assert answer.returncode == 2
    assert "measure" in answer.stderr


def test_without_a_command_help_is_shown(jointlab: Command) -> None:
    answer = jointlab()
    assert "Usage: jointlab" in answer.stdout + answer.stderr


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (JointlabError(), 3),
        (SettingsError(), 3),
        (AnalysisError(), 3),
        (StoreError(), 3),
        (NotFoundError(), 3),
        (SequenceError(), 3),
        (PlanError(), 3),
        (LimitExceededError(), 3),
        (ChannelError("x"), 3),
        (DaqError("x"), 4),
        (InstrumentAbsentError("x"), 4),
        (RigError(), 4),
        (TesterRefusedError("x", Refusal.BUSY), 4),
    ],
    ids=lambda value: type(value).__name__,
)
def test_bad_input_is_3_and_an_instrument_is_4(error: Exception, code: int) -> None:
    assert exit_code(error) == code


def test_a_narrower_error_stands_before_a_wider_one() -> None:
    kinds = list(EXIT_CODES)
    for place, kind in enumerate(kinds):
        assert not any(issubclass(later, kind) for later in kinds[place + 1 :]), kind


def test_the_console_script_says_one_line_and_its_exit_code(tmp_path: Path) -> None:
    script = Path(sys.executable).with_name("jointlab")
    done = subprocess.run([script, "import", "nowhere"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr == "jointlab: there is no bundle nowhere\n"
