"""Addresses and errors of databases: full disk, lock, read-only folder, clock set back; nothing is half stored."""

import sqlite3
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import psycopg
import pytest
from sqlalchemy import text

from store.backup.check import check
from store.catalogue import Catalogue
from store.database.connection import driver_message
from store.database.time_limits import TimeLimits
from store.errors import StoreError
from store.measurements.runs import finish_run, get_run, list_run_events, list_runs, start_run
from store.states import RunState
from store.waveforms.folder import WaveformFolder
from store.waveforms.waveform import Waveform, WaveformChannel, WaveformReference
from tests.postgresql_server import Server

FILE = "a.waveforms"


def blow(value: int = 0) -> Waveform:
    noise = np.random.default_rng(value).integers(-(2**30), 2**30, (1, 5000), dtype=np.int32)
    return Waveform((WaveformChannel("a", "N"),), noise, 1000.0)


def _start(opened: Catalogue, title: str = "t") -> int:
    with opened.writing() as session:
        return start_run(session, kind="hammer", title=title, article="a", setup={}).id


# Files may not grow beyond a limit: what a full disk looks like to one process. It stores until it is refused, then
# frees space and goes on; every number it prints is one that was acknowledged.
FULL = """
import resource, sys
from pathlib import Path
import numpy as np
from store.catalogue import Catalogue
from store.errors import StoreError
from store.measurements.runs import start_run
from store.measurements.sine_records import SineRecord, add_sine_record
from store.waveforms.waveform import Waveform, WaveformChannel

def store(order):
    samples = np.random.default_rng(order).integers(-(2**30), 2**30, (1, 5000), dtype=np.int32)
    waveform = Waveform((WaveformChannel("a", "N"),), samples, 1000.0)
    reference = catalogue.waveforms.append(run.waveform_file, waveform)
    with catalogue.writing() as session:
        add_sine_record(session, run.id, SineRecord(order, "I", "shear", 0.1, 0.1, 5.0, 0.0, None, None, reference))
    print("stored", order, flush=True)

catalogue = Catalogue.open(sys.argv[1], Path(sys.argv[2]))
with catalogue.writing() as session:
    run = start_run(session, kind="sweep", title="t", article="a", setup={})
_, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), hard))
order = 0
try:
    while order < 200:
        store(order + 1)
        order += 1
except StoreError as error:
    print("refused", error, flush=True)
resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
store(order + 1)
"""


@pytest.mark.parametrize("limit", [40_000, 250_000])
def test_where_the_disk_is_full_nothing_acknowledged_is_lost_and_it_goes_on_once_there_is_space(
    catalogue: Catalogue, database_url: str, limit: int
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FULL, database_url, str(catalogue.waveforms.folder), str(limit)],
        capture_output=True,
        text=True,
        check=True,
    )
    said = done.stdout.splitlines()
    refused = [line for line in said if line.startswith("refused")]
    assert len(refused) == 1
    assert "check whether the disk is full" in refused[0] or "free some space" in refused[0]
    acknowledged = [int(line.split()[1]) for line in said if line.startswith("stored")]
    assert acknowledged == list(range(1, len(acknowledged) + 1))
    assert not [finding for finding in check(catalogue) if finding.damage]
    with catalogue.reading() as session:
        assert session.scalars(text("SELECT order_number FROM sine_records ORDER BY id")).all() == acknowledged


def test_a_waveform_that_does_not_fit_on_the_disk_is_not_half_there(tmp_path: Path) -> None:
    folder = WaveformFolder(tmp_path)
    folder.append(FILE, blow())
    folder.close()
    connection = sqlite3.connect(tmp_path / FILE)
    pages = connection.execute("PRAGMA page_count").fetchone()[0]
    connection.close()
    writer = folder._writer(FILE)
    writer.execute(f"PRAGMA max_page_count = {pages + 8}").close()
    with pytest.raises(StoreError, match=rf"{FILE} cannot be written: database or disk is full; free some space"):
        folder.append_all(FILE, [blow(1), blow(2)])
    assert folder.records(FILE) == [WaveformReference(FILE, 1)]
    writer.execute("PRAGMA max_page_count = 100000").close()
    assert folder.append(FILE, blow(1)).record == 2
    folder.close()


