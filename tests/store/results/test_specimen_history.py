"""The history of a specimen over its runs."""

from datetime import UTC, datetime, timedelta

from store.catalogue import Catalogue
from store.measurements.runs import list_runs, start_run
from store.measurements.sine_records import SineRecord, add_sine_record
from store.results.analyses import add_analysis
from store.results.dynamic_stiffness import StoredStiffness, add_dynamic_stiffness
from store.results.joint_matrices import add_joint_matrix
from store.results.specimen_history import (
    NominalPoint,
    nominal_points,
    runs_of_specimen,
    specimen_history,
    unidentified_runs,
)
from store.states import AnalysisKind
from tests.store.conftest import joint_matrix

BEGAN = datetime(2026, 1, 5, tzinfo=UTC)
AT_20 = NominalPoint("shear", 0.1, 20.0)


def measured(catalogue: Catalogue, day: int, stiffness: float, frequencies: tuple[float, ...], again: int = 1) -> int:
    """A run that was identified so often, the first times with another stiffness."""
    with catalogue.writing() as session:
        at = BEGAN + timedelta(days=day)
        run = start_run(session, kind="sweep", title=f"day {day}", article="beam 3", setup={}, started_at=at)
        for time in range(again):
            made = add_analysis(
                session, kind=AnalysisKind.DYNAMIC_STIFFNESS, method="a method", settings={}, runs=[run.id]
            )
            value = stiffness if time == again - 1 else 2 * stiffness
            points = [
                StoredStiffness(number, 1.0, "I", "shear", 0.1, frequency, value, 0.1 * value, 0.1, value, 6.0, 1e3)
                for number, frequency in enumerate(frequencies, start=1)
            ]
            add_dynamic_stiffness(session, made, points)
    return run.id


def test_a_specimen_has_one_newest_result_of_each_run_in_the_order_of_time(catalogue: Catalogue) -> None:
    later = measured(catalogue, 9, 1.2e6, (20.0,))
    first = measured(catalogue, 2, 1.0e6, (20.0, 50.0), again=2)
    with catalogue.reading() as session:
        assert nominal_points(session, "beam 3", "I") == [AT_20, NominalPoint("shear", 0.1, 50.0)]
        history = specimen_history(session, "beam 3", "I", AT_20)
        assert specimen_history(session, "beam 3", "II", AT_20) == []
        assert nominal_points(session, "beam 4", "I") == []
    assert [(each.run_id, each.measured_at.day, each.stiffness) for each in history] == [
        (first, 7, 1.0e6), (later, 14, 1.2e6)
    ]  # fmt: skip
    low, high = history[0].stiffness_low, history[0].stiffness_high
    assert low is not None
    assert high is not None
    assert low < 1.0e6 < high
    assert history[0].loss_factor_low is None


def test_runs_of_a_specimen_are_each_named_once(catalogue: Catalogue) -> None:
    one, other = measured(catalogue, 5, 1.2e6, (20.0, 50.0)), measured(catalogue, 2, 1.0e6, (20.0,), again=2)
    with catalogue.reading() as session:
        assert runs_of_specimen(session, "beam 3", "I") == [one, other]
        assert runs_of_specimen(session, "beam 3", "II") == []


def test_runs_are_listed_from_one_day_to_another(catalogue: Catalogue) -> None:
    early, late = measured(catalogue, 0, 1e6, (20.0,)), measured(catalogue, 3, 1e6, (20.0,))
    with catalogue.reading() as session:
        third = BEGAN + timedelta(days=3)
        assert [run.id for run in list_runs(session, since=third)] == [late]
        assert [run.id for run in list_runs(session, until=third)] == [early]
        assert list_runs(session, since=BEGAN + timedelta(hours=1), until=third) == []


def test_runs_are_listed_by_the_specimen_that_they_measured(catalogue: Catalogue) -> None:
    of_one = measured(catalogue, 0, 1e6, (20.0,))
    with catalogue.writing() as session:
        other = start_run(session, kind="sweep", title="another joint", article="beam 3", setup={})
        made = add_analysis(session, kind=AnalysisKind.DYNAMIC_STIFFNESS, method="m", settings={}, runs=[other.id])
        point = StoredStiffness(1, 1.0, "II", "shear", 0.1, 20.0, 1e6, 1e5, 0.1, 1e6, 6.0, 1e3)
        add_dynamic_stiffness(session, made, [point])
        hammer = start_run(session, kind="hammer", title="joints", article="beam 4", setup={})
        made = add_analysis(session, kind=AnalysisKind.JOINT_MATRICES, method="m", settings={}, runs=[hammer.id])
        add_joint_matrix(session, made, joint_matrix("I", 2))
        recorded = start_run(session, kind="sweep", title="no results yet", article="beam 4", setup={})
        add_sine_record(session, recorded.id, SineRecord(1, "II", "shear", 0.1, None, 20.0, 0.0, None, None, None))
        start_run(session, kind="hammer", title="nothing of it", article="beam 3", setup={})
    with catalogue.reading() as session:
        assert [run.id for run in list_runs(session, specimen="I")] == [hammer.id, of_one]
        assert [run.id for run in list_runs(session, specimen="II")] == [recorded.id, other.id]
        assert [run.id for run in list_runs(session, specimen="I", article="beam 3")] == [of_one]
        assert list_runs(session, specimen="III") == []


def test_a_run_with_records_and_no_points_is_not_identified(catalogue: Catalogue) -> None:
    identified = measured(catalogue, 2, 1.0e6, (20.0,))
    with catalogue.writing() as session:
        waiting = start_run(session, kind="sweep", title="new", article="beam 3", setup={}, started_at=BEGAN).id
        for run in (identified, waiting):
            add_sine_record(session, run, SineRecord(1, "I", "shear", 0.1, None, 20.0, 0.0, None, None, None))
    with catalogue.reading() as session:
        assert unidentified_runs(session, "beam 3", "I") == [waiting]
        assert unidentified_runs(session, "beam 3", "II") == []
