from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.conditioning import PAPER_SUPPORTS, Support, condition_numbers, eigenvalue_study


@pytest.fixture(scope="module")
def ten_elements(paper_beam: Beam) -> FreeBeam:
    return assemble(paper_beam, Mesh.through(np.linspace(0, paper_beam.length, 11), 1))


def test_three_modes_give_the_condition_numbers_of_figure_3a(ten_elements: FreeBeam) -> None:
    found = condition_numbers(ten_elements, [0.1, 10, 50, 100, 300], modes=3)
    np.testing.assert_allclose(found[:, 0], [3.9, 4.2, 4.3, 5.3, 123], rtol=0.013)
    np.testing.assert_allclose(found[:, 1], found[:, 0], rtol=1e-6)  # the design is symmetric


def test_six_modes_bring_the_condition_number_down_as_in_figure_3b(ten_elements: FreeBeam) -> None:
    assert condition_numbers(ten_elements, [300], modes=6)[0, 0] == pytest.approx(19, rel=0.01)


def test_condition_stays_between_3_and_5_up_to_a_stiffness_ratio_of_50(ten_elements: FreeBeam) -> None:
    found = condition_numbers(ten_elements, np.geomspace(0.1, 50, 12), modes=3)
    assert np.all((found > 3) & (found < 5))


def test_sensitivities_are_the_slopes_of_the_frequencies(ten_elements: FreeBeam) -> None:
    step = 1e-4
    ratios = np.array([1.0, 40.0, 500.0])
    lossless = [replace(support, loss_factor=0.0) for support in PAPER_SUPPORTS]
    study = eigenvalue_study(ten_elements, ratios, supports=lossless)
    up, down = (eigenvalue_study(ten_elements, ratios * np.exp(s), supports=lossless) for s in (step, -step))
    slope = np.log(up.frequency / down.frequency) / (2 * step)
    np.testing.assert_allclose(study.sensitivity, slope, atol=1e-5)


def test_soft_supports_leave_the_bar_rigid_on_springs_and_its_bending_alone(ten_elements: FreeBeam) -> None:
    study = eigenvalue_study(ten_elements, [0.1])
    np.testing.assert_allclose(study.sensitivity[:, 0], [0.5, 0.5, 0.5, 0, 0, 0], atol=2e-3)
    assert study.frequency[3, 0] == pytest.approx(1.0, abs=2e-3)


def test_a_rigid_mode_stops_following_the_joints_above_a_ratio_of_100(ten_elements: FreeBeam) -> None:
    sensitivity = eigenvalue_study(ten_elements, [10, 100, 1000]).sensitivity[0]
    assert sensitivity[0] > 0.49
    assert sensitivity[1] < 0.1
    assert sensitivity[2] < 0.01


def test_any_number_of_supports_is_studied_at_any_node(ten_elements: FreeBeam) -> None:
    three = (*PAPER_SUPPORTS, Support("M", 6, aspect_ratio=2.0, inclination=0.0))
    numbers = condition_numbers(ten_elements, [10.0, 50.0], modes=6, supports=three)
    assert numbers.shape == (2, 3)
    assert np.all((numbers > 1) & (numbers < 10))
    stiffer = eigenvalue_study(ten_elements, [10.0], supports=three).frequency
    assert np.all(stiffer > eigenvalue_study(ten_elements, [10.0]).frequency)


def test_more_modes_than_freedoms_are_refused(ten_elements: FreeBeam) -> None:
    with pytest.raises(AnalysisError, match="40 modes are too many for a mesh of 33 freedoms"):
        condition_numbers(ten_elements, [1.0], modes=40)
