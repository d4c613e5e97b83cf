"""Backup and restore: complete while a run is on and after it was killed, and nothing half done."""

import json
import shutil
import signal
import sqlite3
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from alembic import command
from sqlalchemy import inspect, text

from store.backup.backup import back_up, restore
from store.backup.backup_layout import MANIFEST
from store.backup.check import check
from store.catalogue import Catalogue
from store.database.connection import address_of, make_engine
from store.database.time_limits import DEFAULT_LIMITS
from store.errors import DamagedError, StoreError
from store.measurements.runs import get_run, list_runs
from store.measurements.sine_records import list_sine_records
from store.migrate import configuration

# Every 15 records it finishes its run and starts another.
WRITER = """
import sys
from pathlib import Path
import numpy as np
from store.catalogue import Catalogue
from store.measurements.runs import RunState, finish_run, start_run
from store.measurements.sine_records import SineRecord, add_sine_record
from store.waveforms.waveform import Waveform, WaveformChannel
catalogue = Catalogue.open(sys.argv[1], Path(sys.argv[2]))
for _ in range(1000):
    with catalogue.writing() as session:
        run = start_run(session, kind="sweep", title="t", article="a", setup={})
    for order in range(1, 16):
        samples = np.full((1, 2000), 1000 * run.id + order, np.int32)
        reference = catalogue.waveforms.append(
            run.waveform_file, Waveform((WaveformChannel("a", "N"),), samples, 1000.0)
        )
        with catalogue.writing() as session:
            record = SineRecord(order, "I", "shear", 0.1, 0.1, 5.0, 0.0, None, None, reference)
            add_sine_record(session, run.id, record)
        print(run.id, order, flush=True)
    with catalogue.writing() as session:
        finish_run(session, run.id, RunState.FINISHED)
    catalogue.waveforms.finish(run.waveform_file)
"""

Acknowledged = set[tuple[int, int]]


def acknowledged(line: str) -> tuple[int, int]:
    run, order = map(int, line.split())
    return run, order


def stored(opened: Catalogue) -> Acknowledged:
    """Run and order of every sine record whose waveform is the one that was written with it."""
    found = set()
    with opened.reading() as session:
        for run in list_runs(session, limit=1000):
            for record in list_sine_records(session, run.id):
                assert record.waveform is not None
                samples = opened.waveforms.read(record.waveform).samples
                assert np.all(samples == 1000 * run.id + record.order_number)
                found.add((run.id, record.order_number))
    return found


