"""Which modes and how many residual terms the data pay for.

A mode has two parameters for its pole and two for each row's modal constant. It is kept if it lowers chi-square by
more than the logarithm of the number of data for each of them (G. Schwarz, Annals of Statistics 6, 1978): a mode that
is not there must not be reported. A residual term has two parameters for each row and is wanted if it lowers chi-square
by more than two for each (H. Akaike, IEEE Trans. Automatic Control 19, 1974); the first that is not wanted is added
too. One too many costs half a per cent of every standard deviation, while what one too few leaves, hidden in noise,
biases loss factors by a sixth of theirs. Both prices rise with the noise scale, so that what no mode can explain does
not call for more modes.

Two poles closer than a quarter of their half bandwidth are one mode that moved between the blows at different points,
with temperature or load: one of them is dropped, and what it explained stays in the noise scale. Where there is next
to no noise such a pair has no best fit, as the two close in on each other: it is merged.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.modal.modal_model import LARGEST_LOSS_FACTOR
from analysis.modal.modal_refinement import ModalData, ModalFit, UnresolvedModesError, fit_constants, refine
from analysis.modes import frequency_and_loss_factor_slope, poles_from

_MOST_TERMS = 12
_SUSPICIOUS = 6.0  # standard deviations of the mean chi-square of a run of lines
_RUNS = (5, 15, 45, 135)  # lines
_TWINS = 0.25  # of the smaller half bandwidth, between two poles
_MERGED = 1.0  # of the same, where the two have no best fit
_TRIAL_LOSS_FACTORS = (0.002, 0.01, 0.04, 0.1, 0.2)


def noise_scale(fit: ModalFit) -> float:
    """Chi-square per degree of freedom, but not below one."""
    rows, lines = fit.accelerance.shape
    parameters = 2 * fit.poles.size + 2 * rows * (fit.poles.size + fit.residual_terms.shape[0])
    return max(1.0, float(fit.chi_square / (2 * rows * lines - parameters)))


def resolved(data: ModalData, start: Complex, terms: int) -> ModalFit:
    """Maximum-likelihood poles near `start` (modes,), fewer where the lines do not tell all of them apart.

    Where there is no best fit, the closest two are merged, or the pole that explains the least is dropped.

    Raises:
        UnresolvedModesError: not even one pole has a best fit.
    """
    while True:
        try:
            return refine(data, start, terms)
        except UnresolvedModesError as unresolved:
            if start.size == 1:
                raise
            distance = distances(start)
            if np.min(distance) <= _MERGED or unresolved.reached is None:
                closest = np.unravel_index(np.argmin(distance), distance.shape)
                merged = np.mean(start[list(closest)])  # half-way
                start = np.append(np.delete(start, closest), merged)
            else:
                start = np.delete(unresolved.reached.poles, _least(unresolved.reached))


def _least(fit: ModalFit) -> int:
    """The mode whose loss factor has run up to the bound, or else that explains the least."""
    return int(np.argmin(np.where(_at_bound(fit), 0.0, evidence(fit))))


def _at_bound(fit: ModalFit) -> NDArray[np.bool_]:
    """(modes,) whether a loss factor, within its uncertainty, is as large as any that is taken for a mode."""
    slope = frequency_and_loss_factor_slope(fit.poles)[1::2]
    spread = np.sqrt(np.einsum("mi,ij,mj->m", slope, noise_scale(fit) * fit.pole_covariance, slope))
    square = -(fit.poles**2)
    return np.asarray(square.imag / square.real + 2 * spread > LARGEST_LOSS_FACTOR)


def distances(poles: Complex) -> Real:
    """(modes, modes) between poles, in units of the smaller half bandwidth; infinite from a pole to itself."""
    half_bandwidth = -poles.real
    distance = np.abs(poles[:, None] - poles) / np.minimum(half_bandwidth[:, None], half_bandwidth)
    np.fill_diagonal(distance, np.inf)
    return np.asarray(distance)


def evidence(fit: ModalFit) -> Real:
    """(modes,) chi-square that would be lost without each mode, by Wald's approximation, over its price."""
    modes = fit.poles.size
    stacked = np.concatenate([fit.constants.real, fit.constants.imag], axis=1)
    covariance = fit.constants_covariance
    lost = [stacked[mode] @ np.linalg.solve(covariance[mode], stacked[mode]) for mode in range(modes)]
    return np.asarray(lost) / _price(fit, 1)


