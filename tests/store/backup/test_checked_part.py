"""A part of a catalogue is checked by itself: damage in it is found, and all parts together are the whole."""

from datetime import UTC, datetime

import pytest
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from store.backup import checked_part as parts
from store.backup.check import Finding, check
from store.backup.checked_part import Part, rows_of, rows_of_no_run
from store.catalogue import Catalogue
from store.errors import NotFoundError, StoreError
from store.measurements.runs import get_run, start_run
from store.models.base import Base
from tests.store.conftest import fill
from tests.store.forced_change import change_by_force
from tests.store.plans import plans_of

HAMMER, SWEEP, EMPTY = 1, 2, 3
MEASURED = [table.name for table in Base.metadata.sorted_tables if "checksum" in table.c]
DAMAGE = {
    "runs": "UPDATE runs SET title = 'another' WHERE id = 1",
    "blows": "UPDATE blows SET peak_force = 1 WHERE id = 1",
    "run_instruments": "UPDATE run_instruments SET checksum = '' WHERE run_id = 1",
    "modes": "UPDATE modes SET shape = substr(shape, 2) WHERE number = 1",
    "channels": "DELETE FROM calibrations WHERE id IN (SELECT calibration_id FROM channels)",
}
"""Statements that damage the table, of the hammer run alone."""


@pytest.fixture
def laboratory(catalogue: Catalogue) -> Catalogue:
    """A hammer run, a sweep with results of both, and a run of a later day that has nothing."""
    fill(catalogue)
    with catalogue.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={})
    catalogue.waveforms.close()
    return catalogue


def lose_file(catalogue: Catalogue, run: int) -> str:
    with catalogue.reading() as session:
        file = get_run(session, run).waveform_file
    (catalogue.waveforms.folder / file).unlink()
    return file


def places(found: list[Finding]) -> set[str]:
    assert all(finding.damage for finding in found)
    return {finding.where for finding in found}


@pytest.mark.parametrize("table", DAMAGE)
def test_damaged_rows_of_a_run_are_found_by_its_check_and_by_that_of_no_other(
    laboratory: Catalogue, table: str
) -> None:
    change_by_force(laboratory, DAMAGE[table])
    found = places(check(laboratory, part=Part(runs=(HAMMER,))))
    assert any(where.startswith(f"table {table},") for where in found), found
    assert found <= places(check(laboratory))
    assert check(laboratory, part=Part(runs=(SWEEP, EMPTY))) == []


def test_a_file_that_is_missing_is_found_by_the_check_of_its_run_and_by_no_other(laboratory: Catalogue) -> None:
    file = lose_file(laboratory, SWEEP)
    assert places(check(laboratory, part=Part(runs=(HAMMER, SWEEP)))) == {f"waveform file {file}"}
    assert check(laboratory, part=Part(runs=(HAMMER, EMPTY))) == []


@pytest.mark.parametrize("shares", [1, 2, 3, 7])
def test_all_shares_together_find_what_the_check_of_everything_finds(
    laboratory: Catalogue, shares: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts, "_RUNS_AT_ONCE", 2)
    for table in MEASURED:
        change_by_force(laboratory, f"UPDATE {table} SET checksum = ''")
    for statement in DAMAGE.values():
        change_by_force(laboratory, statement)
    lost = {f"waveform file {lose_file(laboratory, run)}" for run in (HAMMER, SWEEP)}
    whole = places(check(laboratory))
    assert lost < whole
    assert {where.split(",")[0] for where in whole} >= {f"table {name}" for name in [*MEASURED, "modes"]}
    found = [places(check(laboratory, part=Part(share=(number + 1, shares)))) for number in range(shares)]
    assert set[str]().union(*found) == whole


def test_only_the_first_share_has_what_belongs_to_no_run(laboratory: Catalogue) -> None:
    assert {table.name for table, _ in rows_of_no_run()} & {*MEASURED} == {
        "specimens", "instruments", "calibrations", "commissioning_records",
    }  # fmt: skip
    change_by_force(laboratory, "UPDATE specimens SET name = 'III' WHERE id = 1")
    (laboratory.waveforms.folder / "stray.waveforms").touch()
    shares = [check(laboratory, part=Part(share=(number, 3))) for number in (1, 2, 3)]
    assert [[finding.where for finding in found] for found in shares] == [
        ["table specimens, row 1", "waveform file stray.waveforms"], [], [],
    ]  # fmt: skip


def test_a_part_since_a_day_has_the_runs_that_began_then(laboratory: Catalogue) -> None:
    lose_file(laboratory, HAMMER)
    later, earlier = (Part(since=datetime(2026, 3, day, tzinfo=UTC)) for day in (5, 4))
    assert (later.count(laboratory), earlier.count(laboratory)) == (1, 3)
    assert check(laboratory, part=later) == []
    assert len(check(laboratory, part=earlier)) == 1


def test_a_run_or_a_share_that_is_not_there_is_refused(catalogue: Catalogue) -> None:
    with pytest.raises(NotFoundError, match="there is no run 9"):
        check(catalogue, part=Part(runs=(9,)))
    for share in ((0, 3), (4, 3), (1, 0)):
        with pytest.raises(StoreError, match="parts count from 1"):
            Part(share=share)


@pytest.mark.parametrize("database_kind", ["sqlite"])
def test_the_rows_of_a_run_are_found_by_an_index(laboratory: Catalogue) -> None:
    def ask(session: Session) -> None:
        for table, chosen in rows_of([HAMMER]):
            session.scalar(select(func.count()).select_from(table).where(*chosen))

    assert not [line for line in plans_of(laboratory, ask) if line.startswith("SCAN")]
