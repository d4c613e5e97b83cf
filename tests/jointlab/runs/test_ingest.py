"""The ingest stores what a run has written: each record once, whatever is killed when, and waits for a database."""

import multiprocessing
import random
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

import pytest
from sqlalchemy import Connection

from jointlab.runs import ingest
from jointlab.runs.ingest import ForeignSpoolError, Ingester, SpoolIngest
from jointlab.runs.orders import order_to_begin, plan_run
from rig.runs.records import BlowRecord, ResetRecord, SinePointRecord
from rig.runs.spool import RECORDS, spooling, spools
from rig.sequences.sequence import sequence_from
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue, CatalogueParts
from store.database.time_limits import TimeLimits
from store.errors import ContradictionError
from store.measurements.blows import list_blows, withdraw_blow
from store.measurements.runs import list_runs
from store.measurements.sine_records import list_sine_records
from store.service.alarms import list_alarms
from store.service.audit import list_audit_entries
from store.states import AlarmKind
from store.waveforms.folder import WaveformFolder
from tests.fault_proxy import FaultProxy
from tests.jointlab.runs.campaign import Spooled, check_stored, spooled
from tests.rig.conftest import DOCUMENT
from tests.store.statements import before
from tests.waiting import until

NOW = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)


class Killed(BaseException):
    """Stands for SIGKILL: nothing catches it."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "spools"


@pytest.mark.parametrize("seed", range(8))
def test_a_spool_is_stored_record_by_record_and_removed(catalogue: Catalogue, folder: Path, seed: int) -> None:
    chance = random.Random(seed)
    run = spooled(catalogue, folder, chance, chance.randrange(0, 120))  # more than one batch, and less
    SpoolIngest(catalogue, run.path).advance()
    check_stored(catalogue, run)
    assert list(folder.iterdir()) == []


@contextmanager
def killed_at(statement: int) -> Iterator[list[str]]:
    """A kill before the `statement`-th statement of the database; a commit is one, too."""

    def kill(_connection: Connection) -> None:
        raise Killed

    with suppress(Killed), before(lambda seen: len(seen) == statement, kill) as seen:
        yield seen


@pytest.mark.parametrize("seed", range(4))
def test_every_record_is_stored_once_though_the_ingest_is_killed_at_every_statement(
    catalogue: Catalogue, folder: Path, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    chance = random.Random(seed)
    monkeypatch.setattr(ingest, "BATCH", chance.choice([1, 3, 50]))
    run = spooled(catalogue, folder, chance, 4)
    statement = kills = 0
    while spools(folder):
        statement = statement + 1 if seed == 0 else chance.randrange(1, 40)
        with Catalogue.open(*catalogue.place) as opened, killed_at(statement):
            SpoolIngest(opened, run.path).advance()
            kills -= 1
        kills += 1
    assert kills > (5 if seed == 0 else 0)
    check_stored(catalogue, run)


def test_an_ingest_that_goes_on_after_an_unexpected_error_leaves_nothing_out(
    catalogue: Catalogue, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    append, calls = WaveformFolder.append_once, list[int]()

    def failing(waveforms: WaveformFolder, file: str, rows: list[tuple[str, bytes, int]], after: int) -> object:
        calls.append(len(rows))
        if len(calls) % 2:
            raise OSError("unexpected")
        return append(waveforms, file, rows, after)

    monkeypatch.setattr(WaveformFolder, "append_once", failing)
    monkeypatch.setattr(ingest, "BATCH", 3)
    run = spooled(catalogue, folder, random.Random(2), 8)
    one = SpoolIngest(catalogue, run.path)
    while spools(folder):
        with suppress(OSError):
            one.advance()
    assert len(calls) > 4
    check_stored(catalogue, run)


@pytest.mark.parametrize("fails", ["before", "after"])
def test_waveforms_are_appended_once_though_every_second_append_is_the_last_thing_that_happens(
    catalogue: Catalogue, folder: Path, fails: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    append, calls = WaveformFolder.append_once, list[int]()

    def killing(waveforms: WaveformFolder, file: str, rows: list[tuple[str, bytes, int]], after: int) -> object:
        calls.append(len(rows))
        if fails == "before" and len(calls) % 2:
            raise Killed
        found = append(waveforms, file, rows, after)
        if len(calls) % 2:
            raise Killed
        return found

    monkeypatch.setattr(WaveformFolder, "append_once", killing)
    monkeypatch.setattr(ingest, "BATCH", 2)
    run = spooled(catalogue, folder, random.Random(3), 12)
    while spools(folder):
        with suppress(Killed):
            SpoolIngest(catalogue, run.path).advance()
    assert len(calls) > 12
    check_stored(catalogue, run)


_children = multiprocessing.get_context("forkserver")
_children.set_forkserver_preload([__name__])


def ingest_slowly(place: CatalogueParts, path: Path) -> None:
    ingest.BATCH = 1
    with Catalogue.open(*place) as catalogue:
        SpoolIngest(catalogue, path).advance()


def test_every_record_is_stored_once_though_processes_are_killed_while_they_store(
    catalogue: Catalogue, folder: Path
) -> None:
    chance = random.Random(5)
    run, kills = spooled(catalogue, folder, chance, 60), 0
    while spools(folder):
        arguments = (catalogue.place, run.path)
        child = _children.Process(target=ingest_slowly, args=arguments)
        child.start()
        if kills < 6:
            child.join(chance.uniform(0.0, 0.5))
            kills += child.exitcode is None
            child.kill()
        child.join()
    assert kills > 0
    check_stored(catalogue, run)


def test_two_ingests_of_one_spool_store_each_record_once(catalogue: Catalogue, folder: Path) -> None:
    run = spooled(catalogue, folder, random.Random(6), 30)
    with Ingester(catalogue, folder) as one, Ingester(catalogue, folder) as other:
        assert one.settle()
        assert other.settle()
    check_stored(catalogue, run)


def test_what_is_written_is_stored_while_the_run_goes_on(catalogue: Catalogue, folder: Path) -> None:
    run = plan_run(sequence_from(DOCUMENT), TesterLimits(), catalogue, rig="rig")
    template = spooled(catalogue, folder, random.Random(7), 6)
    with Ingester(catalogue, folder) as ingester, spooling(folder, order_to_begin(run, rig="rig")) as spool:
        for number, (record, wave) in enumerate(template.written):
            spool.write(record, wave)
            assert ingester.settle()
            with catalogue.reading() as session:
                measured = len(list_blows(session, run.id))
            is_blow = [isinstance(each, BlowRecord) for each, _ in template.written[: number + 1]]
            assert measured == sum(is_blow)
        assert len(spools(folder)) == 1  # it is written, and kept
    with Ingester(catalogue, folder) as ingester:
        assert ingester.settle()
    assert spools(folder) == []


def test_a_blow_that_is_withdrawn_before_the_rest_is_stored_stays_withdrawn(
    catalogue: Catalogue, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = spooled(catalogue, folder, random.Random(8), 20)
    monkeypatch.setattr(ingest, "BATCH", 1)
    store, withdrawn = SpoolIngest._store, list[int]()

    def withdrawing(self: SpoolIngest, *given: object) -> None:
        store(self, *given)  # type: ignore[arg-type]  # passed on as they are
        with catalogue.reading() as session:
            counting = [blow.id for blow in list_blows(session, run.order.run_id) if blow.accepted]
        if counting and not withdrawn:
            assert counting[0] is not None
            withdrawn.append(counting[0])
            with catalogue.writing() as session:
                withdraw_blow(session, counting[0], "struck beside", "ann")

    monkeypatch.setattr(SpoolIngest, "_store", withdrawing)
    SpoolIngest(catalogue, run.path).advance()
    with catalogue.reading() as session:
        blows = list_blows(session, run.order.run_id)
    assert [blow.id for blow in blows if (blow.reason or "").startswith("withdrawn")] == withdrawn
    assert len(blows) == sum(isinstance(record, BlowRecord) for record, _ in run.written)


def test_the_end_of_a_lost_process_is_cut_off_and_what_it_acknowledged_is_stored(
    catalogue: Catalogue, folder: Path
) -> None:
    run = spooled(catalogue, folder, random.Random(9), 10)
    file = run.path / RECORDS
    file.write_bytes(file.read_bytes()[:-20])  # within the last record, the end of the run
    SpoolIngest(catalogue, run.path).advance()
    assert spools(folder) == []
    with catalogue.reading() as session:
        (stored,) = list_runs(session)
    assert stored.state == "running"  # to be resumed


def test_a_damaged_spool_is_set_aside_and_what_is_before_the_damage_is_stored(
    catalogue: Catalogue, folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    run = spooled(catalogue, folder, random.Random(10), 10)
    file = run.path / RECORDS
    damaged = bytearray(file.read_bytes())
    damaged[-200] ^= 1  # in the record before the last
    file.write_bytes(damaged)
    with Ingester(catalogue, folder) as ingester:
        assert ingester.settle()
    assert "does not fit its checksum" in caplog.text
    assert spools(folder) == []
    assert (folder / f"{run.path.name}.damaged" / RECORDS).read_bytes() == damaged
    with catalogue.reading() as session:
        stored = len(list_blows(session, run.order.run_id))
    assert stored >= sum(isinstance(record, BlowRecord) for record, _ in run.written) - 1 > 0


def test_a_record_that_contradicts_the_store_is_set_aside_with_an_alarm_and_holds_up_no_other(
    catalogue: Catalogue, folder: Path
) -> None:
    run = spooled(catalogue, folder, random.Random(14), 10)
    SpoolIngest(catalogue, run.path).advance()
    measured = next(each for each in run.written if isinstance(each[0], BlowRecord | SinePointRecord))
    with spooling(folder, run.order) as spool:
        spool.write(ResetRecord(NOW, "ann", ("force",), "done"))
        spool.write(*measured)
        spool.write(*measured)
    (path,) = spools(folder)
    written = (path / RECORDS).read_bytes()
    other = spooled(catalogue, folder, random.Random(15), 10)
    with Ingester(catalogue, folder) as ingester:
        assert ingester.settle()
        assert ingester.problem is None
    assert spools(folder) == []
    assert (folder / f"{path.name}.refused" / RECORDS).read_bytes() == written
    with catalogue.reading() as session:
        for number in (run.order.run_id, other.order.run_id):
            assert len(list_blows(session, number)) + len(list_sine_records(session, number)) == 10
        alarms = [each for each in list_alarms(session) if each.kind is AlarmKind.RECORD_REFUSED]
        assert [entry.who for entry in list_audit_entries(session)] == ["ann"]  # what was before it is stored
    assert [(each.run_id, each.text.split(" (")[0]) for each in alarms] == [
        (run.order.run_id, f"record 2 of run {run.order.run_id} contradicts what is stored")
    ]


def test_a_spool_with_a_record_that_contradicts_the_store_is_left_alone_while_it_is_written(
    catalogue: Catalogue, folder: Path
) -> None:
    run = spooled(catalogue, folder, random.Random(14), 10)
    SpoolIngest(catalogue, run.path).advance()
    with spooling(folder, run.order) as spool:
        (path,) = spools(folder)
        one = SpoolIngest(catalogue, path)
        spool.write(*run.written[1])
        with pytest.raises(ContradictionError, match="contradicts what is stored"):
            one.advance()
        spool.write(*run.written[2])
    one.advance()
    assert spools(folder) == []


def test_a_spool_of_another_database_stays_where_it_is(
    catalogue: Catalogue, folder: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'other.db'}") as other:
        run = spooled(other, folder, random.Random(11), 3)
        spooled(catalogue, tmp_path / "elsewhere", random.Random(11), 3)  # a run of the same number
        with pytest.raises(ForeignSpoolError, match="in another database"):
            SpoolIngest(catalogue, run.path).advance()
        with Ingester(catalogue, folder) as ingester:
            assert ingester.settle()
        assert "in another database" in caplog.text
        SpoolIngest(other, run.path).advance()
        check_stored(other, run)


@pytest.mark.parametrize("resets", [[], [ResetRecord(NOW, "ann", ("emergency_stop",), "done")]])
def test_a_run_that_did_not_begin_leaves_nothing_but_the_reset_in_the_audit_log(
    catalogue: Catalogue, folder: Path, resets: list[ResetRecord]
) -> None:
    run = plan_run(sequence_from(DOCUMENT), TesterLimits(), catalogue, rig="rig", provisional=True)
    with spooling(folder, order_to_begin(run, rig="rig", planned=False)) as spool:
        for reset in resets:
            spool.write(reset)
    (path,) = spools(folder)
    SpoolIngest(catalogue, path).advance()
    with catalogue.reading() as session:
        assert list_runs(session) == []
        entries = [(entry.who, entry.target, entry.outcome) for entry in list_audit_entries(session)]
    assert entries == [("ann", "new run", "done") for _ in resets]
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_records_wait_for_a_database_that_is_away(
    catalogue: Catalogue, proxy: FaultProxy, distant_url: str, folder: Path
) -> None:
    run = spooled(catalogue, folder, random.Random(12), 20)
    with Catalogue.open(distant_url, catalogue.waveforms.folder, TimeLimits(connect=2.0)) as distant:
        proxy.cut()
        with Ingester(distant, folder) as ingester:
            until(lambda: ingester.problem is not None)
            assert not ingester.settle(0.1)
            proxy.repair()
            until(ingester.settle)
            assert ingester.problem is None
    check_stored(catalogue, run)


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_connections_that_are_dropped_again_and_again_end_no_run_and_double_nothing(
    catalogue: Catalogue, proxy: FaultProxy, distant_url: str, folder: Path
) -> None:
    template = spooled(catalogue, folder, random.Random(13), 60)
    SpoolIngest(catalogue, template.path).advance()
    run = plan_run(sequence_from(DOCUMENT), TesterLimits(), catalogue, "test", rig="rig")
    order, chance = order_to_begin(run, rig="rig"), random.Random(13)
    with (
        Catalogue.open(distant_url, catalogue.waveforms.folder, TimeLimits(connect=2.0)) as distant,
        Ingester(distant, folder) as ingester,
    ):
        with spooling(folder, order) as spool:
            path = spools(folder)[0]
            for record, wave in template.written:
                if chance.random() < 0.3:
                    proxy.cut()
                    proxy.repair()
                spool.write(record, wave)  # never waits for the database
                time.sleep(chance.uniform(0.0, 0.02))
        until(ingester.settle)
    check_stored(catalogue, Spooled(order, path, template.written))