@pytest.mark.parametrize("database_kind", ["postgresql"])
@pytest.mark.parametrize(
    ("state", "said"), [("53100", "free some space on the disk"), ("58030", "check whether the disk is full")]
)
def test_a_full_disk_of_the_server_is_reported_and_nothing_is_half_stored(
    catalogue: Catalogue, state: str, said: str
) -> None:
    with catalogue.writing() as session:
        session.execute(
            text(
                "CREATE FUNCTION refuse() RETURNS trigger LANGUAGE plpgsql AS "
                f"$$ BEGIN RAISE EXCEPTION 'No space left on device' USING ERRCODE = '{state}'; END $$"
            )
        )
        session.execute(text("CREATE TRIGGER full_disk BEFORE INSERT ON run_events EXECUTE FUNCTION refuse()"))
    try:
        with pytest.raises(StoreError, match=f"No space left on device; {said}"):
            _start(catalogue)
        with catalogue.reading() as session:
            assert list_runs(session) == []
    finally:
        with catalogue.writing() as session:
            session.execute(text("DROP FUNCTION refuse() CASCADE"))


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_table_that_is_locked_by_another_program_is_said(
    database_url: str, tmp_path: Path, postgresql: Server
) -> None:
    with Catalogue.open(database_url, tmp_path, TimeLimits(lock=0.05)) as catalogue:
        with postgresql.connect("lab") as other, other.transaction():
            other.execute("LOCK TABLE runs IN ACCESS EXCLUSIVE MODE")
            with pytest.raises(StoreError, match="lock timeout; another program is writing: close it"):
                _start(catalogue)
        assert _start(catalogue) > 0
        with catalogue.reading() as session:
            assert len(list_runs(session)) == 1


