from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.inverse.identification import identify_joints
from analysis.structure.beam import Beam, Mesh, Theory, assemble
from analysis.structure.joints import Joint
from analysis.tables import loss_factor_terms, stiffness_terms, supported_frequencies

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

# midpoints of the intervals printed in Table 2, by rows, in units of EI/L^3, EI/L^2 and EI/L
TABLE_2 = {"I": [[141, 103, 5], [103, 129.5, -0.1], [-9, -3, 1]], "II": [[175, -119, 9], [-119, 170, -3], [1, 2, 0.05]]}


@pytest.fixture(scope="module")
def mesh(paper_beam: Beam) -> Mesh:
    """Joint nodes 0.0652 L from either end."""
    offset = 0.0652 * paper_beam.length
    inner = np.linspace(offset, paper_beam.length - offset, 9)
    return Mesh.through([0.0, *inner, paper_beam.length], elements_between=1)


def symmetrised(name: str) -> NDArray[np.complex128]:
    midpoints = np.array(TABLE_2[name])
    return np.asarray((midpoints + midpoints.T) / 2, dtype=complex)


@pytest.fixture(scope="module")
def table_2_joints(paper_beam: Beam) -> list[Joint]:
    return [Joint(name, node, symmetrised(name) * paper_beam.stiffness_unit) for name, node in (("I", 2), ("II", 10))]


def test_the_unit_of_translational_stiffness_is_18802_newtons_a_metre(paper_beam: Beam) -> None:
    assert paper_beam.stiffness_unit[0, 0] == pytest.approx(18802, abs=0.5)
    assert paper_beam.stiffness_unit[0, 2] == pytest.approx(18802 * 0.914, rel=1e-4)
    assert paper_beam.stiffness_unit[2, 2] == pytest.approx(18802 * 0.914**2, rel=1e-4)


def test_both_theories_give_the_frequencies_of_table_1(paper_beam: Beam) -> None:
    mesh = Mesh.through(np.linspace(0, paper_beam.length, 11), 1)
    timoshenko, euler_bernoulli = (assemble(paper_beam, mesh, theory).frequency[3:6] for theory in Theory)
    assert [round(frequency) for frequency in timoshenko] == [160, 439, 856]
    assert [int(frequency) for frequency in euler_bernoulli] == [160, 442, 868]


def test_table_2_leads_to_the_theory_of_table_4(paper_beam: Beam, mesh: Mesh, table_2_joints: list[Joint]) -> None:
    rows = supported_frequencies(paper_beam, mesh, table_2_joints, 1024.0)
    found = np.array([row.timoshenko for row in rows], dtype=float)
    np.testing.assert_allclose(found, [78.5, 82.1, 202.9, 263.0, 475.1, 873.6], rtol=0.002)  # computed independently
    np.testing.assert_allclose(found, [79.0, 82.4, 202, 265, 474, 870], rtol=0.01)  # printed


def test_ten_equal_elements_do_not_lead_from_table_2_to_table_4(paper_beam: Beam, table_2_joints: list[Joint]) -> None:
    equal = Mesh.through(np.linspace(0, paper_beam.length, 11), 1)
    fourth = supported_frequencies(paper_beam, equal, table_2_joints, 1024.0)[3]
    assert fourth.timoshenko == pytest.approx(236, abs=1)


def test_tables_2_and_3_hold_nine_terms_a_joint_in_the_papers_units(bench: Bench) -> None:
    found = identify_joints(bench.free_beam, bench.modes, bench.joint_nodes)
    stiffness = stiffness_terms(found.values(), bench.free_beam.beam.stiffness_unit)
    loss = loss_factor_terms(found.values())
    assert len(stiffness) == len(loss) == 18
    k12, gamma22 = stiffness[1], loss[4]
    assert (k12.joint, k12.element, k12.observable) == ("I", "k12", True)
    assert k12.low < k12.value < k12.high
    assert k12.value == pytest.approx(94.6, abs=0.1)
    assert (gamma22.joint, gamma22.element) == ("I", "gamma22")
    assert gamma22.low < 0.111 < gamma22.high
    assert np.isnan(loss[8].value)
