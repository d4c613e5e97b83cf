from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.inverse.covariance_propagation import ModalUncertainty, propagated_covariance
from analysis.inverse.identification import PAPER_DOFS
from analysis.inverse.joint_estimate import square
from analysis.inverse.observability import modal_bound
from analysis.inverse.regression import UPPER
from analysis.modes import Modes
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

Real = NDArray[np.float64]


def units(bench: Bench) -> Real:
    return np.tile([bench.free_beam.beam.stiffness_unit[place] for place in UPPER], 4)


def modes_of_terms(bench: Bench, terms: Real) -> Modes:
    joints = [
        Joint(joint.name, joint.node, square(part[:6]) + 1j * square(part[6:]))
        for joint, part in zip(bench.joints, terms.reshape(2, 12), strict=True)
    ]
    return eigensolution(bench.free_beam, joints, 1024.0, PAPER_DOFS)


@pytest.fixture(scope="module")
def terms(bench: Bench) -> Real:
    upper = [[joint.dynamic_stiffness[place] for place in UPPER] for joint in bench.joints]
    return np.concatenate([np.concatenate([np.real(z), np.imag(z)]) for z in upper])


@pytest.fixture(scope="module")
def exact(bench: Bench) -> Modes:
    return Modes(bench.modes.poles, np.stack([bench.modes.at(dof) for dof in PAPER_DOFS], axis=1), PAPER_DOFS)


def numerically(bench: Bench, exact: Modes, terms: Real, known: ModalUncertainty) -> Real:
    """The same bound with finite differences of whole eigensolutions, shapes fitted to the exact ones in scale."""
    unit = units(bench)
    columns = []
    for place in range(24):
        step = np.zeros(24)
        step[place] = unit[place] * (2e-4 if place % 6 in (0, 1, 3) else 1e-5)
        up, down = modes_of_terms(bench, terms + step), modes_of_terms(bench, terms - step)
        rows = [
            np.column_stack([up.frequency - down.frequency, up.loss_factor - down.loss_factor]).ravel()
            / np.sqrt(np.diag(known.pole))
        ]
        for mode, shape in enumerate(exact.shapes):
            size = np.sum(np.abs(shape) ** 2)
            change = up.shapes[mode] * size / (shape.conj() @ up.shapes[mode])
            change = change - down.shapes[mode] * size / (shape.conj() @ down.shapes[mode])
            rows.append(np.concatenate([change.real, change.imag]) / np.sqrt(known.shape[mode, 0, 0]))
        columns.append(np.concatenate(rows) / (2 * step[place] / unit[place]))
    design = np.array(columns).T
    return np.linalg.inv(design.T @ design) * np.outer(unit, unit)


def test_the_bound_agrees_with_finite_differences_of_whole_eigensolutions(
    bench: Bench, exact: Modes, terms: Real
) -> None:
    known = ModalUncertainty.nominal(exact, PAPER_DOFS)
    bound = modal_bound(bench.free_beam, bench.joints, exact, PAPER_DOFS, known)
    expected = numerically(bench, exact, terms, known)
    np.testing.assert_allclose(np.sqrt(np.diag(bound)), np.sqrt(np.diag(expected)), rtol=2e-3)


def test_the_bound_does_not_depend_on_the_scale_of_the_shapes(bench: Bench, exact: Modes) -> None:
    known = ModalUncertainty.nominal(exact, PAPER_DOFS)
    factor = 30.0 * np.exp(0.7j)
    scaled = Modes(exact.poles, factor * exact.shapes, PAPER_DOFS)
    bounds = [
        modal_bound(bench.free_beam, bench.joints, exact, PAPER_DOFS, known),
        modal_bound(bench.free_beam, bench.joints, scaled, PAPER_DOFS, ModalUncertainty.nominal(scaled, PAPER_DOFS)),
    ]
    np.testing.assert_allclose(np.sqrt(np.diag(bounds[1])), np.sqrt(np.diag(bounds[0])), rtol=1e-6)


def test_the_papers_procedure_stays_above_the_bound(bench: Bench, exact: Modes) -> None:
    known = ModalUncertainty.nominal(exact, PAPER_DOFS)
    bound = modal_bound(bench.free_beam, bench.joints, exact, PAPER_DOFS, known)
    reached = propagated_covariance(bench.free_beam, exact, (2, 10), PAPER_DOFS, False, known)
    scale = np.outer(units(bench), units(bench))
    assert np.linalg.eigvalsh((reached - bound) / scale)[0] > -1e-6 * np.max(reached / scale)
    assert np.all(np.diag(reached)[[0, 1, 12, 13]] > np.diag(bound)[[0, 1, 12, 13]])


def test_a_component_of_no_variance_fixes_the_scale_and_adds_nothing_else(bench: Bench, exact: Modes) -> None:
    """Shapes normalised to one of their components carry a covariance that is singular."""
    known = ModalUncertainty.nominal(exact, PAPER_DOFS)
    fixed = known.shape.copy()
    fixed[:, [2, 8]] = fixed[:, :, [2, 8]] = 0.0
    singular = modal_bound(bench.free_beam, bench.joints, exact, PAPER_DOFS, ModalUncertainty(known.pole, fixed))
    plain = modal_bound(bench.free_beam, bench.joints, exact, PAPER_DOFS, known)
    ratio = np.sqrt(np.diag(singular) / np.diag(plain))
    assert np.all(ratio < 1.0 + 1e-6)
    assert np.all(ratio > 0.3)
