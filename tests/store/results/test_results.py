"""Results: every array and interval comes back, recomputed beside the old ones, and damage is found."""

from dataclasses import fields, is_dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.database.columns import decode_array, encode_array
from store.errors import DamagedError, LeftOutError, NotFoundError, StoreError
from store.measurements.frequency_responses import add_frequency_responses, list_frequency_responses
from store.measurements.runs import list_runs, start_run
from store.results.analyses import NO_RESULT, add_analysis, get_analysis, latest_analysis, list_analyses
from store.results.comparisons import add_comparisons, list_comparisons
from store.results.dynamic_stiffness import add_dynamic_stiffness, list_dynamic_stiffness
from store.results.joint_matrices import add_joint_matrix, list_joint_matrices
from store.results.modes import add_modes, get_modes
from store.states import AnalysisKind


def assert_same(found: Any, expected: Any) -> None:
    """Equal to the last bit, arrays and dataclasses included; NaN equals NaN."""
    assert type(found) is type(expected)
    if is_dataclass(expected):
        for field in fields(expected):
            assert_same(getattr(found, field.name), getattr(expected, field.name))
    elif isinstance(expected, np.ndarray):
        assert found.dtype == expected.dtype
        np.testing.assert_array_equal(found, expected)
    else:
        assert found == expected


def _analysis(session: Session, *runs: int) -> int:
    return add_analysis(session, kind="frequency_responses", method="H1", settings={}, runs=runs)


def _newest(catalogue: Catalogue, run_id: int, kind: AnalysisKind) -> int:
    with catalogue.reading() as session:
        return latest_analysis(session, run_id, kind).id


def _sweep(catalogue: Catalogue) -> int:
    with catalogue.reading() as session:
        return list_runs(session, kind="sweep")[0].id


def test_frequency_responses_come_back(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    with catalogue.reading() as session:
        (found,) = list_frequency_responses(session, filled)
    assert_same(found, samples.frequency_responses())


def test_single_precision_and_missing_coherence_are_kept(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    measured = samples.frequency_responses()
    given = replace(measured, accelerance=measured.accelerance.astype(np.complex64), coherence=None, variance=None)
    with catalogue.writing() as session:
        analysis = _analysis(session, filled)
        add_frequency_responses(session, analysis, filled, given)
    with catalogue.reading() as session:
        (found,) = list_frequency_responses(session, filled, analysis)
    assert_same(found, given)


def test_the_newest_frequency_responses_are_given_and_the_old_ones_kept(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    old = _newest(catalogue, filled, AnalysisKind.FREQUENCY_RESPONSES)
    again = replace(samples.frequency_responses(), averages=7)
    with catalogue.writing() as session:
        analysis = _analysis(session, filled)
        add_frequency_responses(session, analysis, filled, again)
    with catalogue.reading() as session:
        assert list_frequency_responses(session, filled)[0].averages == 7
        assert list_frequency_responses(session, filled, old)[0].averages == 2


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"accelerance": np.zeros((2, 8), complex)}, r"accelerance has shape \(2, 8\)"),
        ({"accelerance": np.zeros((2, 9))}, "not complex"),
        ({"coherence": np.zeros((1, 9))}, "coherence has shape"),
        ({"frequency": np.zeros(9)}, "do not rise"),
        ({"inputs": ()}, "empty or not unique"),
    ],
)
def test_a_set_that_does_not_fit_together_is_refused(
    samples: SimpleNamespace, change: dict[str, Any], said: str
) -> None:
    with pytest.raises(StoreError, match=said):
        replace(samples.frequency_responses(), **change)


