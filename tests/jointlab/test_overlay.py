"""Results of several runs over each other."""

from dataclasses import replace

import numpy as np
import pytest

from jointlab.overlay import (
    RunResults,
    accelerances,
    common_amplitudes,
    common_rows,
    joint_intervals,
    read_results,
    sweeps,
)
from jointlab.overlay_document import overlay_document
from store.catalogue import Catalogue
from store.dof import StoredDof
from store.errors import NotFoundError
from store.measurements.runs import start_run


@pytest.fixture
def first(measured_catalogue: Catalogue) -> RunResults:
    (found,) = read_results(measured_catalogue, [1])
    return found


@pytest.fixture
def second(first: RunResults) -> RunResults:
    """Another run, with joint I alone in shear, at 0.1 mm and at an amplitude of its own."""
    points = [each for each in first.points if (each.specimen, each.configuration) == ("I", "shear")]
    large = [each for each in points if each.amplitude_pp_mm == 0.1]
    own = [replace(each, amplitude_pp_mm=0.2) for each in large]
    return replace(first, run=replace(first.run, id=2), points=(*large[::-1], *own))


def test_runs_are_read_in_the_order_asked_for_and_one_without_results_is_empty(
    measured_catalogue: Catalogue, first: RunResults
) -> None:
    with measured_catalogue.writing() as session:
        empty = start_run(session, kind="import", title="t", article="a", setup={}).id
    found = read_results(measured_catalogue, [empty, 1])
    assert [each.run.id for each in found] == [empty, 1]
    assert (found[0].points, found[0].responses, dict(found[0].joints)) == ((), None, {})
    assert len(found[1].points) == len(first.points) == 36
    with pytest.raises(NotFoundError, match="no run 99"):
        read_results(measured_catalogue, [1, 99])


def test_only_what_two_runs_have_is_overlaid_by_rising_frequency(first: RunResults, second: RunResults) -> None:
    assert common_amplitudes([first, second]) == [0.1]
    assert common_amplitudes([first, first]) == [0.01, 0.1]  # of as many runs, the smallest first
    assert common_amplitudes([first]) == []
    found = sweeps([first, second], 0.1)
    assert list(found) == [("I", "shear")]
    by_run = found["I", "shear"]
    assert list(by_run) == ["run 1", "run 2"]
    assert by_run["run 1"] == by_run["run 2"]
    frequency = [point.frequency for point in by_run["run 2"]]
    assert frequency == sorted(frequency)
    assert sweeps([first, second], 0.2) == {}


def test_rows_in_common_begin_with_the_driving_point(first: RunResults, second: RunResults) -> None:
    responses = first.responses
    assert responses is not None
    kept = [responses.inputs.index(StoredDof.parse(each)) for each in ("1y", "3y")]
    inputs = tuple(responses.inputs[index] for index in kept)
    fewer = replace(
        responses, inputs=inputs, accelerance=2 * responses.accelerance[kept], coherence=None, variance=None
    )
    other = replace(second, responses=fewer)
    rows = common_rows([first, other])
    assert [f"{struck} {response}" for struck, response in rows] == ["3y 3y", "1y 3y"]
    found = accelerances([first, other, replace(first, responses=None)], rows[1])
    assert list(found) == ["run 1", "run 2"]
    assert np.array_equal(found["run 2"][1], 2 * found["run 1"][1])


def test_terms_of_joints_that_two_good_fits_determine_have_an_interval_for_each_run(
    first: RunResults, second: RunResults
) -> None:
    found = joint_intervals([first, second])
    assert list(found)[:4] == ["k22 I", "k22 II", "gamma22 I", "gamma22 II"]
    assert not any(name.startswith("k11") for name in found)
    joint = first.joints["I"]
    assert found["k22 I"] == dict.fromkeys(("run 1", "run 2"), tuple(joint.stiffness_ci95[1, 1]))
    assert joint_intervals([first, replace(second, failed=True)]) == {}
    hidden = replace(joint, observable=np.zeros((3, 3), dtype=bool))
    assert "k22 I" not in joint_intervals([first, replace(second, joints={"I": hidden})])


def test_a_point_without_a_standard_error_has_no_interval_in_the_document(
    first: RunResults, second: RunResults
) -> None:
    point = next(each for each in second.points if each.amplitude_pp_mm == 0.1)
    unknown = replace(point, result=replace(point.result, covariance=np.zeros((2, 2))))
    found = overlay_document([first, replace(second, points=(unknown,))])
    (sweep,) = found.sweeps
    known, other = sweep.curves
    assert (known.run_id, other.run_id) == (1, 2)
    assert other.stiffness == [point.result.stiffness]
    assert other.stiffness_ci95 == other.loss_factor_ci95 == [[None, None]]
    assert known.stiffness_ci95[0][0] is not None