def test_a_waveform_file_that_is_locked_by_another_program_is_said(tmp_path: Path) -> None:
    folder = WaveformFolder(tmp_path, TimeLimits(lock=0.05))
    folder.append(FILE, blow())
    other = sqlite3.connect(tmp_path / FILE, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(StoreError, match="database is locked; another program is writing: close it"):
        folder.append(FILE, blow())
    other.execute("ROLLBACK")
    other.close()
    assert folder.append(FILE, blow()).record == 2
    folder.close()


# Stores as an ordinary user in a folder that may only be read; root itself may write everywhere.
READ_ONLY = """
import os, sys
from pathlib import Path
import numpy as np
from store.catalogue import Catalogue
from store.errors import StoreError
from store.measurements.runs import list_runs, start_run
from store.waveforms.waveform import Waveform, WaveformChannel
from store.waveforms.folder import WaveformFolder

folder = Path(sys.argv[1])
waveform = Waveform((WaveformChannel("a", "N"),), np.zeros((1, 10), np.int32), 1000.0)

def store_a_run(name):
    with Catalogue.open(f"sqlite:///{folder / name}") as catalogue, catalogue.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={})

def store_a_waveform(name):
    waveforms = WaveformFolder(folder / "waveforms")
    reference = waveforms.append(name, waveform)
    waveforms.close()
    return reference

store_a_run("lab.db")
record = store_a_waveform("a.waveforms")
for path in (folder / "lab.db", folder / "waveforms" / "a.waveforms"):
    path.chmod(0o444)
for path in (folder, folder / "waveforms"):
    path.chmod(0o555)
if os.geteuid() == 0:
    os.setgroups([])
    os.setgid(65534)
    os.setuid(65534)
for store, name in ((store_a_run, "lab.db"), (store_a_run, "new.db"), (store_a_waveform, "a.waveforms"),
                    (store_a_waveform, "new.waveforms")):
    try:
        store(name)
    except StoreError as error:
        print(error)
    else:
        print("stored", name)
print(WaveformFolder(folder / "waveforms").read(record).samples.size)
"""


def test_a_read_only_folder_is_reported_and_its_waveforms_can_be_read(tmp_path: Path) -> None:
    with TemporaryDirectory() as folder:  # pytest's own folder is closed to other users
        done = subprocess.run([sys.executable, "-c", READ_ONLY, folder], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        existing, new, waveform, new_waveform, samples = done.stdout.splitlines()
    advice = "let this user write to the file and its folder"
    assert existing.endswith(f"lab.db: attempt to write a readonly database; {advice}")
    assert new.endswith(f"new.db: unable to open database file; {advice}")
    assert waveform.endswith(f"a.waveforms cannot be written: attempt to write a readonly database; {advice}")
    assert new_waveform.endswith(f"new.waveforms cannot be written: unable to open database file; {advice}")
    assert samples == "10"


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_server_that_only_lets_read_is_said(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        session.execute(text("ALTER DATABASE lab SET default_transaction_read_only = on"))
    try:
        with Catalogue.open(catalogue.address, catalogue.waveforms.folder) as opened:
            with pytest.raises(StoreError, match="read-only transaction; let this user write"):
                _start(opened)
            with opened.reading() as session:
                assert list_runs(session) == []
    finally:
        with catalogue.writing() as session:
            session.execute(text("ALTER DATABASE lab RESET default_transaction_read_only"))


def test_a_run_ends_and_says_so_where_the_clock_was_set_back(catalogue: Catalogue) -> None:
    later = datetime.now(UTC) + timedelta(hours=1)
    for state, reason in ((RunState.FINISHED, None), (RunState.FAILED, "tripped")):
        with catalogue.writing() as session:
            run = start_run(session, kind="hammer", title="t", article="a", setup={}, started_at=later)
        with catalogue.writing() as session:
            ended = finish_run(session, run.id, state, reason)
        said = "the computer's clock was set back during the run, by at least 0:59"
        assert ended.reason is not None
        assert ended.reason.startswith(f"{reason}; {said}" if reason else said)
        with catalogue.reading() as session:
            assert get_run(session, run.id) == ended
            assert [event.state for event in list_run_events(session, run.id)] == [RunState.RUNNING, state]


def test_an_end_before_the_start_is_refused_and_the_run_goes_on(catalogue: Catalogue) -> None:
    start = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
    with catalogue.writing() as session:
        run = start_run(session, kind="hammer", title="t", article="a", setup={}, started_at=start)
    with pytest.raises(StoreError, match="before its start at 2026-03-04"), catalogue.writing() as session:
        finish_run(session, run.id, RunState.FINISHED, finished_at=start - timedelta(seconds=1))
    with catalogue.reading() as session:
        assert get_run(session, run.id).state is RunState.RUNNING


def test_the_order_of_storing_stands_whatever_the_clock_says(catalogue: Catalogue) -> None:
    start = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
    with catalogue.writing() as session:
        for minutes in (0, -60, 5):
            started = start + timedelta(minutes=minutes)
            start_run(session, kind="hammer", title=f"{minutes}", article="a", setup={}, started_at=started)
    with catalogue.reading() as session:
        assert [run.title for run in list_runs(session)] == ["5", "-60", "0"]


def test_an_unknown_error_keeps_the_message_of_the_driver() -> None:
    assert driver_message(sqlite3.OperationalError("no such table: a\nmore")) == "no such table: a"
    assert driver_message(psycopg.OperationalError()) == "OperationalError"


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_commit_waits_for_the_disk_of_a_server_that_is_set_not_to(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        assert session.scalar(text("SHOW synchronous_commit")) == "on"


def test_text_with_half_of_a_surrogate_pair_is_refused_in_words(catalogue: Catalogue) -> None:
    words = "half of a surrogate pair, such as a byte that is not UTF-8"
    for title, setup in (("bad\udcff", {}), ("t", {"name": ["bad\udcff"]})):
        with pytest.raises(StoreError, match=words), catalogue.writing() as session:
            start_run(session, kind="import", title=title, article="a", setup=setup)
    with pytest.raises(StoreError, match=words), catalogue.reading() as session:
        list_runs(session, article="bad\udcff")
    with catalogue.reading() as session:
        assert list_runs(session) == []
