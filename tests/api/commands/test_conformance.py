"""`jointlab conformance`: a table, a JSON file and an exit code; nothing moves without consent."""

import io
import json
import wave
from pathlib import Path

import pytest

from jointlab.drive import process
from jointlab.settings import Settings
from rig.registers import State
from simlab.laboratory import Laboratory
from tests.api.conftest import Command

EXAMPLE = Path(__file__).resolve().parents[3] / "docs" / "examples" / "own_daq.py"


@pytest.fixture
def silence(tmp_path: Path) -> Path:
    path = tmp_path / "silence.wav"
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(8000)
        file.writeframes(bytes(16_000))
    return path


def test_an_acquisition_plug_in_is_checked_from_its_file(jointlab: Command, silence: Path, tmp_path: Path) -> None:
    plug_in = ("--plugin", f"{EXAMPLE}:open_source")
    done = jointlab("conformance", "daq", f"wav://{silence}", *plug_in, "--json", "found.json")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "passed    acquisition, connected WAV file" in done.stdout
    assert "0 failed" in done.stdout
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert found["format"] == "jointlab-conformance/1"
    assert {check["state"] for check in found["checks"]} == {"passed", "not done"}
    wrong = jointlab("conformance", "daq", f"wav://{silence}", *plug_in, "--volts", "0.5")
    assert wrong.returncode == 4
    assert "FAILED    input_1, known voltage 0 V (expected 0.5 V): scaling has to make V" in wrong.stdout


def test_a_tester_is_checked_at_rest_and_by_one_program_at_a_time(jointlab: Command, laboratory: Laboratory) -> None:
    url = laboratory.addresses.tester
    done = jointlab("conformance", "tester", url)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "allow it (--move)" in done.stdout
    with process.tester_held(Settings.model_construct(rig="rig", tester_url=url), url):
        held = jointlab("conformance", "tester", url)
    assert held.returncode != 0
    assert "is driven by" in held.stderr


def test_without_a_yes_nothing_moves(
    jointlab: Command, laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = list(laboratory.tester.device.applied)
    monkeypatch.setattr("sys.stdin", io.StringIO("n\n"))
    assert jointlab("conformance", "tester", laboratory.addresses.tester, "--move").returncode == 1
    assert laboratory.tester.device.applied == before
    assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


def test_an_unknown_plug_in_is_bad_input(jointlab: Command) -> None:
    done = jointlab("conformance", "daq", "sound://0")
    assert (done.returncode, "no installed package offers the plug-in 'sound'" in done.stderr) == (3, True)
