"""Two measurements of one bench are one; those of a changed bench are not."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.gap.experiments.joined_measurements import together
from analysis.gap.measurement import Measurement


def test_sets_follow_sets_and_points_come_later(empty: Measurement) -> None:
    points = empty.points
    assert points is not None
    both = together(empty, replace(empty, sets=empty.sets[:1]))
    assert [each.peak_force for each in both.sets] == [100.0, 400.0, 100.0]
    assert both.points is not None
    assert np.array_equal(both.points.order, [*points.order, *(points.order + points.order.size)])
    assert np.array_equal(both.points.stiffness, [*points.stiffness, *points.stiffness])
    of_beam = together(replace(empty, points=None), replace(empty, sets=()))
    assert of_beam.points is points
    assert of_beam.preset == empty.preset


def test_a_changed_bench_is_refused_with_what_differs(empty: Measurement) -> None:
    heavier = replace(empty, drawing=replace(empty.drawing, accelerometer_mass=0.02))
    with pytest.raises(AnalysisError, match="accelerometer_mass"):
        together(empty, heavier)
    with pytest.raises(AnalysisError, match="preset"):
        together(empty, replace(empty, preset=1e-3))
