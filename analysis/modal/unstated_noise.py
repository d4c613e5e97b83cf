"""Modes and noise together, where the noise is not stated.

The noise of a row is a floor that may vary with frequency and a part proportional to the response
(`response_variance.variance_from_residual`). It is estimated in turn with the modes, so that both are the most likely
ones. Poles are added where one more explains the most (`best_new_pole`), as long as the likelihood, with the noise
estimated for each number of poles, pays for their parameters by Schwarz's criterion.

What a fit leaves may hang together from line to line, through leakage, a structure that changes, or curves that were
smoothed. Lines then count for fewer: the gain is divided by the power of the residual, in sums over the bandwidth of
the new mode, over that of independent lines. And the pole has to pay without the row that shows it best, as one row
alone may have been disturbed.
"""

import math
from dataclasses import replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.modal.modal_model import modal_basis
from analysis.modal.modal_refinement import ModalData, ModalFit, UnresolvedModesError, refine
from analysis.modal.mode_selection import distances, evidence_in_band, resolved, without_idle_modes
from analysis.modal.response_variance import levelled, variance_from_residual
from analysis.modes import poles_from

_ROUNDS = 3  # of noise and modes in turn
_MOST_POLES = 40
_REACH = 3.0  # bandwidths on either side of a mode
_ALIKE = 0.9  # modal assurance criterion
_OVERLAP = 2.5  # of the smaller half bandwidth, between two poles
_FEWEST_LINES = 3.0  # in the bandwidth of a mode that is added
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


def with_unstated_noise(data: ModalData, start: Complex, terms: int) -> tuple[ModalData, ModalFit]:
    """The noise, and the modes near `start` (modes,) with those that are missing there.

    Args:
        data: what is fitted, with a first estimate of the noise.
        start: poles in rad/s.
        terms: residual terms.

    Raises:
        AnalysisError: there is no mode.
    """
    data, fit = _settled(data, resolved(data, start, terms), _ROUNDS)
    fit = without_idle_modes(data, fit)
    while fit.poles.size < _MOST_POLES:
        pole = best_new_pole(data, fit)
        if pole is None:
            break
        try:
            richer_data, richer = _settled(data, refine(data, np.append(fit.poles, pole), terms), 1)
        except UnresolvedModesError:
            break
        new = int(np.argmin(np.abs(richer.poles - pole)))
        if _imitates(richer, new) or np.min(evidence_in_band(richer_data, richer)) < 1:
            break
        gain = _deviance(data, fit) - _deviance(richer_data, richer)
        without_best_row = np.sum(gain) - np.max(gain) * (gain.size > 1)
        if _is_narrow(richer_data, richer.poles[new]) or without_best_row < _price(richer_data, richer, new):
            break
        data, fit = richer_data, richer
    return _settled(data, fit, _ROUNDS)


def _imitates(fit: ModalFit, mode: int) -> bool:
    """Whether a mode overlaps another one of its shape: the two are one that is not quite as the model has it."""
    shape = fit.constants / np.linalg.norm(fit.constants, axis=1, keepdims=True)
    alike = np.abs(shape.conj() @ shape[mode]) ** 2 > _ALIKE
    return bool(np.any(alike & (distances(fit.poles)[mode] < _OVERLAP)))


def _is_narrow(data: ModalData, pole: complex) -> bool:
    """Whether a peak has too few lines to be distinguished from a disturbed one; the chart shows such poles."""
    return -pole.real / np.pi < _FEWEST_LINES * float(data.frequency[1] - data.frequency[0])


def _settled(data: ModalData, fit: ModalFit, rounds: int) -> tuple[ModalData, ModalFit]:
    """Noise and modes in turn."""
    for _ in range(rounds):
        variance = variance_from_residual(data.accelerance, fit.accelerance, data.frequency)
        data = replace(data, deviation=levelled(np.sqrt(variance)))
        fit = resolved(data, fit.poles, fit.residual_terms.shape[0])
    return data, fit


def _deviance(data: ModalData, fit: ModalFit) -> Real:
    """(rows,) deviance of each row: minus twice its log likelihood, apart from a constant."""
    square = np.abs((data.accelerance - fit.accelerance) / data.deviation) ** 2
    return np.asarray(np.sum(square + 4 * np.log(data.deviation), axis=1))


def _price(data: ModalData, fit: ModalFit, mode: int) -> float:
    """The amount by which one more mode has to lower the deviance."""
    parameters = 2 + 2 * len(fit.accelerance)
    return parameters * math.log(2 * fit.accelerance.size) * max(1.0, residual_correlation(data, fit, fit.poles[mode]))


def residual_correlation(data: ModalData, fit: ModalFit, pole: complex) -> float:
    """Power near a pole, rad/s, of the residual summed over its half bandwidth, over that of independent lines."""
    spacing = float(data.frequency[1] - data.frequency[0])
    half = min(max(1, round(float(-pole.real) / (2 * np.pi * spacing))), data.frequency.size)
    left = (data.accelerance - fit.accelerance) / data.deviation
    sums: Real = np.abs(_moving_sum(left, half)) ** 2 / (2 * half)
    near = np.abs(data.frequency[: sums.shape[1]] - float(pole.imag) / (2 * np.pi)) < 2 * _REACH * half * spacing
    return float(max(np.median(sums) / math.log(2), np.mean(sums[:, near]) if np.any(near) else 0.0))


def _moving_sum(values: Complex, lines: int) -> Complex:
    """(rows, lines) of `values` over as many neighbouring lines."""
    total = np.cumsum(np.pad(values, ((0, 0), (1, 0))), axis=1)
    return np.asarray(total[:, lines:] - total[:, :-lines])
