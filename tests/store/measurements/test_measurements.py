"""Runs, points, blows and sine records come back as they were stored, and raw rows never change."""

from dataclasses import replace
from datetime import UTC, date, datetime, timedelta, timezone
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sqlalchemy import func, select, text
from sqlalchemy.exc import DBAPIError

from store.catalogue import Catalogue
from store.dof import StoredDof
from store.errors import NotFoundError, StoreError
from store.instrument import Instrument
from store.measurements.blows import add_blow, add_point, list_blows, list_points, withdraw_blow
from store.measurements.instruments import (
    add_calibration,
    calibration_id,
    list_calibrations,
    list_channels,
    list_instruments,
)
from store.measurements.runs import Run, finish_run, get_run, list_runs, start_run
from store.measurements.sine_records import SineRecord, add_sine_record, list_sine_records
from store.measurements.specimens import specimen_id
from store.models.base import Base
from store.models.measurements import InstrumentRow
from store.states import RunState
from store.waveforms.waveform import WaveformReference


@pytest.fixture
def run(catalogue: Catalogue) -> Run:
    with catalogue.writing() as session:
        return start_run(session, kind="hammer", title="first", article="beam 3", setup={"a": 1})


def test_a_run_comes_back_as_it_was_started(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    with catalogue.reading() as session:
        run = get_run(session, filled)
        channels, instruments = list_channels(session, filled), list_instruments(session, filled)
    assert (run.kind, run.title, run.article, run.state) == (
        "hammer", "beam 3, roving hammer", "beam 3", RunState.FINISHED
    )  # fmt: skip
    assert run.setup == samples.setup
    assert run.sequence == {"points": ["1y", "4y"], "blows": 2}
    assert run.started_at == samples.started
    assert run.finished_at is not None
    assert channels == [samples.accelerometer, samples.hammer]
    assert instruments == [Instrument("thermometer", "T-100", "99")]


def test_the_configuration_hash_is_equal_for_equal_configurations_only(
    catalogue: Catalogue, samples: SimpleNamespace
) -> None:
    def configuration_hash(**changes: Any) -> str:
        given: dict[str, Any] = {"setup": {"a": 1, "b": 2}, "channels": [samples.hammer], **changes}
        with catalogue.writing() as session:
            return start_run(session, kind="hammer", title="t", article="a", **given).configuration_hash

    first = configuration_hash()
    assert configuration_hash(setup={"b": 2, "a": 1}) == first
    assert configuration_hash(setup={"a": 1, "b": 3}) != first
    assert configuration_hash(channels=[samples.accelerometer]) != first
    # versions that did not store the polarity made the same hash
    assert configuration_hash(channels=[replace(samples.hammer, polarity=1)]) == first
    assert configuration_hash(channels=[replace(samples.hammer, polarity=-1)]) != first


def test_a_setup_with_nan_is_refused(catalogue: Catalogue) -> None:
    with pytest.raises(StoreError, match="JSON"), catalogue.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={"length": float("nan")})


def test_times_are_utc_whatever_zone_they_were_given_in(catalogue: Catalogue) -> None:
    given = datetime(2026, 7, 1, 14, 0, 0, 123456, tzinfo=timezone(timedelta(hours=2)))
    with catalogue.writing() as session:
        number = start_run(session, kind="hammer", title="t", article="a", setup={}, started_at=given).id
    with catalogue.reading() as session:
        assert get_run(session, number).started_at == datetime(2026, 7, 1, 12, 0, 0, 123456, tzinfo=UTC)


def test_a_time_without_a_zone_is_refused(catalogue: Catalogue) -> None:
    with pytest.raises(StoreError, match="no time zone"), catalogue.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={}, started_at=datetime(2026, 7, 1))


@pytest.mark.parametrize(
    ("state", "reason", "said"),
    [(RunState.FAILED, None, "say why"), (RunState.STOPPED, "", "say why"), (RunState.RUNNING, None, "cannot end")],
)
def test_an_end_that_says_too_little_is_refused(
    catalogue: Catalogue, run: Run, state: RunState, reason: str | None, said: str
) -> None:
    with pytest.raises(StoreError, match=said), catalogue.writing() as session:
        finish_run(session, run.id, state, reason)


def test_a_run_ends_once(catalogue: Catalogue, run: Run) -> None:
    with catalogue.writing() as session:
        ended = finish_run(session, run.id, RunState.FAILED, "tester refused: watchdog is off")
    assert (ended.state, ended.reason) == (RunState.FAILED, "tester refused: watchdog is off")
    with pytest.raises(StoreError, match="is failed already"), catalogue.writing() as session:
        finish_run(session, run.id, RunState.FINISHED)


def test_runs_are_listed_newest_first_and_filtered(catalogue: Catalogue, filled: int) -> None:
    with catalogue.reading() as session:
        assert [run.kind for run in list_runs(session)] == ["sweep", "hammer"]
        assert [run.id for run in list_runs(session, state=RunState.FINISHED)] == [filled]
        assert [run.kind for run in list_runs(session, kind="sweep")] == ["sweep"]
        assert list_runs(session, article="another") == []
        assert [run.kind for run in list_runs(session, limit=1, before=list_runs(session)[0].id)] == ["hammer"]


