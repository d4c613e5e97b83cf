"""What a diagnosis takes from a measurement."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.direct.dynamic_stiffness import DynamicStiffness
from jointlab.diagnosis.load import LOWEST_LINE, gap_measurement
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.sine_points import IdentifiedSinePoint
from jointlab.sequences import BUILT_IN, built_in
from tests.jointlab.identification.layouts import LAYOUTS, averaged, exact, joints_of

RESULT = DynamicStiffness(
    frequency=50.0, amplitude_pp=1e-4, complex_stiffness=complex(1e6, 1e5), covariance=np.diag([1e8, 1e6])
)


def test_sine_points_are_in_the_order_in_which_they_were_measured_and_not_in_the_planned_one() -> None:
    point = IdentifiedSinePoint("I", "shear", 0.1, 50.0, RESULT, order_number=1, elapsed=700.0, temperature_c=23.0)
    points = (point, *(replace(point, order_number=n, elapsed=at) for n, at in ((2, 10.0), (3, 20.0), (4, 20.0))))
    found = gap_measurement(MeasuredArticle("t", built_in(BUILT_IN).article, (), points, raw=False)).points
    assert found is not None
    assert found.order.tolist() == [4.0, 1.0, 2.0, 3.0]
    assert found.fraction.tolist() == [1.0, 0.0, 1 / 3, 2 / 3]


@pytest.mark.parametrize("blows", [2, 3, 4, 8])
def test_noise_of_a_clean_bench_has_chi_square_one_whatever_the_number_of_blows(blows: int) -> None:
    measured = averaged(LAYOUTS["nine nodes"], blows, seed=20 + blows)
    (struck,) = gap_measurement(measured).sets
    (stored,) = measured.sets
    true = exact(measured.article, joints_of(measured.article), list(stored.inputs))
    error = struck.accelerance - true[:, stored.frequency >= LOWEST_LINE]
    per_datum = np.abs(error) ** 2 / 2 / struck.deviation**2
    # a datum's square has a variance of one, and a little more by that of its weight; neighbours share that
    assert np.mean(per_datum) == pytest.approx(1.0, abs=3 * np.sqrt(1.2 / per_datum.size))
