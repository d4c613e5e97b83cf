"""What a diagnosis takes from a measurement."""

from dataclasses import replace

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from jointlab.diagnosis.load import gap_measurement
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.sine_points import IdentifiedSinePoint
from jointlab.sequences import BUILT_IN, built_in

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
