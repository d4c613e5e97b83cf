"""Where one more pole would explain the most of what a fit has left.

Every pole of a grid of frequencies and loss factors is tried with all other poles held (a score test: C. R. Rao,
Proc. Cambridge Phil. Soc. 44, 1948): its column is made orthogonal to the columns of the fit, and its constants are
solved for, row by row.
"""

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.modal.modal_model import modal_basis
from analysis.modal.modal_refinement import ModalData, ModalFit
from analysis.modes import poles_from

_LOSS_FACTORS = (0.02, 0.05, 0.1, 0.2)
_APART = 1.0  # half bandwidths between neighbours of the grid
_OWN = 1e-3  # share of a column that has to be left beside those of the fit


def best_new_pole(data: ModalData, fit: ModalFit) -> complex | None:
    """Pole in rad/s that lowers chi-square the most, all others held; None where the fit has all of the grid."""
    grid = _grid(float(data.frequency[0]), float(data.frequency[-1]), float(data.frequency[1] - data.frequency[0]))
    if grid.size == 0:
        return None
    terms = fit.residual_terms.shape[0]
    fitted = modal_basis(data.frequency, fit.poles, terms, data.kind, data.decay).columns[:, ::2]
    tried = modal_basis(data.frequency, grid, 0, data.kind, data.decay).modes[..., 0]
    gain = np.zeros(grid.size)
    for measured, model, deviation in zip(data.accelerance, fit.accelerance, data.deviation, strict=True):
        known, _ = np.linalg.qr(fitted / deviation[:, None])
        columns = tried / deviation[:, None]
        whole = np.sum(np.abs(columns) ** 2, axis=0)
        columns = columns - known @ (known.conj().T @ columns)
        own = np.sum(np.abs(columns) ** 2, axis=0)
        explained = np.abs(columns.conj().T @ ((measured - model) / deviation)) ** 2
        gain += np.where(own > _OWN * whole, explained / np.maximum(own, np.finfo(float).tiny), 0.0)
    best = int(np.argmax(gain))
    return complex(grid[best]) if gain[best] > 0 else None


def _grid(lowest: float, highest: float, spacing: float) -> Complex:
    """Poles in rad/s, half a bandwidth apart; peaks of fewer lines than three are left to the chart."""
    poles = [np.empty(0, dtype=np.complex128)]
    for loss_factor in _LOSS_FACTORS:
        start = max(lowest, 3 * spacing / loss_factor)
        if start < highest:
            count = int(np.log(highest / start) / (_APART * loss_factor / 2)) + 2
            frequency: Real = np.geomspace(start, highest, count)
            poles.append(poles_from(frequency, np.full(count, loss_factor)))
    return np.concatenate(poles)
