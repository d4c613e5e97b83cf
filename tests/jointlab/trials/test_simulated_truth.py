"""Results beside what the bench really is: each sine point meets the dwell that it was recorded in."""

from typing import Any

import numpy as np
import pytest

from analysis.direct.dynamic_stiffness import DynamicStiffness
from jointlab.errors import JointlabError
from jointlab.identification.sine_points import IdentifiedSinePoint
from jointlab.trials.simulated_truth import by_amplitude, sine_truths, truth_document


def point(frequency: float, amplitude: float, configuration: str = "shear") -> IdentifiedSinePoint:
    result = DynamicStiffness(
        frequency=frequency,
        amplitude_pp=amplitude * 1e-3,
        complex_stiffness=complex(1.01e6, 1e5),
        covariance=np.diag([1e8, 1e6]),
    )
    return IdentifiedSinePoint("I", configuration, amplitude, result.frequency, result, 1, 0.0, 23.0)


def dwell(frequency: float, amplitude: float, k: float = 1e6, configuration: str = "shear") -> dict[str, Any]:
    return {
        "specimen": "I",
        "configuration": configuration,
        "frequency": frequency,
        "amplitude_pp": amplitude * 1e-3,
        "stiffness": k,
        "damping": 0.1 * k,
    }


def test_the_dwell_at_the_point_s_amplitude_is_the_one_that_counts() -> None:
    points = [point(5, 0.1), point(10, 0.1), point(5, 0.01)]
    dwells = [dwell(5, 0.06, 9e5), dwell(5, 0.1, 1e6), dwell(10, 0.1, 2e6), dwell(5, 0.008, 3e6), dwell(5, 0.01, 4e6)]
    assert [each.k for each in sine_truths(points, dwells)] == [1e6, 2e6, 4e6]


def test_at_one_frequency_the_amplitude_tells_points_apart() -> None:
    points = [point(40, 0.1), point(40, 0.01), point(40, 0.1, "angled"), point(40, 0.01, "angled")]
    dwells = [dwell(40, 0.09), dwell(40, 0.1, 2e6), dwell(40, 0.009), dwell(40, 0.0101, 3e6)]
    dwells += [each | {"configuration": "angled"} for each in dwells]
    assert [each.k for each in sine_truths(points, dwells)] == [2e6, 3e6, 2e6, 3e6]


def test_a_bench_that_cycled_something_else_is_not_taken_for_the_truth() -> None:
    with pytest.raises(JointlabError, match="the bench did not cycle sine point 1 in its turn"):
        sine_truths([point(5, 0.1), point(10, 0.1)], [dwell(5, 0.1)])
    with pytest.raises(JointlabError, match="the bench cycled at 2 places in turn, 1 were measured"):
        sine_truths([point(5, 0.1)], [dwell(5, 0.1), dwell(10, 0.1)])


def test_one_frequency_at_two_amplitudes_in_turn_is_two_points_whatever_the_order() -> None:
    points = [point(5, 0.1), point(10, 0.1), point(10, 0.05), point(5, 0.05), point(5, 0.1)]
    dwells = [dwell(5, 0.07), dwell(5, 0.1), dwell(10, 0.1, 2e6), dwell(10, 0.035, 1), dwell(10, 0.05, 3e6)]
    dwells += [dwell(5, 0.05, 4e6), dwell(5, 0.07, 1), dwell(5, 0.1, 5e6)]
    assert [each.k for each in sine_truths(points, dwells)] == [1e6, 2e6, 3e6, 4e6, 5e6]


def test_dwells_on_known_pieces_are_no_points() -> None:
    (true,) = sine_truths([point(5, 0.1)], [dwell(20, 0.01) | {"specimen": "blank"}, dwell(5, 0.1, 2e6)])
    assert true.k == 2e6


def test_errors_are_relative_and_coverage_is_of_the_95_per_cent_interval() -> None:
    (true,) = sine_truths([point(5, 0.1)], [dwell(5, 0.1)])
    assert true.errors() == pytest.approx((0.01, 1e5 / 1.01e6 / 0.1 - 1))
    assert true.covered()[0]  # 1 % off, with a standard error of 1 %
    (missed,) = sine_truths([point(5, 0.1)], [dwell(5, 0.1, 9e5)])
    assert not missed.covered()[0]


def test_the_document_has_the_shape_of_an_identification() -> None:
    points = [point(10, 0.1), point(5, 0.1), point(10, 0.01)]
    sines = sine_truths(points, [dwell(10, 0.1, 2e6), dwell(5, 0.1, 1e6), dwell(10, 0.01, 4e6)])
    matrix = np.eye(3).tolist()
    truth = {"modes": {"frequency_hz": [77.0]}, "inverse": {"I": {"k": matrix, "h": matrix, "gamma": matrix, "a": 1}}}
    document = truth_document(truth, sines)
    assert document["inverse"] == {"I": {"k": matrix, "h": matrix, "gamma": matrix}}
    series = document["direct"]["I"]["shear"]
    assert series["0.1"] == {"frequency_hz": [5, 10], "k": [1e6, 2e6], "h": [1e5, 2e5], "gamma": [0.1, 0.1]}
    assert series["0.01"]["k"] == [4e6]


def test_amplitudes_are_summed_up_largest_first() -> None:
    sines = sine_truths([point(5, 0.01), point(10, 0.1)], [dwell(5, 0.01), dwell(10, 0.1)])
    assert [amplitude for amplitude, _, _ in by_amplitude(sines)] == [0.1, 0.01]
    assert by_amplitude(()) == []