def test_a_missing_row_is_not_found(catalogue: Catalogue) -> None:
    with catalogue.reading() as session:
        for read in (get_run, list_blows, list_sine_records):
            with pytest.raises(NotFoundError, match="no run 77"):
                read(session, 77)


def test_a_calibration_is_stored_once_and_a_new_one_beside_it(catalogue: Catalogue) -> None:
    first = Instrument("hammer", "086C03", "4711", date(2026, 1, 15), 0.0023, "V/N")
    second = Instrument("hammer", "086C03", "4711", date(2027, 1, 15), 0.0024, "V/N")
    uncalibrated = Instrument("tester", "servo", "7")
    with catalogue.writing() as session:
        numbers = [calibration_id(session, instrument) for instrument in (first, second, uncalibrated) * 2]
        instruments = session.scalar(select(func.count()).select_from(InstrumentRow))
    assert numbers[:3] == numbers[3:]
    assert len(set(numbers)) == 3
    assert instruments == 2


@pytest.mark.parametrize(
    "corrected",
    [{"sensitivity_unit": "V/lbf"}, {"certificate": "K-18"}, {"uncertainty": 0.02}, {"due_on": date(2027, 1, 15)}],
    ids=lambda corrected: next(iter(corrected)),
)
def test_a_corrected_certificate_is_stored_beside_the_first_one(
    catalogue: Catalogue, corrected: dict[str, Any]
) -> None:
    given: dict[str, Any] = {"calibrated_on": date(2026, 1, 15), "sensitivity": 0.0023, "sensitivity_unit": "V/N"}
    with catalogue.writing() as session:
        calibration_id(session, Instrument("hammer", "086C03", "4711", **given))
        for _ in range(2):
            found = add_calibration(session, 1, **given | corrected)
    assert {name: getattr(found, name) for name in corrected} == corrected
    with catalogue.reading() as session:
        assert list_calibrations(session, 1)[0] == found
        assert len(list_calibrations(session, 1)) == 2


def test_a_run_keeps_what_its_instruments_said_of_themselves(catalogue: Catalogue) -> None:
    """Limits that somebody changes between two runs do not make it another tester."""
    testers = [
        Instrument("tester", "servo", "7", details=details) for details in ({"limit": 2e3}, {"limit": 500.0}, {})
    ]
    with catalogue.writing() as session:
        runs = [
            start_run(session, kind="sweep", title="t", article="beam 3", setup={}, instruments=[tester]).id
            for tester in testers
        ]
    with catalogue.reading() as session:
        assert [list_instruments(session, run) for run in runs] == [[tester] for tester in testers]
        assert session.scalar(select(func.count()).select_from(InstrumentRow)) == 1


