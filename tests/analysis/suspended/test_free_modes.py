from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.modes import Modes, poles_from
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint
from analysis.suspended.free_modes import BeamSuspension, elastic_modes, participation

POINTS = tuple(map(Dof.parse, ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y"]))
DAMPING = np.array([0.004, 0.001, 0.001, 0.001])


@pytest.fixture(scope="module")
def free_beam(paper_beam: Beam) -> FreeBeam:
    return assemble(paper_beam, Mesh.through(np.linspace(0, paper_beam.length, 11), 2))


def measured(free_beam: FreeBeam, frequency: Real, damping: Real, shapes_of: list[int]) -> Modes:
    """Modes of these frequencies in Hz and damping ratios, with the shapes of these free modes."""
    rows = [free_beam.mesh.degree(point) for point in POINTS]
    shapes = free_beam.shapes[np.ix_(rows, shapes_of)].T.astype(complex) * (0.3 - 0.2j)
    poles = 2 * np.pi * frequency * (-damping + 1j * np.sqrt(1 - damping**2))
    errors = np.stack([1e-5 * frequency, 1e-5 + 0 * damping], axis=1).ravel()
    return Modes(poles, shapes, POINTS, np.diag(errors**2))


def test_elastic_modes_are_told_from_those_of_the_suspension_and_from_bending_out_of_plane(free_beam: FreeBeam) -> None:
    true = free_beam.frequency[3:6]
    frequency = np.array([4.0, true[0], 321.0, true[1], true[2] * 0.998, 885.0])
    modes = measured(free_beam, frequency, np.full(6, 0.001), [1, 3, 3, 4, 5, 4])
    found = elastic_modes(modes, free_beam)
    assert found.numbers == (4, 5, 6)
    np.testing.assert_allclose(found.frequency, frequency[[1, 3, 4]], rtol=1e-12)
    assert found.suspension_modes == pytest.approx((4.0,))
    assert found.others == pytest.approx((321.0, 885.0))


def test_a_mode_near_in_frequency_but_of_another_shape_is_not_taken(free_beam: FreeBeam) -> None:
    true = free_beam.frequency[3:6]
    found = elastic_modes(measured(free_beam, true, DAMPING[:3], [3, 3, 5]), free_beam)
    assert found.numbers == (4, 6)
    assert found.others == pytest.approx((true[1],))
    assert found.frequency_estimate(5) is None
    assert found.damping_estimate(5) is None


def test_of_two_candidates_the_nearer_is_taken(free_beam: FreeBeam) -> None:
    first = float(free_beam.frequency[3])
    pair = measured(free_beam, np.array([first * 0.95, first * 1.01]), DAMPING[:2], [3, 3])
    found = elastic_modes(pair, free_beam)
    assert found.frequency == pytest.approx([first * 1.01])
    assert found.others == pytest.approx([first * 0.95])


@settings(max_examples=30, deadline=None)
@given(damping=st.floats(1e-4, 0.2), shift=st.floats(0.95, 1.05))
def test_viscous_damping_ratio_and_undamped_frequency_come_out_of_the_pole(
    free_beam: FreeBeam, damping: float, shift: float
) -> None:
    frequency = shift * free_beam.frequency[3:6]
    found = elastic_modes(measured(free_beam, frequency, np.full(3, damping), [3, 4, 5]), free_beam)
    np.testing.assert_allclose(found.frequency, frequency, rtol=1e-10)
    np.testing.assert_allclose(found.damping_ratio, damping, rtol=1e-10)


@pytest.mark.parametrize("suspension", [None, BeamSuspension(9.0, loss_factor=0.2, positions=(0.1, 0.8))])
def test_the_covariance_follows_the_poles_to_first_order(
    free_beam: FreeBeam, suspension: BeamSuspension | None
) -> None:
    """Columns of the Jacobian by differences in f and eta, for modes damped enough that they matter."""
    frequency, loss = 1.001 * free_beam.frequency[3:6], np.array([0.3, 0.1, 0.05])
    rows = [free_beam.mesh.degree(point) for point in POINTS]
    shapes = free_beam.shapes[np.ix_(rows, [3, 4, 5])].T.astype(complex)
    spread = np.array([1e-2, 1e-3, 2e-2, 2e-3, 3e-2, 1e-3])
    covariance = np.outer(spread, spread) * (0.6 * np.eye(6) + 0.4)

    def at(change: Real) -> Real:
        poles = poles_from(frequency + change[::2], loss + change[1::2])
        found = elastic_modes(Modes(poles, shapes, POINTS, covariance), free_beam, suspension=suspension)
        return np.stack([found.frequency, found.damping_ratio], axis=1).ravel()

    jacobian = np.stack([(at(1e-5 * unit) - at(-1e-5 * unit)) / 2e-5 for unit in np.eye(6)], axis=1)
    expected = jacobian @ covariance @ jacobian.T
    modes = Modes(poles_from(frequency, loss), shapes, POINTS, covariance)
    found = elastic_modes(modes, free_beam, suspension=suspension).covariance
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found / np.outer(scale, scale), expected / np.outer(scale, scale), atol=2e-3)


def test_what_is_not_known_of_the_suspension_widens_the_errors(free_beam: FreeBeam) -> None:
    modes = measured(free_beam, free_beam.frequency[3:6], DAMPING[:3], [3, 4, 5])
    known, unsure, somewhere = (
        elastic_modes(modes, free_beam, suspension=suspension)
        for suspension in (
            BeamSuspension(6.0, positions=(0.0,)),
            BeamSuspension(6.0, standard_error=0.5, positions=(0.0,)),
            BeamSuspension(6.0),
        )
    )
    raised = known.suspension_shift
    np.testing.assert_allclose(raised, 4 * 36 / (2 * free_beam.frequency[3:6]), rtol=0.1)
    variance = np.diag(unsure.frequency_covariance) - np.diag(known.frequency_covariance)
    np.testing.assert_allclose(np.sqrt(variance), 2 * 0.5 / 6.0 * raised, rtol=2e-3)
    correlation = unsure.frequency_covariance[0, 1] / np.sqrt(np.prod(np.diag(unsure.frequency_covariance)[:2]))
    assert correlation > 0.9  # one frequency moves all modes
    assert np.all(np.diag(somewhere.frequency_covariance) > np.diag(known.frequency_covariance))
    assert np.all(np.abs(somewhere.suspension_shift - raised) < 4 * np.sqrt(np.diag(somewhere.frequency_covariance)))


def test_modes_without_covariance_are_refused(free_beam: FreeBeam) -> None:
    modes = replace(measured(free_beam, free_beam.frequency[3:6], DAMPING[:3], [3, 4, 5]), pole_covariance=None)
    with pytest.raises(AnalysisError, match="have no covariance"):
        elastic_modes(modes, free_beam)


def test_a_bar_of_other_dimensions_is_refused_with_both_sets_of_frequencies(free_beam: FreeBeam) -> None:
    modes = measured(free_beam, 1.3 * free_beam.frequency[3:5], DAMPING[:2], [3, 4])
    with pytest.raises(AnalysisError, match=r"none of the modes at \[208\.0\d, 570\.\d+\] Hz .* \[160\.\d, 438\.\d"):
        elastic_modes(modes, free_beam)


def test_a_suspension_above_the_limit_is_refused(free_beam: FreeBeam) -> None:
    modes = measured(free_beam, free_beam.frequency[3:5], DAMPING[:2], [3, 4])
    with pytest.raises(AnalysisError, match="bounces at 30 Hz, not below the limit of 20 Hz"):
        elastic_modes(modes, free_beam, lowest_frequency=20.0, suspension=BeamSuspension(30.0))


BEAM = Beam(0.914, 0.0254, 0.0508, 207e9, 0.3, 7850.0)
POSITIONS = np.array([0.0, 0.1, 0.205, 0.457, 0.709, 0.814, 0.914])
BENDING = (3, 4, 5)


@pytest.fixture(scope="module")
def held_beam() -> FreeBeam:
    return assemble(BEAM, Mesh.through(POSITIONS, 6), damping_ratios=(0.004, 0.001, 0.001))


@settings(max_examples=10, deadline=None)
@given(
    frequency=st.floats(1.0, 12.0),
    loss_factor=st.floats(0.0, 0.3),
    nodes=st.sampled_from([(1, 7), (2, 6), (3, 5), (2, 5)]),
)
def test_springs_at_known_places_raise_elastic_modes_as_rayleigh_says(
    held_beam: FreeBeam, frequency: float, loss_factor: float, nodes: tuple[int, int]
) -> None:
    kilograms = BEAM.density * BEAM.area * BEAM.length
    spring = kilograms * (2 * np.pi * frequency) ** 2 / 2 * (1 + 1j * loss_factor)
    springs = [Joint(str(node), node, np.diag([1.0, spring, 0])) for node in nodes]
    hanging = eigensolution(held_beam, springs, 1024.0, [Dof.parse("1y")])
    poles = hanging.poles[-3:]
    measured, ratios = np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)
    free, own = held_beam.frequency[list(BENDING)], np.array([0.004, 0.001, 0.001])

    suspension = BeamSuspension(frequency, positions=tuple(POSITIONS[node - 1] for node in nodes))
    part = participation(suspension, held_beam, BENDING)
    added = frequency**2 * part.mean
    left_out = (frequency / free) ** 2
    lossy = loss_factor * own * left_out  # two kinds of damping in one mode
    assert np.all(np.abs(np.sqrt(free**2 + added) / measured - 1) < 8 * left_out**2 + 2 * lossy)
    expected = own * free / measured + loss_factor * added / (2 * measured**2)
    assert np.all(np.abs(expected / ratios - 1) < (0.1 + 6 * loss_factor) * left_out)
    assert np.all(part.deviation == 0)


