"""Covariance of modes from the scatter of single blows, which is correlated between lines.

A blow a millimetre beside its mark, or harder than the others, changes the accelerance at all lines together. Noise
that is independent from line to line averages out over a fit of two thousand lines; this does not, and intervals that
count on it are too narrow by a factor of three to twenty. So every blow's share in the average is followed through the
fit, to first order, and the squares of what it does are added up: the covariance of White's sandwich with the blows
for clusters (H. White, Econometrica 48, 1980; K.-Y. Liang, S. L. Zeger, Biometrika 73, 1986). It needs no model of the
blows and includes the noise, which scatters from blow to blow like everything else.

Some modes depend on the blows at few points, and ten blows give their scatter to within 25 % only. So the poles come
with the degrees of freedom of the blows that their variance comes from, for Student's intervals.

Errors that all blows at a point share, such as a mark in the wrong place, do not show in this scatter.
"""

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real, blows_behind
from analysis.interval import combined_degrees_of_freedom
from analysis.modal.modal_model import modal_basis
from analysis.modal.modal_refinement import ModalData, ModalFit, stacked


@dataclass(frozen=True)
class ModalScatter:
    """Changes of the modes by single blows.

    Attributes:
        pole_changes: (rows, blows, 2 modes) by each blow, of [Re, Im, Re, Im, ...] of the poles in 1/s.
        constants_covariance: (modes, 2 rows, 2 rows) of [real parts, imaginary parts] of the constants of each mode, in
            1/kg^2.
        blows: (rows,) struck at each point.
    """

    pole_changes: Real
    constants_covariance: Real
    blows: Real

    def covariance(self, slope: Real) -> Real:
        """(quantities, quantities) of what has `slope` (quantities, 2 modes) to the poles."""
        changes = self.pole_changes.reshape(-1, slope.shape[1]) @ slope.T
        return np.asarray(changes.T @ changes)

    def degrees_of_freedom(self, slope: Real) -> Real:
        """(quantities,) behind the variances of what has `slope` (quantities, 2 modes) to the poles."""
        of_rows = np.sum((self.pole_changes @ slope.T) ** 2, axis=1)
        freedom = (self.blows - 1).tolist()
        return np.array([combined_degrees_of_freedom(parts, freedom) for parts in of_rows.T.tolist()])


def modal_scatter(data: ModalData, fit: ModalFit, scatter: Complex) -> ModalScatter:
    """Follow the share of each blow in the average through the fit.

    Args:
        data: what was fitted.
        fit: the best fit to it.
        scatter: (rows, blows, lines) how far each blow moves the average of its row; zero for blows that it lacks.
    """
    modes, rows = fit.constants.shape
    poles, constants = _changes(data, fit, scatter)
    constants = constants.reshape(-1, rows, modes, 2).transpose(2, 0, 3, 1).reshape(modes, -1, 2 * rows)
    return ModalScatter(
        pole_changes=poles.reshape(*scatter.shape[:2], 2 * modes),
        constants_covariance=constants.transpose(0, 2, 1) @ constants,
        blows=blows_behind(scatter),
    )


def _changes(data: ModalData, fit: ModalFit, scatter: Complex) -> tuple[Real, Real]:
    """Changes of poles (rows blows, 2 modes) and constants (rows blows, rows, 2 modes) by each blow alone."""
    modes, rows = fit.constants.shape
    blows = scatter.shape[1]
    basis = modal_basis(data.frequency, fit.poles, len(fit.residual_terms), data.kind, data.decay)
    columns = stacked(basis.columns)
    parts = np.stack([fit.constants.real, fit.constants.imag], axis=-1)
    gradients = np.empty((rows, blows, 2 * modes))
    held = np.zeros((rows, blows, rows, 2 * modes))  # constants, were the poles known
    for row in range(rows):
        weight = np.tile(1 / data.deviation[row], 2)
        moved = np.concatenate([scatter[row].real, scatter[row].imag], axis=1) * weight
        weighted = columns * weight[:, None]
        linear = moved @ weighted @ fit.linear_covariance[row]
        slope = stacked(basis.slope(parts[:, row]))
        gradients[row] = (moved - linear @ weighted.T) @ (slope * weight[:, None])
        held[row, :, row] = linear[:, : 2 * modes]
    poles = gradients.reshape(-1, 2 * modes) @ fit.pole_covariance
    by_poles = np.einsum("rcp,bp->brc", fit.sensitivity[:, : 2 * modes], poles)
    return poles, held.reshape(by_poles.shape) + by_poles