def test_a_specimen_is_known_by_article_and_name(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        first = specimen_id(session, "beam 3", "I")
        assert specimen_id(session, "beam 3", "I") == first
        assert specimen_id(session, "beam 4", "I") != first


def test_blows_come_back_with_their_reasons_and_waveforms(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    with catalogue.reading() as session:
        blows, points = list_blows(session, filled), list_points(session, filled)
    assert [str(point.dof) for point in points] == ["1y", "4y"]
    assert [(str(blow.point), blow.number, blow.accepted) for blow in blows] == [
        ("1y", 1, True), ("1y", 2, False), ("1y", 3, True), ("4y", 1, True), ("4y", 2, False), ("4y", 3, True)
    ]  # fmt: skip
    assert blows[1].reason == "double hit: second peak 34 % of the first"
    assert (blows[0].peak_force, blows[0].temperature_c, blows[0].struck_at) == (101.0, 23.1, samples.started)
    assert blows[5].waveform is not None
    stored = samples.waveform("hammer", "N", "accelerometer", "m/s^2")
    assert np.array_equal(catalogue.waveforms.read(blows[5].waveform).samples, stored.samples)


@pytest.mark.parametrize(("accepted", "reason"), [(True, "double hit"), (False, None), (False, "")])
def test_a_refused_blow_has_a_reason_and_an_accepted_one_has_none(
    catalogue: Catalogue, run: Run, accepted: bool, reason: str | None
) -> None:
    with catalogue.writing() as session:
        point = add_point(session, run.id, StoredDof(3, "y"))
        with pytest.raises(StoreError, match="blow 1 at 3y"):
            add_blow(session, point, 1, accepted=accepted, reason=reason)


def test_a_waveform_of_another_run_is_refused(catalogue: Catalogue, run: Run) -> None:
    other = WaveformReference("other.waveforms", 1)
    with catalogue.writing() as session:
        point = add_point(session, run.id, StoredDof(3, "y"))
        with pytest.raises(StoreError, match="not of this run"):
            add_blow(session, point, 1, accepted=True, waveform=other)
        record = SineRecord(1, "I", "shear", 0.1, None, 5.0, 0.0, None, None, other)
        with pytest.raises(StoreError, match="not of this run"):
            add_sine_record(session, run.id, record)


def test_the_same_point_and_the_same_blow_come_once(catalogue: Catalogue, run: Run) -> None:
    with catalogue.writing() as session:
        point = add_point(session, run.id, StoredDof(3, "y"))
        add_blow(session, point, 1, accepted=True)
        add_point(session, run.id, StoredDof(3, "y"), set_number=2)
    with pytest.raises(StoreError, match="has point 3y already"), catalogue.writing() as session:
        add_point(session, run.id, StoredDof(3, "y"))
    with pytest.raises(StoreError, match=r"(?i)unique"), catalogue.writing() as session:
        add_blow(session, point, 1, accepted=True)


def test_sine_records_come_back(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    with catalogue.reading() as session:
        (run,) = list_runs(session, kind="sweep")
        (record,) = list_sine_records(session, run.id)
    assert (record.specimen, record.configuration, record.commanded_pp_mm, record.reached_pp_mm) == (
        "I", "shear", 0.1, 0.0998
    )  # fmt: skip
    assert (record.frequency, record.elapsed, record.recorded_at, record.temperature_c) == (
        5.0, 1.5, samples.started, 23.2
    )  # fmt: skip
    assert run.reason == "stopped by the operator"


def test_an_unknown_configuration_is_refused(catalogue: Catalogue, run: Run) -> None:
    record = SineRecord(1, "I", "bending", 0.1, None, 5.0, 0.0, None, None, None)
    with pytest.raises(StoreError, match="'bending' is none of compression"), catalogue.writing() as session:
        add_sine_record(session, run.id, record)


def test_numbers_of_numpy_are_stored_as_numbers(catalogue: Catalogue, run: Run) -> None:
    with catalogue.writing() as session:
        point = add_point(session, run.id, StoredDof(np.int64(3), "y"))  # type: ignore[arg-type]  # what callers do
        add_blow(session, point, np.int32(1), accepted=True, peak_force=np.float32(0.5))  # type: ignore[arg-type]
    with catalogue.reading() as session:
        assert session.execute(text("SELECT point, number, peak_force FROM v_blows")).one() == ("3y", 1, 0.5)


@pytest.mark.parametrize("table", ["points", "blows", "sine_records", "channels", "calibrations"])
@pytest.mark.parametrize("statement", ["UPDATE {} SET software_version = 'x'", "DELETE FROM {}"])
def test_raw_rows_are_never_changed_or_deleted(catalogue: Catalogue, filled: int, table: str, statement: str) -> None:
    with catalogue.reading() as session, pytest.raises(DBAPIError, match="never changed or deleted"):
        session.execute(text(statement.format(table)))


def test_every_row_says_when_and_by_which_version_it_was_written(catalogue: Catalogue, filled: int) -> None:
    with catalogue.reading() as session:
        for table in Base.metadata.sorted_tables:
            if table.name in ("run_instruments", "analysis_runs", "analysis_parents", "audit_head"):
                continue
            rows = session.execute(select(table.c.created_at, table.c.software_version)).all()
            assert rows, table.name
            assert all(row.created_at.tzinfo is UTC or row.created_at.utcoffset() == timedelta() for row in rows)
            assert all(row.software_version for row in rows)


def test_a_blow_that_is_taken_back_stays_and_counts_no_more(catalogue: Catalogue, filled: int) -> None:
    with catalogue.reading() as session:
        before = list_blows(session, filled)
    first = before[0]
    assert first.accepted
    assert first.id is not None
    with catalogue.writing() as session:
        withdrawn = withdraw_blow(session, first.id, "struck beside", "bench")
    with catalogue.reading() as session:
        after = list_blows(session, filled)
        view = session.execute(text(f"SELECT accepted, reason FROM v_blows WHERE blow_id = {first.id}")).one()
        counted = session.execute(text("SELECT blows_accepted, blows_refused FROM v_runs WHERE run_id = 1")).one()
        raw = session.scalar(text(f"SELECT accepted FROM blows WHERE id = {first.id}"))
    assert after == [withdrawn, *before[1:]]
    assert (withdrawn.accepted, withdrawn.reason, withdrawn.waveform) == (
        False, "withdrawn: struck beside", first.waveform
    )  # fmt: skip
    assert (bool(view.accepted), view.reason) == (False, "withdrawn: struck beside")
    assert tuple(counted) == (3, 3)
    assert raw


def test_a_blow_is_taken_back_once(catalogue: Catalogue, filled: int) -> None:
    with catalogue.writing() as session:
        withdraw_blow(session, 1, "struck beside", "bench")
    with pytest.raises(StoreError, match="does not count already: withdrawn"), catalogue.writing() as session:
        withdraw_blow(session, 1, "once more", "bench")
    with pytest.raises(NotFoundError, match="no blow 99"), catalogue.writing() as session:
        withdraw_blow(session, 99, "no", "bench")