def test_a_spring_at_the_end_of_a_slender_bar_takes_part_fourfold_and_at_a_node_not_at_all() -> None:
    slender = assemble(Beam(1.0, 0.001, 0.01, 207e9, 0.3, 7850.0), Mesh.through(np.linspace(0, 1, 11)))
    at_end = participation(BeamSuspension(1.0, positions=(0.0,)), slender, BENDING)
    np.testing.assert_allclose(at_end.mean, 4, rtol=1e-4)
    at_node = participation(BeamSuspension(1.0, positions=(0.22416, 1 - 0.22416)), slender, (3,))
    assert at_node.mean[0] < 1e-6


def test_springs_at_unknown_places_have_a_participation_of_one_on_average(held_beam: FreeBeam) -> None:
    unknown = participation(BeamSuspension(3.0), held_beam, BENDING)
    np.testing.assert_allclose(unknown.mean, 1, rtol=0.02)  # rotary inertia takes a little
    everywhere = np.linspace(0, BEAM.length, 400)
    each = [participation(BeamSuspension(3.0, positions=(place,)), held_beam, BENDING).mean for place in everywhere]
    np.testing.assert_allclose(unknown.deviation, np.std(each, axis=0), rtol=0.02)
    assert np.all(np.max(np.abs(each - unknown.mean), axis=0) < 4 * unknown.deviation)


