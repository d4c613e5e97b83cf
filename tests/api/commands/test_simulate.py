"""`jointlab simulate`: instruments for somebody else to connect to."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import pytest

from jointlab.instruments import instruments_of
from jointlab.settings import load_settings
from rig.registers import State
from simlab.laboratory import Addresses
from tests.api.conftest import Command, Query, Write
from tests.waiting import LONG

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def simulating(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[subprocess.Popen[str]]:
    """The command in a process of its own, as a technician starts it, with further options where a test gives them."""
    command = [sys.executable, "-m", "api.cli", "simulate", "--json", "--speed", "50", "--config"]
    process = subprocess.Popen(
        [*command, str(tmp_path / "jointlab.toml"), *getattr(request, "param", ())],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    with process:
        yield process
        process.kill()


def test_its_file_leads_to_three_instruments_until_ctrl_c(
    simulating: subprocess.Popen[str], jointlab: Command, sequence: Write, tmp_path: Path
) -> None:
    assert simulating.stdout is not None
    assert simulating.stderr is not None
    addresses = json.loads(simulating.stdout.readline())
    assert set(addresses) == {field.name for field in fields(Addresses)}
    settings = load_settings()
    assert settings.tester_url == addresses["tester"]
    instruments = instruments_of(settings)
    with instruments.acquisition() as (chassis, thermometer):
        chassis.verify(instruments.channels)
        assert 15 < thermometer.celsius() < 35
    with instruments.tester() as tester:
        assert tester.status().state is State.HYDRAULICS_OFF
    # the bench strikes and mounts by itself
    with (tmp_path / "jointlab.toml").open("a", encoding="utf-8") as config:
        config.write(f'[drive]\nfolder = "{tmp_path / "drive"}"\nstop_port = 0\n')
    measured = jointlab("run", sequence(hammer={"points": ["5y"]}, sweep={"configurations": ["shear"]}))
    assert measured.returncode == 0, measured.stderr
    assert "run 1 finished" in measured.stdout
    os.kill(simulating.pid, signal.SIGINT)
    out, err = simulating.communicate(timeout=LONG)
    assert (simulating.returncode, out, err) == (0, "stopped\n", "")


@pytest.mark.parametrize("simulating", [("--tester-map", "docs/examples/tester_map.toml")], indirect=True)
def test_a_tester_with_other_registers_carries_out_a_sweep(
    simulating: subprocess.Popen[str], jointlab: Command, sequence: Write, tmp_path: Path, query: Query
) -> None:
    assert simulating.stdout is not None
    addresses = json.loads(simulating.stdout.readline())
    settings = load_settings()
    assert settings.tester_map == ROOT / "docs" / "examples" / "tester_map.toml"
    assert settings.tester_url == addresses["tester"]
    with (tmp_path / "jointlab.toml").open("a", encoding="utf-8") as config:
        config.write(f'[drive]\nfolder = "{tmp_path / "drive"}"\nstop_port = 0\n')
    measured = jointlab("run", sequence(hammer=None, sweep={"configurations": ["shear"]}))
    assert measured.returncode == 0, measured.stderr
    assert "run 1 finished" in measured.stdout
    assert query("SELECT serial FROM instruments WHERE kind = 'tester'") == [("70001",)]


@pytest.mark.parametrize(
    ("name", "words"), [("mine.toml", "exists already; name a new file"), ("no/where.toml", "cannot be written")]
)
def test_a_configuration_is_written_over_nothing(jointlab: Command, tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "mine.toml").write_text("mine", encoding="utf-8")
    answer = jointlab("simulate", "--config", name)
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    assert words in line
    assert (tmp_path / "mine.toml").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("arguments", [["--seed", "-1"], ["--speed", "0"]])
def test_a_bench_that_cannot_be_is_wrong_usage(jointlab: Command, arguments: list[str]) -> None:
    assert jointlab("simulate", *arguments).returncode == 2
