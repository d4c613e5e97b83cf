"""The command line in an empty folder, a simulated laboratory for it, and one demo that every test may look at."""

import json
import os
import pickle
import shutil
import sqlite3
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from importlib import resources
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest
import yaml

from api.cli import main
from api.commands.console import PlainConsole
from jointlab.drive.process import driving
from jointlab.identification.document import identification_document
from jointlab.identification.pipeline import Identification
from jointlab.identification.run import identify_and_save
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence
from jointlab.settings import DriveSettings
from jointlab.trials.simulated_laboratory import as_toml, simulated_laboratory, simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.sequences.sequence import sequence_from
from simlab.laboratory import Addresses, Laboratory
from simlab.operator_server import OperatorClient
from simlab.ordinary import BenchConditions
from store.catalogue import Catalogue
from store.exchange.bundle_exchange import export_bundle
from tests.logs import restored_logging
from tests.once import made_once
from tests.repair import repair

SPEED = 200.0
Command = Callable[..., CompletedProcess[str]]
Contents = Callable[[], dict[str, Any]]
Query = Callable[[str], list[tuple[Any, ...]]]
Write = Callable[..., Path]


@pytest.fixture
def jointlab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """`jointlab` in this process, in a folder of its own and without any JOINTLAB_ variable."""
    monkeypatch.chdir(tmp_path)
    for name in [name for name in os.environ if name.startswith("JOINTLAB_")]:
        monkeypatch.delenv(name)

    def run(*arguments: object) -> CompletedProcess[str]:
        command = ["jointlab", *map(str, arguments)]
        monkeypatch.setattr(sys, "argv", command)
        capsys.readouterr()
        with restored_logging(), pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        return CompletedProcess(command, int(ended.value.code or 0), said.out, said.err)

    return run


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes a terminal of standard error, for progress bars."""
    for name, value in (("FORCE_COLOR", "1"), ("TERM", "xterm"), ("COLUMNS", "200")):
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("api.commands.terminal.progress_console", PlainConsole(stderr=True))


@pytest.fixture
def contents(sqlite_template: Path, tmp_path: Path) -> Contents:
    """Rows of every table of jointlab.db, and the waveform files beside it: to show that nothing was stored."""

    def look() -> dict[str, Any]:
        database = tmp_path / "jointlab.db"
        if not database.exists():
            shutil.copy(sqlite_template, database)
        with closing(sqlite3.connect(database)) as connection:
            tables = [row[0] for row in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")]
            rows = {table: connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0] for table in tables}
        return rows | {"waveforms": sorted(path.name for path in tmp_path.glob("*-waveforms/*"))}

    return look


@pytest.fixture
def query(tmp_path: Path) -> Query:
    """Rows of a query to jointlab.db, as a person with a database client would ask."""

    def ask(statement: str) -> list[tuple[Any, ...]]:
        with closing(sqlite3.connect(f"file:{tmp_path / 'jointlab.db'}?mode=ro", uri=True)) as connection:
            return connection.execute(statement).fetchall()

    return ask


def configuration(addresses: Addresses, folder: Path) -> str:
    """jointlab.toml for simulated instruments, with a drive process of its own in `folder`."""
    return f'{as_toml(addresses)}\n[drive]\nfolder = "{folder / "drive"}"\nstop_port = 0\n'


@pytest.fixture(scope="module")
def running_laboratory() -> Iterator[Laboratory]:
    with Laboratory(3, SPEED, BenchConditions(double_hits=0.0)) as laboratory:
        yield laboratory


@pytest.fixture
def laboratory(running_laboratory: Laboratory, tmp_path: Path) -> Iterator[Laboratory]:
    """Simulated instruments that jointlab.toml points at; whole before and after each test."""
    (tmp_path / "jointlab.toml").write_text(configuration(running_laboratory.addresses, tmp_path), encoding="utf-8")
    yield running_laboratory
    repair(running_laboratory)


@pytest.fixture
def operator(laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch) -> Iterator[SimulatedOperator]:
    """Somebody at the terminal who strikes and mounts."""
    hand = OperatorClient(laboratory.addresses.operator)
    person = SimulatedOperator(hand)
    monkeypatch.setattr("api.commands.sequences.TerminalOperator", lambda console, look: person)
    yield person
    hand.close()


@pytest.fixture
def drive(laboratory: Laboratory, tmp_path: Path) -> Iterator[None]:
    """What a drive process does, in this process, which is quicker to start; `jointlab run` finds it."""
    drive = DriveSettings(folder=tmp_path / "drive", stop_port=0)
    with driving(simulated_settings(laboratory.addresses, drive=drive)):
        yield


def paper() -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load((resources.files("jointlab.sequences") / "paper.yaml").read_text("utf-8"))
    return document


@pytest.fixture
def sequence(tmp_path: Path) -> Write:
    """Write the paper's sequence with fewer blows and sine points; `hammer` and `sweep` say what is otherwise."""

    def write(hammer: dict[str, Any] | None = None, sweep: dict[str, Any] | None = None) -> Path:
        document = paper()
        small_hammer = {"points": ["1y", "3y", "5y", "1x"], "blows": 2, "block_seconds": 1.0}
        small_sweep = {
            "specimens": ["I"],
            "amplitudes_pp_mm": [0.1],
            "frequencies": {"first": 40, "last": 120, "step": 80},
        }
        document["steps"][0] |= small_hammer | (hammer or {})
        document["steps"][1] |= small_sweep | (sweep or {})
        path = tmp_path / "sequence.yaml"
        path.write_text(yaml.safe_dump(document), encoding="utf-8")
        return path

    return write


