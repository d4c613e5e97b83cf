from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.errors import AnalysisError
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.bench_design import (
    PAPER_SUPPORTS,
    Support,
    bench_design,
    condition_numbers,
    eigenvalue_study,
    joint_design,
)
from analysis.structure.joints import Joint, inclined_support

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

BEAM = Beam(0.914, 0.0254, 0.0508, 207e9, 0.3, 7850.0)


@given(
    stiffness_ratio=st.floats(1e-3, 1e3),
    aspect_ratio=st.floats(1.01, 50),
    inclination=st.floats(-1.57, 1.57),
    rotation_ratio=st.floats(0, 10),
    loss_factor=st.floats(0, 0.5),
)
def test_the_design_of_an_inclined_support_is_what_it_was_made_of(
    stiffness_ratio: float, aspect_ratio: float, inclination: float, rotation_ratio: float, loss_factor: float
) -> None:
    lossy = stiffness_ratio * (1 + 1j * loss_factor)
    support = inclined_support(BEAM, "I", 2, lossy, aspect_ratio, inclination, rotation_ratio)
    found = joint_design(BEAM, support)
    assert found.stiffness_ratio == pytest.approx(stiffness_ratio, rel=1e-9)
    assert found.aspect_ratio == pytest.approx(aspect_ratio, rel=1e-9)
    turned = (found.inclination - inclination + np.pi / 2) % np.pi - np.pi / 2
    assert turned == pytest.approx(0, abs=1e-7)
    assert -np.pi / 2 < found.inclination <= np.pi / 2
    assert found.rotation_ratio == pytest.approx(rotation_ratio, rel=1e-9, abs=1e-12)


def test_the_papers_bench_keeps_to_what_it_was_designed_for_but_for_the_stiffer_joint(bench: Bench) -> None:
    """Cylinders of a = 0.36e6 and b = 2.30e6 N/m at joint I, 0.49e6 and 2.70e6 at joint II, at 45 degrees."""
    found = bench_design(bench.free_beam, bench.joints)
    first, second = found.joints
    unit = bench.free_beam.beam.stiffness_unit[0, 0]
    assert first.stiffness_ratio == pytest.approx(2 * 0.36e6 / unit)
    assert first.aspect_ratio == pytest.approx(2.30 / 0.36)
    assert np.degrees(first.inclination) == pytest.approx(45)
    assert np.degrees(second.inclination) == pytest.approx(-45)
    assert found.first_elastic == pytest.approx(160, abs=0.5)
    assert found.first_longitudinal == pytest.approx(2809, abs=1)
    assert len(found.statements) == 1
    assert found.statements[0].startswith("joint II: k-bar = 52.1 is above 50")


def test_a_joint_alike_in_all_directions_has_no_inclination_and_is_complained_of() -> None:
    even = Joint("I", 2, np.diag([1e5, 1e5, 10.0]).astype(complex))
    found = joint_design(BEAM, even)
    assert (found.aspect_ratio, found.inclination) == (1.0, 0.0)
    free_beam = assemble(BEAM, Mesh.through([0.0, 0.1, 0.8, 0.914]))
    assert "joint I: R = 1 is below 2" in bench_design(free_beam, [even]).statements[0]


def test_a_beam_that_is_too_long_is_said() -> None:
    long = replace(BEAM, length=3.0)
    free_beam = assemble(long, Mesh.through([0.0, 1.5, 3.0]))
    found = bench_design(free_beam, [])
    assert ["first elastic" in found.statements[0], "longitudinal" in found.statements[1]] == [True, True]


def test_a_joint_that_does_not_push_back_is_refused_with_its_stiffness() -> None:
    with pytest.raises(AnalysisError, match=r"joint II has a stiffness of -2e\+05 N/m in one direction"):
        joint_design(BEAM, Joint("II", 10, np.diag([1e5, -2e5, 1.0]).astype(complex)))


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
