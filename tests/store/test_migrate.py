"""The schema: migrations create the tables of the models, work with data in both directions, and are packaged."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, text

import store.migrations.versions
from store.backup.check import check
from store.catalogue import Catalogue
from store.database.checksums import LATER, WITH_ROW
from store.database.connection import address_of, make_engine
from store.database.time_limits import DEFAULT_LIMITS
from store.errors import StoreError
from store.measurements.blows import list_blows
from store.measurements.instruments import list_channels
from store.measurements.runs import get_run, list_run_events, start_run
from store.measurements.sine_records import SineRecord, add_sine_record, get_sine_record, list_sine_records
from store.migrate import configuration, current_revision, known_revisions
from store.models.base import Base
from store.results.analyses import add_analysis
from store.results.dynamic_stiffness import add_dynamic_stiffness, list_dynamic_stiffness
from store.service.audit import add_audit_entry, read_chain

VIEWS = {
    "v_runs", "v_blows", "v_analyses", "v_modes", "v_joint_stiffness", "v_dynamic_stiffness", "v_comparison",
    "v_gap", "v_master_curves",
}  # fmt: skip


REVISIONS = known_revisions()[::-1]

# What each revision's tables hold in a database of that time.
AT_START = "created_at, software_version) VALUES"
NOW = "'2026-03-04 09:30:00.000000'"
THEN = f"{NOW}, '0.1'"
WRITTEN = {
    "0001": [
        "INSERT INTO instruments (kind, model, serial, details, "
        f"{AT_START} ('hammer', '086C03', '4711', '{{}}', {THEN})",
        f"INSERT INTO calibrations (instrument_id, sensitivity, {AT_START} (1, 0.0023, {THEN})",
        "INSERT INTO runs (kind, state, title, article, started_at, finished_at, reason, setup, sequence, "
        f"configuration_hash, waveform_file, {AT_START} ('hammer', 'stopped', 'old', 'beam 3', {NOW}, {NOW}, 'tired', "
        f"'{{\"a\": 1}}', '{{}}', 'hash', 'old.waveforms', {THEN})",
        "INSERT INTO run_instruments (run_id, calibration_id) VALUES (1, 1)",
        "INSERT INTO channels (run_id, name, physical, kind, unit, sensitivity, minimum, maximum, calibration_id, "
        f"{AT_START} (1, 'hammer', 'ai0', 'force', 'N', 0.0023, -2000, 2000, 1, {THEN})",
        f"INSERT INTO specimens (article, name, {AT_START} ('beam 3', 'I', {THEN})",
        f"INSERT INTO points (run_id, set_number, node, direction, {AT_START} (1, 1, 4, 'y', {THEN})",
        f"INSERT INTO blows (point_id, number, accepted, peak_force, {AT_START} (1, 1, true, 101.5, {THEN})",
        "INSERT INTO sine_records (run_id, specimen_id, order_number, configuration, commanded_pp_mm, frequency, "
        f"elapsed, {AT_START} (1, 1, 1, 'shear', 0.1, 5.0, 1.5, {THEN})",
    ],
    "0002": [
        f"INSERT INTO analyses (kind, method, settings, configuration_hash, {AT_START} "
        f"('dynamic_stiffness', 'sine fit', '{{}}', 'hash', {THEN})",
        "INSERT INTO analysis_runs (analysis_id, run_id) VALUES (1, 1)",
        "INSERT INTO dynamic_stiffness (analysis_id, specimen_id, sine_record_id, order_number, elapsed, "
        "configuration, amplitude_pp_mm, frequency, stiffness, damping, loss_factor, magnitude, loss_angle_deg, flags, "
        f"{AT_START} (1, 1, 1, 1, 1.5, 'shear', 0.1, 5.0, 7e5, 7e4, 0.1, 7.1e5, 5.7, '[]', {THEN})",
    ],
}


def _migrate(opened: Catalogue, revision: str) -> None:
    with opened.writing() as session:
        current = current_revision(session.connection()) or ""
        step = command.downgrade if revision == "base" or revision < current else command.upgrade
        step(configuration(session.connection()), revision)


Contents = dict[str, list[dict[str, str]]]


def _contents(opened: Catalogue) -> Contents:
    """Every row of every table, its values by column."""
    with opened.reading() as session:
        tables = set(inspect(session.connection()).get_table_names()) - {"alembic_version"}
        rows = {table: session.execute(text(f"SELECT * FROM {table}")).mappings() for table in tables}
        return {
            table: sorted(({name: repr(value) for name, value in row.items()} for row in found), key=repr)
            for table, found in rows.items()
        }


def _as_far_as(contents: Contents, other: Contents) -> Contents:
    """What of `contents` is in tables and columns that `other` has."""
    return {
        table: sorted(({name: row[name] for name in rows[0]} for row in contents[table]), key=repr)
        for table, rows in other.items()
    }


def test_the_migrations_create_the_tables_of_the_models(catalogue: Catalogue) -> None:
    with catalogue.reading() as session:
        context = MigrationContext.configure(session.connection(), opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []


def test_every_view_is_there(catalogue: Catalogue) -> None:
    with catalogue.reading() as session:
        assert set(inspect(session.connection()).get_view_names()) == VIEWS


def test_revisions_are_one_line_without_branches() -> None:
    script = ScriptDirectory.from_config(configuration())
    revisions = [revision.revision for revision in script.walk_revisions()]
    assert revisions == sorted(revisions, reverse=True)
    assert len(script.get_heads()) == 1


@pytest.mark.parametrize("revision", REVISIONS)
def test_rows_survive_the_way_down_to_a_revision_that_has_their_table_and_up_again(
    catalogue: Catalogue, filled: int, revision: str
) -> None:
    before = _contents(catalogue)
    assert all(before[table] for table in before)
    _migrate(catalogue, revision)
    below = _contents(catalogue)
    assert below == _as_far_as(before, below)
    _migrate(catalogue, "head")
    above = _contents(catalogue)
    assert {table: set(rows[0]) for table, rows in above.items() if rows} == {
        table: set(before[table][0]) for table, rows in above.items() if rows
    }
    assert set(above) == set(before)
    assert below == _as_far_as(above, below)
    with catalogue.reading() as session:
        assert get_run(session, filled).article == "beam 3"
        assert session.scalar(text("SELECT count(*) FROM v_blows")) == len(before["blows"])


@pytest.mark.parametrize("revision", REVISIONS)
def test_a_database_that_was_written_at_a_revision_is_read_and_goes_on(
    empty_database_url: str, tmp_path: Path, revision: str
) -> None:
    engine = make_engine(address_of(empty_database_url), DEFAULT_LIMITS)
    with engine.execution_options(writing=True).begin() as connection:
        command.upgrade(configuration(connection), revision)
        for since, statements in WRITTEN.items():
            for statement in statements if since <= revision else ():
                connection.execute(text(statement.replace(":", "\\:")))
    engine.dispose()
    with Catalogue.open(empty_database_url, tmp_path) as opened:
        with opened.reading() as session:
            assert get_run(session, 1).setup == {"a": 1}
            assert [channel.instrument.serial for channel in list_channels(session, 1)] == ["4711"]
            assert [blow.peak_force for blow in list_blows(session, 1)] == [101.5]
            assert [record.frequency for record in list_sine_records(session, 1)] == [5.0]
            if revision >= "0002":
                (point,) = list_dynamic_stiffness(session, 1)
                assert (point.stiffness, point.loop_energy, point.shared_errors) == (7e5, None, {})
            if revision < "0004":
                assert [(event.state, event.reason) for event in list_run_events(session, 1)] == [
                    ("running", None), ("stopped", "tired")
                ]  # fmt: skip
        with opened.writing() as session:
            assert start_run(session, kind="hammer", title="new", article="beam 3", setup={}).id == 2
        # what another program writes into tables that have checksums has none
        foreign = {"it has no checksum"} if revision >= "0011" else set()
        assert {finding.what for finding in check(opened)} == foreign


def test_runs_of_an_older_database_belong_to_the_configured_rig_and_imports_to_none(
    catalogue: Catalogue, database_url: str, filled: int, tmp_path: Path
) -> None:
    with catalogue.writing() as session:
        imported = start_run(session, kind="import", title="t", article="a", setup={}).id
    _migrate(catalogue, "0010")
    with Catalogue.open(database_url, tmp_path, rig="west hall") as opened, opened.reading() as session:
        assert [get_run(session, number).rig for number in (filled, imported)] == ["west hall", None]
        assert session.scalar(text("SELECT rig FROM v_runs WHERE run_id = 1")) == "west hall"


def test_hashes_of_rows_of_an_older_database_say_that_they_were_made_later(
    catalogue: Catalogue, database_url: str, filled: int, tmp_path: Path
) -> None:
    _migrate(catalogue, "0010")
    _migrate(catalogue, "head")
    with catalogue.writing() as session:
        start_run(session, kind="hammer", title="new", article="beam 3", setup={})
        add_audit_entry(session, who="bench", action="start run", target="run 3", outcome="done")
    with catalogue.reading() as session:
        marks = session.scalars(text("SELECT substr(checksum, 1, 1) FROM runs ORDER BY id")).all()
        log = read_chain(session)
    assert marks == [LATER, LATER, WITH_ROW]
    assert (log.entries, log.later, log.faults) == (2, 1, ())
    with pytest.raises(StoreError, match="never changed"), catalogue.writing() as session:
        session.execute(text("UPDATE audit_entries SET who = 'me'"))
    with pytest.raises(StoreError, match="never changed"), catalogue.writing() as session:
        session.execute(text("UPDATE sine_records SET checksum = ''"))


def test_a_downgrade_below_revision_8_loses_only_its_columns(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    _migrate(catalogue, "0007")
    _migrate(catalogue, "head")
    with catalogue.reading() as session:
        (analysis,) = session.scalars(text("SELECT DISTINCT analysis_id FROM dynamic_stiffness")).all()
        found = list_dynamic_stiffness(session, analysis)
    kept = [
        replace(
            point, degrees_of_freedom=None, stiffness_damping_covariance=None, reached_pp_mm=None,
            reached_frequency=point.frequency if point.sine_record_id else None,
            reached_pp_se_mm=None, thd_se_percent=None, thd_displacement_se_percent=None, loop_energy=None,
            loop_energy_se=None, loop_energy_excess=None, loop_energy_excess_se=None, shared_errors={},
        )
        for point in samples.dynamic_stiffness(found[0].sine_record_id)
    ]  # fmt: skip
    assert found == kept


def test_a_point_of_an_older_database_gets_its_commanded_frequency(catalogue: Catalogue, filled: int) -> None:
    frequencies = text("SELECT frequency FROM v_dynamic_stiffness ORDER BY order_number")
    _migrate(catalogue, "0014")
    with catalogue.writing() as session:
        session.execute(text("UPDATE dynamic_stiffness SET frequency = frequency + 0.00003"))
        before = session.scalars(frequencies).all()
    _migrate(catalogue, "head")
    with catalogue.reading() as session:
        (analysis,) = session.scalars(text("SELECT DISTINCT analysis_id FROM dynamic_stiffness")).all()
        measured, imported, *_ = list_dynamic_stiffness(session, analysis)
    assert (measured.frequency, measured.reached_frequency) == (5.0, 5.00003)
    assert (imported.frequency, imported.reached_frequency) == (10.00003, None)
    _migrate(catalogue, "0014")
    with catalogue.reading() as session:
        assert session.scalars(frequencies).all() == before


@pytest.mark.parametrize("by_migration", [False, True])
def test_more_sine_points_have_numbers_than_4_bytes_count(
    catalogue: Catalogue, database_url: str, filled: int, samples: SimpleNamespace, by_migration: bool
) -> None:
    if by_migration:
        _migrate(catalogue, "0020")
        _migrate(catalogue, "head")
    last, tables = 2**31 - 1, ("sine_records", "dynamic_stiffness")
    with catalogue.writing() as session:
        sweep = session.scalar(text("SELECT run_id FROM sine_records"))
        if database_url.startswith("sqlite"):
            fields = "run_id, specimen_id, order_number, configuration, commanded_pp_mm, frequency, elapsed"
            session.execute(
                text(
                    f"INSERT INTO sine_records (id, {fields}, created_at, software_version) "
                    f"VALUES ({last}, {sweep}, 1, 2, 'shear', 0.1, 5.0, 1.5, {THEN})".replace(":", "\\:")
                )
            )
        else:
            for table in tables:
                session.execute(text(f"SELECT setval('{table}_id_seq', {last})"))
        number = add_sine_record(session, sweep, SineRecord(3, "I", "shear", 0.1, 0.0998, 5.0, 1.5, None, 23.2, None))
        analysis = add_analysis(session, kind="dynamic_stiffness", method="sine fit", settings={}, runs=[sweep])
        add_dynamic_stiffness(session, analysis, samples.dynamic_stiffness(number))
    assert number == 2**31
    with catalogue.reading() as session:
        assert get_sine_record(session, number).order_number == 3
        assert list_dynamic_stiffness(session, analysis)[0].sine_record_id == number
        shown = text("SELECT count(*) FROM v_dynamic_stiffness WHERE sine_record_id = 2147483648")
        assert session.scalar(shown) == 1


def test_the_way_down_to_nothing_and_up_again(catalogue: Catalogue, filled: int) -> None:
    _migrate(catalogue, "base")
    with catalogue.reading() as session:
        assert inspect(session.connection()).get_table_names() == ["alembic_version"]
    _migrate(catalogue, "head")
    with catalogue.reading() as session:
        assert set(inspect(session.connection()).get_table_names()) == {*Base.metadata.tables, "alembic_version"}


def test_an_older_database_is_brought_up_to_date_when_it_is_opened(
    catalogue: Catalogue, database_url: str, filled: int, tmp_path: Path
) -> None:
    _migrate(catalogue, "0002")
    with Catalogue.open(database_url, tmp_path) as opened, opened.reading() as session:
        assert session.scalar(text("SELECT count(*) FROM v_runs")) == 2


def test_an_upgrade_that_fails_leaves_the_database_as_it_was(
    empty_database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = command.upgrade

    def fail_half_way(config: Config, revision: str) -> None:
        whole(config, "0001")
        config.attributes["connection"].execute(text("SELECT * FROM no_such_table"))

    monkeypatch.setattr("store.migrate.command.upgrade", fail_half_way)
    with pytest.raises(StoreError, match="no_such_table"):
        Catalogue.open(empty_database_url, tmp_path)
    monkeypatch.undo()
    with Catalogue.open(empty_database_url, tmp_path) as opened, opened.reading() as session:
        assert set(inspect(session.connection()).get_view_names()) == VIEWS


def test_the_revisions_are_modules_of_the_package_so_that_a_wheel_holds_them() -> None:
    folder = Path(store.migrations.versions.__file__).parent
    assert (folder.parent / "env.py").is_file()
    names = [path.name.split("_")[1] for path in sorted(folder.glob("revision_*.py"))]
    assert names == list(REVISIONS)


def test_an_sqlite_database_can_be_opened_by_two_at_once(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    with ThreadPoolExecutor(4) as pool:
        for opened in pool.map(lambda _: Catalogue.open(url), range(4)):
            opened.close()
