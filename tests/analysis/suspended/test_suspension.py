from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint
from analysis.suspended.suspension import Suspension, participation

BAR = Beam(0.914, 0.0254, 0.0508, 207e9, 0.3, 7850.0)
POSITIONS = np.array([0.0, 0.1, 0.205, 0.457, 0.709, 0.814, 0.914])
BENDING = (3, 4, 5)


@pytest.fixture(scope="module")
def free_beam() -> FreeBeam:
    return assemble(BAR, Mesh.through(POSITIONS, 6), damping_ratios=(0.004, 0.001, 0.001))


@settings(max_examples=10, deadline=None)
@given(
    frequency=st.floats(1.0, 12.0),
    loss_factor=st.floats(0.0, 0.3),
    nodes=st.sampled_from([(1, 7), (2, 6), (3, 5), (2, 5)]),
)
def test_springs_at_known_places_raise_elastic_modes_as_rayleigh_says(
    free_beam: FreeBeam, frequency: float, loss_factor: float, nodes: tuple[int, int]
) -> None:
    kilograms = BAR.density * BAR.area * BAR.length
    spring = kilograms * (2 * np.pi * frequency) ** 2 / 2 * (1 + 1j * loss_factor)
    springs = [Joint(str(node), node, np.diag([1.0, spring, 0])) for node in nodes]
    hanging = eigensolution(free_beam, springs, 1024.0, [Dof.parse("1y")])
    poles = hanging.poles[-3:]
    measured, ratios = np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)
    free, own = free_beam.frequency[list(BENDING)], np.array([0.004, 0.001, 0.001])

    suspension = Suspension(frequency, positions=tuple(POSITIONS[node - 1] for node in nodes))
    part = participation(suspension, free_beam, BENDING)
    added = frequency**2 * part.mean
    left_out = (frequency / free) ** 2
    lossy = loss_factor * own * left_out  # two kinds of damping in one mode
    assert np.all(np.abs(np.sqrt(free**2 + added) / measured - 1) < 8 * left_out**2 + 2 * lossy)
    expected = own * free / measured + loss_factor * added / (2 * measured**2)
    assert np.all(np.abs(expected / ratios - 1) < (0.1 + 6 * loss_factor) * left_out)
    assert np.all(part.deviation == 0)


def test_a_spring_at_the_end_of_a_slender_bar_takes_part_fourfold_and_at_a_node_not_at_all() -> None:
    slender = assemble(Beam(1.0, 0.001, 0.01, 207e9, 0.3, 7850.0), Mesh.through(np.linspace(0, 1, 11)))
    at_end = participation(Suspension(1.0, positions=(0.0,)), slender, BENDING)
    np.testing.assert_allclose(at_end.mean, 4, rtol=1e-4)
    at_node = participation(Suspension(1.0, positions=(0.22416, 1 - 0.22416)), slender, (3,))
    assert at_node.mean[0] < 1e-6


def test_springs_at_unknown_places_take_part_once_on_average_with_the_scatter_of_the_shape(free_beam: FreeBeam) -> None:
    unknown = participation(Suspension(3.0), free_beam, BENDING)
    np.testing.assert_allclose(unknown.mean, 1, rtol=0.02)  # rotary inertia takes a little
    everywhere = np.linspace(0, BAR.length, 400)
    each = [participation(Suspension(3.0, positions=(place,)), free_beam, BENDING).mean for place in everywhere]
    np.testing.assert_allclose(unknown.deviation, np.std(each, axis=0), rtol=0.02)
    assert np.all(np.max(np.abs(each - unknown.mean), axis=0) < 4 * unknown.deviation)


def test_a_point_mass_hangs_in_the_springs_as_well() -> None:
    mesh = Mesh.through(POSITIONS)
    masses = {3: 0.5}
    loaded = assemble(BAR, mesh, point_masses=masses)
    across = loaded.shapes[mesh.degree(Dof.parse("1y")), 3]
    found = participation(Suspension(3.0, positions=(0.0,)), loaded, (3,)).mean[0]
    assert found == pytest.approx((BAR.density * BAR.area * BAR.length + 0.5) * across**2, rel=1e-9)


def test_a_spring_beside_the_bar_is_refused(free_beam: FreeBeam) -> None:
    with pytest.raises(AnalysisError, match=r"no spring can be at \[1\.2\] m; the bar reaches from 0\.0 to 0\.914 m"):
        participation(Suspension(3.0, positions=(0.1, 1.2)), free_beam, BENDING)


@pytest.mark.parametrize("frequency", [0.0, -1.0, float("nan")])
def test_a_suspension_without_a_frequency_is_refused(frequency: float) -> None:
    with pytest.raises(AnalysisError, match="the suspension's frequency is"):
        Suspension(frequency)


def test_a_suspension_of_negative_loss_or_error_is_refused() -> None:
    with pytest.raises(AnalysisError, match=r"loss_factor is -0\.1"):
        Suspension(3.0, loss_factor=-0.1)
    with pytest.raises(AnalysisError, match="standard_error is -1"):
        Suspension(3.0, standard_error=-1)
