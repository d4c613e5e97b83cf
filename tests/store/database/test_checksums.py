"""Damaged values of measurements are found, whichever bit it is, and no sound row is called damaged."""

import random
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import insert, text

from store.backup.check import check, check_rows
from store.backup.checked_part import every_row, rows_of
from store.catalogue import Catalogue
from store.database import checksums
from store.database.checksums import LATER, WITH_ROW, stored_rows
from store.dof import StoredDof
from store.errors import RESTORE, StoreError
from store.instrument import Instrument
from store.measurements.blows import add_blow, add_point
from store.measurements.runs import begin_run, finish_run, reopen_run, start_run
from store.measurements.sine_records import SineRecord, add_sine_record
from store.models.base import Base
from store.models.measurements import SpecimenRow
from store.states import RunState
from tests.store.forced_change import change_by_force
from tests.store.sqlite_pages import value_bytes

TABLES = [table.name for table in Base.metadata.sorted_tables if "checksum" in table.c]
FLIPS = 120


def test_every_table_of_measurements_has_a_checksum() -> None:
    assert set(TABLES) == {
        "specimens", "instruments", "calibrations", "runs", "setup_amendments", "run_events", "run_instruments",
        "commissioning_records", "channels", "points", "blows", "blow_withdrawals", "sine_records",
    }  # fmt: skip


def test_every_one_of_120_flipped_bits_is_found(exported: Path, tmp_path: Path) -> None:
    whole, path = exported.with_name("lab.db"), tmp_path / "lab.db"
    places = {table: value_bytes(whole, table) for table in TABLES}
    chance, missed = random.Random(14), []
    for _ in range(FLIPS):
        content = bytearray(whole.read_bytes())
        table = chance.choice(TABLES)
        place, bit = chance.choice(places[table]), chance.randrange(8)
        content[place] ^= 1 << bit
        path.write_bytes(content)
        try:
            with Catalogue.open(f"sqlite:///{path}", tmp_path) as opened:
                found = check_rows(opened, every_row())
        except StoreError:
            continue  # it does not even open
        if not found:
            missed.append((table, place, bit))
    assert missed == []


def test_a_flipped_bit_of_a_row_that_an_index_leads_to_is_found(exported: Path, tmp_path: Path) -> None:
    """Its index has the values of the key once more, and they are sound."""
    whole, path = exported.with_name("lab.db"), tmp_path / "lab.db"
    for place in value_bytes(whole, "run_instruments"):
        content = bytearray(whole.read_bytes())
        content[place] ^= 1 << 6
        path.write_bytes(content)
        with Catalogue.open(f"sqlite:///{path}", tmp_path) as opened:
            assert check_rows(opened, rows_of([1, 2])), place


@pytest.mark.parametrize(
    ("table", "change"),
    [
        ("blows", "peak_force = peak_force + 1e-12"),
        ("sine_records", "configuration = 'afgled'"),
        ("runs", "setup = replace(CAST(setup AS VARCHAR), '0.914', '0.915')"),
        ("runs", "rig = 'another'"),
        ("channels", "sensitivity = -sensitivity"),
        ("instruments", "serial = '4712'"),
        ("run_instruments", "checksum = ''"),
    ],
)
def test_a_value_that_was_changed_is_named_by_its_row(
    catalogue: Catalogue, filled: int, table: str, change: str
) -> None:
    if catalogue.address.startswith("postgresql"):
        change = change.replace("'0.915')", "'0.915')::json")
    key = "run_id" if table == "run_instruments" else "id"
    change_by_force(catalogue, f"UPDATE {table} SET {change} WHERE {key} = 1")
    (found,) = check(catalogue)
    assert found.where.startswith(f"table {table}, row 1")
    assert (found.remedy, found.damage) == (RESTORE, True)


@pytest.mark.parametrize("table", ["blows", "run_instruments"])
def test_every_row_is_read_where_there_are_more_than_are_read_at_once(
    catalogue: Catalogue, filled: int, table: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checksums, "_ROWS_AT_ONCE", 1)
    with catalogue.reading() as session:
        read = [keys["checksum"] for keys, _ in stored_rows(session.connection(), Base.metadata.tables[table])]
        stored = session.scalars(text(f"SELECT checksum FROM {table}")).all()
    assert len(read) > 1
    assert sorted(read) == sorted(stored)


def test_rows_stay_sound_through_every_change_of_a_run_and_every_kind_of_value(catalogue: Catalogue) -> None:
    east = timezone(timedelta(hours=5, minutes=30))
    with catalogue.writing() as session:
        run = start_run(
            session, kind="sequence", title="Ärger \U0001f528", article="a", rig="rig", state=RunState.CREATED,
            setup={"a": [1, 2.5, None, "ü"], "b": {"c": -0.0, "d": 1e-300}}, provisional=True,
        )  # fmt: skip
    with catalogue.writing() as session:
        begin_run(
            session, run.id, sequence={"seed": 1 << 60}, instruments=[Instrument("tester", "m", "1", details={"n": 1})]
        )
    with catalogue.writing() as session:
        point = add_point(session, run.id, StoredDof(1, "y"))
        add_blow(
            session, point, 1, accepted=bool(np.True_), peak_force=float(np.float32(0.1)), temperature_c=-0.0,
            struck_at=datetime(2026, 3, 4, 9, 30, 0, 123456, east),
        )  # fmt: skip
        add_blow(session, point, 2, accepted=False, reason="double hit", peak_force=7)
        record = SineRecord(1, "I", "shear", 1, None, np.float64(5.0), 1e300, datetime.now(UTC), float("nan"), None)
        add_sine_record(session, run.id, record)
        finish_run(session, run.id, RunState.STOPPED, "tired")
        reopen_run(session, run.id, "rested")
    with catalogue.writing() as session:
        finish_run(session, run.id, RunState.FINISHED)
        session.execute(insert(SpecimenRow), [{"article": "b", "name": name} for name in ("I", "II")])
    assert check(catalogue) == []


def test_a_row_that_another_program_wrote_has_no_checksum(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        session.execute(
            text("INSERT INTO specimens (article, name, created_at, software_version) VALUES ('a', 'I', :at, 'mine')"),
            {"at": "2026-03-04 09:30:00.000000"},
        )
    (found,) = check(catalogue)
    assert (found.where, found.what) == ("table specimens, row 1", "it has no checksum")


def test_a_checksum_tells_whether_it_was_made_with_its_row(catalogue: Catalogue, filled: int) -> None:
    with catalogue.reading() as session:
        marks = {mark[0] for name in TABLES for mark in session.scalars(text(f"SELECT checksum FROM {name}"))}
    assert marks == {WITH_ROW}
    assert WITH_ROW != LATER
