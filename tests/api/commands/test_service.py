"""`jointlab serve` and `jointlab key`: where the service listens, and for whom."""

import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx
import pytest

from jointlab.drive.process import STOP_LATCHED, driving
from jointlab.drive.stop_button import RETRY
from jointlab.runs.carry_out import spool_folder
from jointlab.runs.orders import order_to_begin, plan_run
from jointlab.settings import load_settings
from jointlab.supervision.drive_link import DriveLink
from jointlab.supervision.stored_limits import save_limits
from rig.instruments import Instruments
from rig.runs.records import BeginRecord, EndRecord
from rig.runs.spool import spooling
from rig.sequences.sequence import sequence_from
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.measurements.runs import list_runs
from store.states import RunState
from tests.api.conftest import Command
from tests.rig.conftest import DOCUMENT
from tests.waiting import LONG


@contextmanager
def serving_process(folder: Path, *options: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Run `jointlab serve` in a process of its own, with the configuration in `folder` if there is one."""
    config = folder / "jointlab.toml"
    environment = {
        **os.environ,
        "JOINTLAB_DATABASE_URL": f"sqlite:///{folder / 'jointlab.db'}",
        "PYTHONUNBUFFERED": "1",
        **({"JOINTLAB_CONFIG": str(config)} if config.exists() else {}),
    }
    command = [sys.executable, "-m", "api.cli", "serve", "--port", "0", *options]
    root = Path(__file__).resolve().parents[3]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True, cwd=root)
    with process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            found = re.match(r"page (http://127\.0\.0\.1:[1-9]\d*)/page/, health \1/api/health, catalogue sqlite", line)
            assert found, line
            yield found[1], process
        finally:
            process.terminate()


@contextmanager
def serving(folder: Path, *options: str) -> Iterator[str]:
    """Run `jointlab serve` in a process of its own; its address."""
    with serving_process(folder, *options) as (address, _):
        yield address


def test_serve_says_where_it_listens_and_answers_there(measured: int, tmp_path: Path) -> None:
    with serving(tmp_path) as address:
        page = httpx.get(f"{address}/api/runs", timeout=LONG).json()
    assert [run["id"] for run in page["items"]] == [measured]


def test_serve_simulated_is_a_working_laboratory_that_stores_what_a_lost_process_has_left(tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        run = plan_run(sequence_from(DOCUMENT), TesterLimits(), catalogue, rig="rig")
        with spooling(spool_folder(catalogue), order_to_begin(run, rig="rig")) as spool:
            spool.write(BeginRecord(datetime.now(UTC), "test", (), (), None))
            spool.write(EndRecord(datetime.now(UTC), "test", RunState.FAILED, "the database is locked"))
    with serving(tmp_path, "--simulated", "--speed", "100") as address:
        assert httpx.get(f"{address}/api/health", timeout=LONG).json()["drives_a_rig"] is True
        assert httpx.get(f"{address}/api/rig", timeout=LONG).json()["phase"] == "idle"
        found = httpx.get(f"{address}/api/runs/{run.id}", timeout=LONG).json()
    assert (found["state"], found["reason"]) == ("failed", "the database is locked")


def test_a_simulated_rig_meets_no_real_one(tmp_path: Path) -> None:
    with TemporaryDirectory() as scratch:  # pytest's own folder is too long for a socket
        of_rig = Path(scratch)
        (of_rig / STOP_LATCHED).touch()  # of the real rig: its STOP is in force
        written = f'[drive]\nfolder = "{of_rig}"\nstop_button = "/dev/of-the-real-rig"\n'
        (tmp_path / "jointlab.toml").write_text(written, encoding="utf-8")
        with serving(tmp_path, "--simulated", "--speed", "100") as address:
            time.sleep(2 * RETRY)  # a button whose line cannot be opened presses STOP
            assert httpx.get(f"{address}/api/rig", timeout=LONG).json()["stop"] is None
            assert {each.name for each in of_rig.iterdir() if each.is_file()} == {STOP_LATCHED}


@pytest.mark.usefixtures("operator")
def test_a_second_program_drives_only_when_the_first_does_no_more(
    jointlab: Command, sequence: Callable[..., Path], tmp_path: Path
) -> None:
    settings = load_settings()
    with driving(settings):
        with closing(
            DriveLink(settings, "first", lambda news: None, lambda why: None, lambda welcome: None, starts=False)
        ) as first:
            first.take_lease("somebody")
            refused = jointlab("run", sequence())
            assert refused.returncode == 3
            assert refused.stderr.splitlines() == ["jointlab: somebody drives the rig from another program"]
        with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.reading() as session:
            assert list_runs(session) == []
        done = jointlab("run", sequence(hammer={"points": ["5y"]}))
        assert done.returncode == 0, done.stderr


@pytest.mark.usefixtures("drive", "operator")
def test_limits_that_were_set_bind_the_command_line_too(
    jointlab: Command, sequence: Callable[..., Path], tmp_path: Path
) -> None:
    ordinary = Instruments("local", "tcp://127.0.0.1:9", "", ())
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        save_limits(ordinary, catalogue, TesterLimits(amplitude_pp=5e-5), "an engineer")
    refused = jointlab("run", sequence())
    assert refused.returncode != 0
    assert "is outside the rig's limits of 0 to 0.05 mm" in refused.stderr


def test_a_port_in_use_is_said_in_one_line(jointlab: Command) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        answer = jointlab("serve", "--port", port)
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    assert line.startswith(f"jointlab: port {port} of 127.0.0.1 cannot be used: Address already in use")


def test_the_rig_is_not_served_to_a_network_without_keys(jointlab: Command) -> None:
    answer = jointlab("serve", "--host", "0.0.0.0", "--port", 0)
    assert answer.returncode == 3
    assert "make keys first (jointlab key create)" in answer.stderr


def test_a_key_is_shown_once_and_can_be_revoked(jointlab: Command) -> None:
    made = jointlab("key", "create", "page", "--scope", "read:data", "--scope", "control:rig", "--days", 30)
    assert re.fullmatch(r"jl_[\w-]{43}\n", made.stdout)
    listed = jointlab("key", "list").stdout
    assert re.search(r"1 +page +control:rig read:data +\d{4}-.* valid", listed)
    assert made.stdout.strip() not in listed
    assert jointlab("key", "revoke", 1).stdout == "key 1 (page) revoked\n"
    assert "revoked" in jointlab("key", "list").stdout


def test_a_key_that_is_not_there_cannot_be_revoked(jointlab: Command) -> None:
    answer = jointlab("key", "revoke", 7)
    assert (answer.returncode, answer.stderr) == (3, "jointlab: there is no key 7\n")