@pytest.mark.parametrize("name", ["backup", "backup.zip"])
def test_a_backup_during_a_run_holds_every_record_that_was_acknowledged_before(
    catalogue: Catalogue, database_url: str, empty_database_url: str, tmp_path: Path, name: str
) -> None:
    command_line = [sys.executable, "-c", WRITER, database_url, str(catalogue.waveforms.folder)]
    with subprocess.Popen(command_line, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        before = {acknowledged(next(writer.stdout)) for _ in range(40)}
        during = back_up(catalogue, tmp_path / name)
        after = before | {acknowledged(next(writer.stdout)) for _ in range(20)}
        writer.send_signal(signal.SIGKILL)
        after |= {acknowledged(line) for line in writer.stdout if line.endswith("\n")}
    assert during.findings == ()
    restored = restore(tmp_path / name, empty_database_url, tmp_path / "restored")
    assert restored.findings == ()
    with Catalogue.open(empty_database_url, tmp_path / "restored") as opened:
        assert before <= stored(opened)

    # A process that was killed had told about no record that a backup made now does not hold.
    assert back_up(catalogue, tmp_path / f"killed-{name}").findings == ()
    assert not [finding for finding in check(catalogue) if finding.damage]
    assert after <= stored(catalogue)


@pytest.mark.parametrize("name", ["backup", "backup.zip"])
def test_everything_comes_back_and_the_restored_catalogue_can_go_on(
    catalogue: Catalogue,
    filled: int,
    row_counts: Callable[[], dict[str, int]],
    empty_database_url: str,
    tmp_path: Path,
    name: str,
) -> None:
    backup = back_up(catalogue, tmp_path / name)
    assert (backup.runs, backup.waveform_files, backup.findings) == (2, 2, ())
    restored = restore(tmp_path / name, empty_database_url, tmp_path / "restored")
    assert restored.findings == ()
    with Catalogue.open(empty_database_url, tmp_path / "restored") as opened:
        with opened.reading() as session, catalogue.reading() as original:
            assert get_run(session, filled) == get_run(original, filled)
            for table, rows in row_counts().items():
                assert session.scalar(text(f"SELECT count(*) FROM {table}")) == rows, table
        with pytest.raises(StoreError, match="never changed"), opened.writing() as session:
            session.execute(text("DELETE FROM blows"))
    assert sorted(path.name for path in tmp_path.iterdir() if "unfinished" in path.name) == []


def test_a_run_that_has_recorded_nothing_is_backed_up(
    catalogue: Catalogue, empty_database_url: str, tmp_path: Path
) -> None:
    assert back_up(catalogue, tmp_path / "backup").findings == ()
    assert restore(tmp_path / "backup", empty_database_url, tmp_path / "restored").findings == ()


def _damage(catalogue: Catalogue, run: int) -> str:
    catalogue.waveforms.close()
    with catalogue.reading() as session:
        file = get_run(session, run).waveform_file
    connection = sqlite3.connect(catalogue.waveforms.folder / file)
    connection.execute("DROP TRIGGER records_are_never_changed")
    connection.execute("UPDATE records SET crc = crc + 1 WHERE number = 2")
    connection.commit()
    connection.close()
    return file


def test_damage_that_is_there_is_told_and_the_rest_is_backed_up(
    catalogue: Catalogue, filled: int, empty_database_url: str, tmp_path: Path
) -> None:
    file = _damage(catalogue, filled)
    (found,) = back_up(catalogue, tmp_path / "backup").findings
    assert found.where == f"waveform file {file} record 2"
    assert restore(tmp_path / "backup", empty_database_url, tmp_path / "restored").findings == (found,)


@pytest.mark.parametrize("content", [None, b"no database " * 1000])
def test_a_file_that_is_lost_or_no_database_does_not_keep_the_rest_from_being_backed_up(
    catalogue: Catalogue, filled: int, tmp_path: Path, content: bytes | None
) -> None:
    file = _damage(catalogue, filled)
    (catalogue.waveforms.folder / file).unlink()
    if content is not None:
        (catalogue.waveforms.folder / file).write_bytes(content)
    backup = back_up(catalogue, tmp_path / "backup")
    assert all(file in finding.where for finding in backup.findings)
    assert backup.waveform_files == (1 if content is None else 2)


def test_a_taken_path_is_refused(catalogue: Catalogue, tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(StoreError, match="exists already"):
        back_up(catalogue, tmp_path / "taken")
    (tmp_path / "other.unfinished").mkdir()
    with pytest.raises(StoreError, match="another backup is being made, or one was cut off"):
        back_up(catalogue, tmp_path / "other")
    with pytest.raises(StoreError, match=r"nowhere/backup\.unfinished cannot be made: No such file"):
        back_up(catalogue, tmp_path / "nowhere" / "backup")


def test_a_backup_that_fails_leaves_nothing(
    catalogue: Catalogue, filled: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("store.backup.backup.content_of", fail)
    with pytest.raises(StoreError, match="backup cannot be written: No space left on device"):
        back_up(catalogue, tmp_path / "backup")
    assert not [path for path in tmp_path.iterdir() if path.name.startswith("backup")]


def test_a_place_that_is_not_empty_is_refused(
    catalogue: Catalogue, filled: int, database_url: str, empty_database_url: str, tmp_path: Path
) -> None:
    back_up(catalogue, tmp_path / "backup")
    with pytest.raises(StoreError, match=r"exists already|is not empty"):
        restore(tmp_path / "backup", database_url, tmp_path / "restored")
    with pytest.raises(StoreError, match="waveforms is not an empty folder"):
        restore(tmp_path / "backup", empty_database_url, catalogue.waveforms.folder)


@pytest.mark.parametrize("database_kind", ["sqlite"])
def test_a_journal_of_another_database_is_not_taken_over(catalogue: Catalogue, tmp_path: Path) -> None:
    back_up(catalogue, tmp_path / "backup")
    (tmp_path / "new.db-wal").write_bytes(b"old")
    with pytest.raises(StoreError, match=r"new\.db-wal exists already"):
        restore(tmp_path / "backup", f"sqlite:///{tmp_path / 'new.db'}")


def _break_a_waveform_file(folder: Path) -> None:
    path = next((folder / "waveforms").iterdir())
    path.write_bytes(path.read_bytes()[:-1] + b"x")


def _break_the_catalogue(folder: Path) -> None:
    path = next(folder.glob("catalogue.*"))
    path.write_bytes(path.read_bytes()[:-1])


def _lose_a_waveform_file(folder: Path) -> None:
    next((folder / "waveforms").iterdir()).unlink()


def _break_the_manifest(folder: Path) -> None:
    (folder / MANIFEST).write_text((folder / MANIFEST).read_text()[:-40])


def _lead_out_of_the_folder(folder: Path) -> None:
    document = json.loads((folder / MANIFEST).read_text())
    document["files"]["waveforms/.."] = next(iter(document["files"].values()))
    (folder / MANIFEST).write_text(json.dumps(document))


def _make_it_newer(folder: Path) -> None:
    document = json.loads((folder / MANIFEST).read_text()) | {"revision": "9999"}
    (folder / MANIFEST).write_text(json.dumps(document))


def _make_it_of_another_format(folder: Path) -> None:
    document = json.loads((folder / MANIFEST).read_text()) | {"format": "jointlab-backup/9"}
    (folder / MANIFEST).write_text(json.dumps(document))


def _make_it_another_database(folder: Path) -> None:
    document = json.loads((folder / MANIFEST).read_text())
    document["database"] = {"sqlite": "postgresql", "postgresql": "sqlite"}[document["database"]]
    (folder / MANIFEST).write_text(json.dumps(document))


def _refused(catalogue: Catalogue, url: str, tmp_path: Path, break_it: Callable[[Path], None], said: str) -> None:
    back_up(catalogue, tmp_path / "backup")
    break_it(tmp_path / "backup")
    with pytest.raises(StoreError, match=said):
        restore(tmp_path / "backup", url, tmp_path / "restored")
    assert not (tmp_path / "restored").exists()
    assert not list(tmp_path.glob("*unfinished*"))
    engine = make_engine(address_of(url), DEFAULT_LIMITS)
    assert inspect(engine).get_table_names() == []
    engine.dispose()


@pytest.mark.parametrize(
    ("break_it", "said"),
    [
        (_break_a_waveform_file, r"waveforms/.*: its checksum differs"),
        (_break_the_catalogue, r"catalogue\.\w+: its checksum differs"),
        (_make_it_another_database, "the configured database is"),
    ],
)
def test_a_changed_backup_is_refused_and_leaves_nothing(
    catalogue: Catalogue,
    filled: int,
    empty_database_url: str,
    tmp_path: Path,
    break_it: Callable[[Path], None],
    said: str,
) -> None:
    _refused(catalogue, empty_database_url, tmp_path, break_it, said)


@pytest.mark.parametrize("database_kind", ["sqlite"])  # what is read before any database is asked
@pytest.mark.parametrize(
    ("break_it", "said"),
    [
        (_lose_a_waveform_file, r"waveforms/.*: cannot be unpacked"),
        (_break_the_manifest, r"backup\.json: cannot be understood"),
        (_lead_out_of_the_folder, "is not the path of a file in a backup"),
        (_make_it_newer, r"schema revision 9999.*update jointlab"),
        (_make_it_of_another_format, "not of format jointlab-backup/1"),
        (shutil.rmtree, "backup cannot be read"),
    ],
)
def test_a_backup_that_is_incomplete_or_unknown_is_refused_and_leaves_nothing(
    catalogue: Catalogue,
    filled: int,
    empty_database_url: str,
    tmp_path: Path,
    break_it: Callable[[Path], None],
    said: str,
) -> None:
    _refused(catalogue, empty_database_url, tmp_path, break_it, said)


def test_a_zip_with_a_wrong_byte_is_refused(
    catalogue: Catalogue, filled: int, empty_database_url: str, tmp_path: Path
) -> None:
    path = tmp_path / "backup.zip"
    back_up(catalogue, path)
    with zipfile.ZipFile(path) as archive:
        member = next(info for info in archive.infolist() if info.filename.startswith("waveforms/"))
    content = bytearray(path.read_bytes())
    content[member.header_offset + 30 + len(member.filename) + member.compress_size // 2] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(DamagedError, match=member.filename):
        restore(path, empty_database_url, tmp_path / "restored")
    assert not (tmp_path / "restored").exists()


def test_a_backup_of_an_older_version_is_brought_up_to_date(
    catalogue: Catalogue, filled: int, empty_database_url: str, tmp_path: Path
) -> None:
    with catalogue.writing() as session:
        command.downgrade(configuration(session.connection()), "0002")
    back_up(catalogue, tmp_path / "backup")
    assert restore(tmp_path / "backup", empty_database_url, tmp_path / "restored").findings == ()
    with Catalogue.open(empty_database_url, tmp_path / "restored") as opened, opened.reading() as session:
        assert session.scalar(text("SELECT count(*) FROM v_runs")) == 2


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_without_pg_dump_the_error_names_the_package_to_install(
    catalogue: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("store.backup.postgresql_programs._INSTALLED", tmp_path)
    with pytest.raises(StoreError, match=r"pg_dump is neither on PATH nor in .*postgresql-client"):
        back_up(catalogue, tmp_path / "backup")
    assert not [path for path in tmp_path.iterdir() if path.name.startswith("backup")]
