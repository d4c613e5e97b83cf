"""The check reports damaged and missing records, each with a remedy, and nothing else."""

import shutil
import sqlite3
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import text

from store.backup.check import Claim, Finding, check, check_file
from store.catalogue import Catalogue
from store.errors import RESTORE, StoreError
from store.measurements.runs import finish_run, get_run, start_run
from store.measurements.sine_records import SineRecord, add_sine_record
from store.states import RunState
from store.waveforms.folder import WaveformFolder
from store.waveforms.waveform import Waveform, WaveformChannel, WaveformReference
from tests.store.forced_change import change_by_force

REFERENCES = [WaveformReference("a.waveforms", number) for number in (1, 2, 3, 4)]
WAVEFORM = Waveform((WaveformChannel("a", "N"),), np.arange(50, dtype=np.int32)[np.newaxis], 1000.0)


@pytest.fixture
def file(catalogue: Catalogue, filled: int) -> str:
    """The hammer run's waveform file; its six records are blows of two points."""
    catalogue.waveforms.close()
    with catalogue.reading() as session:
        return get_run(session, filled).waveform_file


def test_nothing_is_found_where_all_is_well(catalogue: Catalogue, file: str) -> None:
    assert check(catalogue) == []


def test_an_empty_catalogue_is_well(catalogue: Catalogue) -> None:
    assert check(catalogue) == []


def test_a_run_that_has_recorded_nothing_needs_no_file(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={})
    assert check(catalogue) == []


def test_a_damaged_record_is_named_and_the_check_goes_on(catalogue: Catalogue, file: str) -> None:
    connection = sqlite3.connect(catalogue.waveforms.folder / file)
    connection.execute("DROP TRIGGER records_are_never_changed")
    connection.execute("UPDATE records SET crc = crc + 1 WHERE number IN (2, 5)")
    connection.commit()
    connection.close()
    assert check(catalogue) == [
        Finding(f"waveform file {file} record {n}", "the waveform is damaged (checksum differs)", RESTORE)
        for n in (2, 5)
    ]


def test_a_missing_file_is_named_with_the_rows_that_need_it(catalogue: Catalogue, file: str, filled: int) -> None:
    (catalogue.waveforms.folder / file).unlink()
    (found,) = check(catalogue)
    assert found.damage
    assert (found.where, found.what) == (f"waveform file {file}", f"is missing; 6 rows of run {filled} need it")


def test_a_file_cut_off_is_named(catalogue: Catalogue, file: str) -> None:
    path = catalogue.waveforms.folder / file
    path.write_bytes(path.read_bytes()[:6000])
    found = check(catalogue)
    assert found
    assert all(file in finding.where and finding.damage for finding in found)


def test_a_file_without_bytes_has_lost_every_record(catalogue: Catalogue, file: str, filled: int) -> None:
    (catalogue.waveforms.folder / file).write_bytes(b"")
    (found,) = check(catalogue)
    assert found.what == f"rows of run {filled} refer to 6 records (1, 2, 3, 4, 5, ...), not in it"


def test_records_lost_from_within_a_file_are_counted(catalogue: Catalogue, file: str) -> None:
    connection = sqlite3.connect(catalogue.waveforms.folder / file)
    connection.execute("DROP TRIGGER records_are_never_deleted")
    connection.execute("DELETE FROM records WHERE number IN (3, 4)")
    connection.commit()
    connection.close()
    said = [finding.what for finding in check(catalogue)]
    assert said[0] == "2 records from number 3 on are missing"
    assert "refer to 2 records (3, 4), not in it" in said[1]


def test_rows_that_share_a_record_are_named(catalogue: Catalogue, file: str, filled: int) -> None:
    change_by_force(catalogue, "UPDATE blows SET waveform_record = 1 WHERE waveform_record = 2 AND accepted = false")
    said = {finding.what: finding.damage for finding in check(catalogue)}
    assert said == {
        "its values and its checksum do not fit": True,
        f"several rows of run {filled} refer to record 1": True,
        f"no row of run {filled} refers to record 2": False,
    }


def test_a_file_that_no_run_refers_to_is_left_over_but_no_damage(catalogue: Catalogue, file: str) -> None:
    shutil.copy(catalogue.waveforms.folder / file, catalogue.waveforms.folder / "stray.waveforms")
    (found,) = check(catalogue)
    assert (found.where, found.what, found.damage) == ("waveform file stray.waveforms", "no run refers to it", False)