def demo_sequence() -> dict[str, Any]:
    """The paper's blows, but blocks of 1 s, which halve what an identification takes; 3 of 40 frequencies."""
    document = paper()
    document["steps"][0] |= {"block_seconds": 1.0}
    document["steps"][1] |= {"amplitudes_pp_mm": [0.1, 0.01], "frequencies": {"first": 20, "last": 180, "step": 80}}
    return document


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database with the run of the demo, identified, and its summary, without the sealed bench."""
    return made_once(tmp_path_factory, "demo", _measure)


def _measure(folder: Path) -> None:
    with simulated_laboratory(1, SPEED) as laboratory:
        settings = simulated_settings(laboratory.addresses, database_url=f"sqlite:///{folder / 'jointlab.db'}")
        with Catalogue.open(settings.database_url) as catalogue:
            operator = SimulatedOperator(laboratory.operator)
            sequence = sequence_from(demo_sequence())
            run = run_sequence(sequence, instruments_of(settings), catalogue, operator, operator.observe)
            found = identify_and_save(catalogue, run)
    (folder / "summary.json").write_text(json.dumps(identification_document(found)), encoding="utf-8")
    (folder / "identification.pickle").write_bytes(pickle.dumps(found))


@pytest.fixture(scope="session")
def identified(demo: Path) -> Identification:
    """The stored identification of the demo's run, as it was computed."""
    found: Identification = pickle.loads((demo / "identification.pickle").read_bytes())
    return found


@pytest.fixture
def measured(demo: Path, tmp_path: Path) -> int:
    """The demo's run in jointlab.db of this test's own folder; its number."""
    shutil.copy(demo / "jointlab.db", tmp_path)
    shutil.copytree(demo / "jointlab-waveforms", tmp_path / "jointlab-waveforms")
    return 1


@pytest.fixture
def measured_catalogue(measured: int, tmp_path: Path) -> Iterator[Catalogue]:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened:
        yield opened


@pytest.fixture(scope="session")
def exported(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exported") / "bundle"
    with Catalogue.open(f"sqlite:///{demo / 'jointlab.db'}") as catalogue:
        export_bundle(catalogue, 1, folder, blows=False)
    return folder


@pytest.fixture
def bundle(exported: Path, tmp_path: Path) -> Path:
    """The demo's measurement as a bundle without checksums, to be damaged."""
    folder = tmp_path / "bundle"
    shutil.copytree(exported, folder)
    setup = json.loads((folder / "setup.json").read_text(encoding="utf-8"))
    del setup["checksums"]
    (folder / "setup.json").write_text(json.dumps(setup), encoding="utf-8")
    return folder