def without_idle_modes(data: ModalData, fit: ModalFit) -> ModalFit:
    """Drop, one at a time, modes that have left the band or reached the bound of damping, do not pay, or are the weaker
    of twins.

    Raises:
        AnalysisError: no mode is left.
    """
    while True:
        worth = evidence_in_band(data, fit)
        weakest = int(np.argmin(worth))
        if worth[weakest] > 1:
            return fit
        if fit.poles.size == 1:
            raise AnalysisError(
                f"no mode stands out from the noise between {data.frequency[0]:g} and {data.frequency[-1]:g} Hz"
            )
        fit = resolved(data, np.delete(fit.poles, weakest), fit.residual_terms.shape[0])


def evidence_in_band(data: ModalData, fit: ModalFit) -> Real:
    """(modes,) `evidence`, and 0 for a pole that is no mode of this band; a mode is kept if it has more than 1."""
    frequency = np.sqrt(-(fit.poles**2).real) / (2 * np.pi)
    outside = (frequency < data.frequency[0]) | (frequency > data.frequency[-1])
    return np.where(outside | _weaker_twins(fit) | _at_bound(fit), 0.0, evidence(fit))


def _weaker_twins(fit: ModalFit) -> NDArray[np.bool_]:
    """(modes,) whether a mode has a stronger one too close to be another."""
    strength = np.linalg.norm(fit.constants, axis=1)
    return np.asarray(np.any((distances(fit.poles) < _TWINS) & (strength[:, None] < strength), axis=1))


def extended(data: ModalData, fit: ModalFit, most_poles: int) -> ModalFit:
    """Add residual terms, and poles where chi-square is suspicious, as long as they pay.

    Args:
        data: what is fitted.
        fit: the fit to start from, with few residual terms.
        most_poles: how many poles may be added. Data that no modal model fits would ask for ever more.
    """
    complete = _with_enough_terms(data, fit)
    suspect = _suspicious_frequency(data, complete)
    if suspect is None:
        return complete
    # many residual terms imitate a missed mode: poles are added beside the few terms of the start
    for _ in range(most_poles):
        richer = None if suspect is None else _with_a_pole(data, fit, suspect)
        if richer is None or fit.chi_square - richer.chi_square < _price(richer, 1):
            break
        fit = richer
        suspect = _suspicious_frequency(data, fit)
    fit = _with_enough_terms(data, fit)
    added = fit.poles.size - complete.poles.size
    return fit if complete.chi_square - fit.chi_square > _price(fit, added) else complete


def _with_enough_terms(data: ModalData, fit: ModalFit) -> ModalFit:
    while fit.residual_terms.shape[0] < _MOST_TERMS:
        try:
            richer = refine(data, fit.poles, fit.residual_terms.shape[0] + 1)
        except UnresolvedModesError:
            return fit  # the terms imitate a mode
        if fit.chi_square - richer.chi_square < 2 * 2 * fit.accelerance.shape[0] * noise_scale(richer):
            return richer
        fit = richer
    return fit


def _with_a_pole(data: ModalData, fit: ModalFit, frequency: float) -> ModalFit | None:
    """The fit with one more pole near `frequency` in Hz, or None where that pole makes no mode."""
    terms = fit.residual_terms.shape[0]
    starts = poles_from(np.full(len(_TRIAL_LOSS_FACTORS), frequency), np.array(_TRIAL_LOSS_FACTORS))
    trials = []
    for start in starts:
        try:
            trials.append(fit_constants(data, np.append(fit.poles, start), terms))
        except np.linalg.LinAlgError:
            continue  # it coincides with a pole that is there already
    if not trials:
        return None
    try:
        richer = refine(data, min(trials, key=lambda trial: trial.chi_square).poles, terms)
    except AnalysisError:
        return None  # it wandered off: nothing there looks like a mode
    return richer if np.all(evidence(richer) > 1) and not np.any(_weaker_twins(richer)) else None


def _price(fit: ModalFit, modes: int) -> float:
    """Chi-square that `modes` have to explain."""
    parameters = modes * (2 + 2 * len(fit.accelerance))
    return parameters * math.log(2 * fit.accelerance.size) * noise_scale(fit)


def _suspicious_frequency(data: ModalData, fit: ModalFit) -> float | None:
    """Middle in Hz of the run of lines whose mean chi-square is the least credible, or None where all are credible."""
    rows = fit.accelerance.shape[0]
    excess = chi_square_per_line(data, fit) / noise_scale(fit) - 1
    worst, where = _SUSPICIOUS, None
    for run in _RUNS:
        score = uniform_filter1d(excess, run, mode="nearest") * np.sqrt(run * rows)
        if score.max() > worst:
            worst, where = float(score.max()), float(data.frequency[int(np.argmax(score))])
    return where


def chi_square_per_line(data: ModalData, fit: ModalFit) -> Real:
    """(lines,) mean over rows of squared deviations over their variance."""
    square = np.abs(data.accelerance - fit.accelerance) ** 2 / data.deviation**2
    return np.asarray(np.mean(square, axis=0) / 2)