def test_nan_in_an_accelerance_is_refused_by_point(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    bad = samples.frequency_responses()
    bad.accelerance[1, 3] = np.nan
    with pytest.raises(StoreError, match="accelerance of 4y"), catalogue.writing() as session:
        add_frequency_responses(session, _analysis(session, filled), filled, bad)
    with catalogue.reading() as session:
        assert len(list_analyses(session, filled, "frequency_responses")) == 1


def test_a_damaged_array_is_found_and_named(catalogue: Catalogue, filled: int) -> None:
    with catalogue.writing() as session:
        column = session.scalar(text("SELECT accelerance FROM frequency_responses WHERE row_number = 2"))
        damaged = bytearray(column)
        damaged[150] ^= 1
        session.execute(
            text("UPDATE frequency_responses SET accelerance = :a WHERE row_number = 2"), {"a": bytes(damaged)}
        )
    with catalogue.reading() as session, pytest.raises(DamagedError, match=f"run {filled}, set 1: accelerance"):
        list_frequency_responses(session, filled)


@pytest.mark.parametrize("column", [b"", b"abc", encode_array(np.arange(3.0), "a")[:-1]])
def test_an_array_that_is_cut_short_is_damaged(column: bytes) -> None:
    with pytest.raises(DamagedError, match="here"):
        decode_array(column, "here")


@pytest.mark.parametrize("array", [np.array(["text"]), np.array([None])])
def test_only_numbers_are_stored_as_arrays(array: Any) -> None:
    with pytest.raises(StoreError, match="cannot be stored"):
        encode_array(array, "here")


def test_modes_come_back(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    with catalogue.reading() as session:
        assert_same(get_modes(session, latest_analysis(session, filled, "modes").id), samples.modes())


def test_modes_without_covariance_come_back(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    given = replace(samples.modes(), pole_covariance=None, shape_covariance=None, predicted_frequency=None)
    with catalogue.writing() as session:
        analysis = add_analysis(session, kind="modes", method="LSCF", settings={}, runs=[filled])
        add_modes(session, analysis, given)
    with catalogue.reading() as session:
        found = get_modes(session, analysis)
    assert found.pole_covariance is None
    assert found.shape_covariance is None
    assert found.predicted_frequency is not None
    assert np.isnan(found.predicted_frequency).all()


def test_joint_matrices_come_back(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    analysis = _newest(catalogue, filled, AnalysisKind.JOINT_MATRICES)
    with catalogue.reading() as session:
        found = list_joint_matrices(session, analysis)
    for one, expected in zip(found, [samples.joint_matrix("I", 2), samples.joint_matrix("II", 5)], strict=True):
        assert_same(one, expected)


def test_an_analysis_without_joints_tells_its_reason_and_makes_older_joints_the_older_ones(
    catalogue: Catalogue, filled: int
) -> None:
    with catalogue.writing() as session:
        older = latest_analysis(session, filled, AnalysisKind.JOINT_MATRICES)
        newer = add_analysis(
            session, kind=older.kind, method=older.method, settings={NO_RESULT: "no mode"}, runs=[filled]
        )
    with catalogue.reading() as session:
        with pytest.raises(LeftOutError, match=f"analysis {newer} has no joint matrices: no mode"):
            list_joint_matrices(session, newer)
        latest = session.execute(text(f"SELECT latest FROM v_joint_stiffness WHERE analysis_id = {older.id}"))
        assert not any(latest.scalars().all())


def test_a_stiffness_that_is_not_known_is_refused(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    matrix = samples.joint_matrix("I", 2)
    matrix.stiffness[0, 1] = np.nan
    with pytest.raises(StoreError, match="joint I: k12"), catalogue.writing() as session:
        add_joint_matrix(session, _analysis(session, filled), matrix)


def test_dynamic_stiffness_comes_back(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    analysis = _newest(catalogue, _sweep(catalogue), AnalysisKind.DYNAMIC_STIFFNESS)
    with catalogue.reading() as session:
        found = list_dynamic_stiffness(session, analysis)
    assert found[0].sine_record_id is not None
    assert found == samples.dynamic_stiffness(found[0].sine_record_id)


def test_an_infinite_dynamic_stiffness_is_refused_by_point(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    points = samples.dynamic_stiffness()
    points[2] = replace(points[2], loss_factor=float("inf"))
    with pytest.raises(StoreError, match="sine point 3: loss_factor"), catalogue.writing() as session:
        add_dynamic_stiffness(session, _analysis(session, filled), points)


def test_comparisons_come_back(catalogue: Catalogue, filled: int, samples: SimpleNamespace) -> None:
    analysis = _newest(catalogue, filled, AnalysisKind.COMPARISONS)
    with catalogue.reading() as session:
        assert list_comparisons(session, analysis) == samples.comparisons


def test_an_analysis_knows_its_runs_parents_settings_and_software(catalogue: Catalogue, filled: int) -> None:
    sweep = _sweep(catalogue)
    with catalogue.reading() as session:
        compared = latest_analysis(session, filled, AnalysisKind.COMPARISONS)
        parents = {get_analysis(session, number).kind for number in compared.parents}
    assert compared.runs == (filled, sweep)
    assert parents == {"joint_matrices", "dynamic_stiffness"}
    assert compared.settings == {"order": 20}
    assert compared.software_version
    assert len(compared.configuration_hash) == 64


def test_an_analysis_of_no_run_is_refused(catalogue: Catalogue) -> None:
    with pytest.raises(StoreError, match="names no run"), catalogue.writing() as session:
        add_analysis(session, kind="modes", method="LSCF", settings={}, runs=[])


def test_results_about_two_articles_at_once_are_refused(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    with catalogue.writing() as session:
        other = start_run(session, kind="sweep", title="t", article="another", setup={}).id
    with pytest.raises(StoreError, match="2 test articles"), catalogue.writing() as session:
        add_comparisons(session, _analysis(session, filled, other), samples.comparisons)


def test_results_that_are_not_there_are_not_found(catalogue: Catalogue, filled: int) -> None:
    with catalogue.reading() as session:
        for read in (get_modes, list_joint_matrices, list_dynamic_stiffness, list_comparisons, get_analysis):
            with pytest.raises(NotFoundError, match="999"):
                read(session, 999)
        with pytest.raises(NotFoundError, match="no frequency responses"):
            list_frequency_responses(session, _sweep(catalogue))
        with pytest.raises(NotFoundError, match="has no modes; identify or diagnose it first"):
            latest_analysis(session, _sweep(catalogue), "modes")