def test_a_record_without_a_row_is_left_over_once_its_run_has_ended(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="sweep", title="t", article="a", setup={})
    catalogue.waveforms.append(run.waveform_file, WAVEFORM)
    assert check(catalogue) == []  # its row may be on its way
    with catalogue.writing() as session:
        finish_run(session, run.id, RunState.FINISHED)
    (found,) = check(catalogue)
    assert (found.what, found.damage) == (f"no row of run {run.id} refers to record 1", False)


def test_a_row_that_refers_to_a_record_that_never_was_is_named(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="sweep", title="t", article="a", setup={})
        catalogue.waveforms.append(run.waveform_file, WAVEFORM)
        reference = WaveformReference(run.waveform_file, 9)
        add_sine_record(session, run.id, SineRecord(1, "I", "shear", 0.1, 0.1, 5.0, 0.0, None, None, reference))
    (found,) = check(catalogue)
    assert found.what == f"rows of run {run.id} refer to record 9, not in it"


@pytest.mark.parametrize(
    ("table", "column"),
    [
        ("frequency_responses", "variance"),
        ("frequency_response_sets", "frequency"),
        ("modes", "shape"),
        ("mode_sets", "pole_covariance"),
        ("joint_matrices", "covariance"),
    ],
)
def test_a_damaged_array_is_named_by_table_row_and_column(
    catalogue: Catalogue, file: str, table: str, column: str
) -> None:
    with catalogue.writing() as session:
        number = session.scalar(text(f"SELECT max(id) FROM {table}"))
        stored = bytearray(session.scalar(text(f"SELECT {column} FROM {table} WHERE id = {number}")) or b"")
        stored[-9] ^= 1
        session.execute(text(f"UPDATE {table} SET {column} = :stored WHERE id = {number}"), {"stored": bytes(stored)})
    (found,) = check(catalogue)
    assert found == Finding(
        f"table {table}, row {number}, {column}", "the stored array is damaged (checksum differs)", RESTORE
    )


def test_rows_that_refer_to_rows_that_are_not_there_are_counted(catalogue: Catalogue, file: str) -> None:
    change_by_force(catalogue, "DELETE FROM mode_sets")
    (found,) = check(catalogue)
    assert (found.where, found.what) == (
        "table modes, mode_set_id", "2 rows refer to mode_sets that are not there"
    )  # fmt: skip


def test_a_damaged_page_of_an_sqlite_catalogue_is_found(tmp_path: Path) -> None:
    path = tmp_path / "lab.db"
    with Catalogue.open(f"sqlite:///{path}") as opened, opened.writing() as session:
        for number in range(400):
            start_run(session, kind="hammer", title=f"run {number} " + "x" * 500, article="a", setup={})
    content = bytearray(path.read_bytes())
    middle = len(content) // 2 // 4096 * 4096
    content[middle : middle + 4096] = bytes(4096)
    path.write_bytes(content)
    with Catalogue.open(f"sqlite:///{path}") as opened:
        found = check(opened)
    assert found
    assert all(finding.damage for finding in found)
    assert str(path) in found[0].where


def copy_with_a_flipped_bit(whole: Path, copy: Path, data: st.DataObject) -> None:
    content = bytearray(whole.read_bytes())
    bit = data.draw(st.integers(0, 8 * len(content) - 1))
    content[bit // 8] ^= 1 << bit % 8
    copy.write_bytes(content)


@given(data=st.data())
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_check_reports_any_flipped_bit_of_an_sqlite_catalogue(
    exported: Path, tmp_path: Path, data: st.DataObject
) -> None:
    with TemporaryDirectory(dir=tmp_path) as folder:
        path = Path(folder) / "lab.db"
        copy_with_a_flipped_bit(exported.with_name("lab.db"), path, data)
        said = str(path)
        try:
            with Catalogue.open(f"sqlite:///{path}", exported.with_name("lab-waveforms")) as opened:
                assert all(finding.what and finding.remedy for finding in check(opened))
        except StoreError as error:
            said = str(error)
        assert str(path) in said


@pytest.fixture(scope="module")
def finished_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = WaveformFolder(tmp_path_factory.mktemp("finished"))
    folder.append_all("a.waveforms", [WAVEFORM] * 4)
    folder.close()
    return folder.folder / "a.waveforms"


@given(data=st.data())
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whichever_bit_is_flipped_it_is_found_or_every_record_is_as_it_was(
    finished_file: Path, tmp_path: Path, data: st.DataObject
) -> None:
    copy_with_a_flipped_bit(finished_file, tmp_path / "a.waveforms", data)
    folder, claim = WaveformFolder(tmp_path), Claim(1, False, Counter([1, 2, 3, 4]))
    if not check_file(folder, "a.waveforms", claim):
        assert all(np.array_equal(folder.read(each).samples, WAVEFORM.samples) for each in REFERENCES)
