from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.inverse import regression
from analysis.inverse.covariance_propagation import ModalUncertainty, propagated_covariance, sensitivity
from analysis.inverse.expansion import joint_motion
from analysis.inverse.identification import PAPER_DOFS
from analysis.inverse.longitudinal_averaging import averaged
from analysis.modes import Modes, poles_from

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

Real = NDArray[np.float64]
NODES = (2, 10)


def scattered(bench: Bench, dofs: tuple[Dof, ...], size: float = 0.01) -> Modes:
    """Modes as measured: the identification's residuals are not zero."""
    rng = np.random.default_rng(3)
    exact = np.stack([bench.modes.at(dof) for dof in dofs], axis=1)
    return Modes(bench.modes.poles, exact * (1 + size * rng.standard_normal(exact.shape)), dofs)


def data_of(modes: Modes) -> Real:
    """(modes, 2 + 2 dofs) frequency, loss factor, real parts, imaginary parts."""
    return np.column_stack([modes.frequency, modes.loss_factor, modes.shapes.real, modes.shapes.imag])


def terms_from(bench: Bench, data: Real, dofs: tuple[Dof, ...], average: bool) -> Real:
    """(24,) identified terms of both joints, along the plain way."""
    real, imaginary = np.split(data[:, 2:], 2, axis=1)
    shapes = real + 1j * imaginary
    motion = joint_motion(
        bench.free_beam,
        poles_from(data[:, 0], data[:, 1]),
        averaged(shapes, dofs) if average else shapes,
        dofs,
        NODES,
    )
    solved = [regression.solve(motion.displacement[:, joint], motion.force[:, joint]) for joint in range(2)]
    return np.concatenate([solution.terms for solution in solved])


@pytest.mark.parametrize("average", [False, True])
@pytest.mark.parametrize("count", [6, 11])
def test_sensitivities_agree_with_finite_differences(bench: Bench, count: int, average: bool) -> None:
    dofs = PAPER_DOFS if count == 6 else bench.inputs
    modes = scattered(bench, dofs)
    analytic = sensitivity(bench.free_beam, modes, NODES, dofs, average)
    data = data_of(modes)
    numeric = np.empty_like(analytic)
    for place in np.ndindex(data.shape):
        step = np.zeros_like(data)
        step[place] = 3e-6 * max(abs(float(data[place])), 0.01)
        change = terms_from(bench, data + step, dofs, average) - terms_from(bench, data - step, dofs, average)
        numeric[:, *place] = change / (2 * step[place])
    largest = np.max(np.abs(numeric), axis=(1, 2), keepdims=True)
    assert np.max(np.abs(analytic - numeric) / largest) < 3e-5


def test_propagated_covariance_is_what_repeated_measurements_scatter(bench: Bench) -> None:
    rng = np.random.default_rng(11)
    exact = Modes(bench.modes.poles, np.stack([bench.modes.at(dof) for dof in PAPER_DOFS], axis=1), PAPER_DOFS)
    known = ModalUncertainty.nominal(exact, PAPER_DOFS, frequency=2e-5, loss_factor=5e-5, shape=2e-4)
    predicted = propagated_covariance(bench.free_beam, exact, NODES, PAPER_DOFS, False, known)
    data = data_of(exact)
    deviation = np.concatenate(
        [np.sqrt(np.diag(known.pole)).reshape(6, 2), np.sqrt(np.diagonal(known.shape, axis1=1, axis2=2))], axis=1
    )
    runs = np.array(
        [terms_from(bench, data + deviation * rng.standard_normal(data.shape), PAPER_DOFS, False) for _ in range(600)]
    )
    np.testing.assert_allclose(np.std(runs, axis=0) / np.sqrt(np.diag(predicted)), 1.0, atol=0.12)
    correlation = np.corrcoef(runs.T)[0, 12]
    assert correlation == pytest.approx(predicted[0, 12] / np.sqrt(predicted[0, 0] * predicted[12, 12]), abs=0.01)


def test_modes_without_covariance_have_nothing_to_propagate(bench: Bench) -> None:
    with pytest.raises(AnalysisError, match="no covariance"):
        propagated_covariance(bench.free_beam, bench.modes, NODES, PAPER_DOFS, True)


def test_uncertainty_is_picked_for_the_components_that_are_used(bench: Bench) -> None:
    size = 2 * len(bench.inputs)
    covariance = np.arange(size * size, dtype=float).reshape(size, size)
    modes = Modes(
        bench.modes.poles, bench.modes.shapes, bench.inputs, np.eye(12), np.tile(covariance + covariance.T, (6, 1, 1))
    )
    known = ModalUncertainty.of(modes, PAPER_DOFS)
    assert known is not None
    first, last = bench.inputs.index(PAPER_DOFS[0]), bench.inputs.index(PAPER_DOFS[-1])
    assert known.shape[0, 0, -1] == (covariance + covariance.T)[first, last + len(bench.inputs)]
