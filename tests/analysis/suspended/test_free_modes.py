from __future__ import annotations

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
from analysis.suspended.free_modes import elastic_modes
from analysis.suspended.suspension import Suspension

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
    np.testing.assert_allclose(found.assurance, 1)


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


@pytest.mark.parametrize("suspension", [None, Suspension(9.0, loss_factor=0.2, positions=(0.1, 0.8))])
def test_the_covariance_follows_the_poles_to_first_order(free_beam: FreeBeam, suspension: Suspension | None) -> None:
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
            Suspension(6.0, positions=(0.0,)),
            Suspension(6.0, standard_error=0.5, positions=(0.0,)),
            Suspension(6.0),
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
        elastic_modes(modes, free_beam, lowest_frequency=20.0, suspension=Suspension(30.0))
