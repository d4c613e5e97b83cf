"""What a diagnosis takes from a measurement."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.direct.dynamic_stiffness import DynamicStiffness
from jointlab.diagnosis.load import LOWEST_LINE, gap_measurement, subject_of_bundle
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.sine_points import IdentifiedSinePoint
from jointlab.sequences import BUILT_IN, built_in
from store.dof import StoredDof
from store.exchange.blow_file import BundleBlow
from store.exchange.bundle import read_bundle
from tests.jointlab.identification.layouts import LAYOUTS, averaged, exact, joints_of, write_bundle

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


def test_a_blow_in_the_negative_direction_pushes_as_one_in_the_positive_does(tmp_path: Path) -> None:
    pulse, answer = np.array([0.02, 0.0, -60.0, -100.0, -50.0, 0.01]), np.array([0.0, 0.0, -1.0, -3.0, 2.0, 4.0])
    up, down = (
        BundleBlow(name, StoredDof(1, "y"), StoredDof(3, "y"), sign * pulse, sign * answer, 4096.0, 1)
        for name, sign in (("up.unv", -1), ("down.unv", 1))
    )
    bundle = replace(read_bundle(write_bundle(LAYOUTS["nine nodes"], tmp_path / "bundle")), blows=(up, down))
    for found in subject_of_bundle(bundle).measurement.blows:
        assert found.force.tolist() == (-pulse).tolist()
        assert found.acceleration.tolist() == (-answer).tolist()