def test_a_point_mass_hangs_in_the_springs_as_well() -> None:
    mesh = Mesh.through(POSITIONS)
    masses = {3: 0.5}
    loaded = assemble(BEAM, mesh, point_masses=masses)
    across = loaded.shapes[mesh.degree(Dof.parse("1y")), 3]
    found = participation(BeamSuspension(3.0, positions=(0.0,)), loaded, (3,)).mean[0]
    assert found == pytest.approx((BEAM.density * BEAM.area * BEAM.length + 0.5) * across**2, rel=1e-9)


def test_a_spring_beside_the_bar_is_refused(held_beam: FreeBeam) -> None:
    with pytest.raises(AnalysisError, match=r"no spring can be at \[1\.2\] m; the beam reaches from 0\.0 to 0\.914 m"):
        participation(BeamSuspension(3.0, positions=(0.1, 1.2)), held_beam, BENDING)


@pytest.mark.parametrize("frequency", [0.0, -1.0, float("nan")])
def test_a_suspension_without_a_frequency_is_refused(frequency: float) -> None:
    with pytest.raises(AnalysisError, match="the suspension's frequency is"):
        BeamSuspension(frequency)


def test_a_suspension_of_negative_loss_or_error_is_refused() -> None:
    with pytest.raises(AnalysisError, match=r"loss_factor is -0\.1"):
        BeamSuspension(3.0, loss_factor=-0.1)
    with pytest.raises(AnalysisError, match="standard_error is -1"):
        BeamSuspension(3.0, standard_error=-1)
