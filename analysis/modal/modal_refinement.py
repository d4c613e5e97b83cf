"""Maximum-likelihood refinement of poles, modal constants and residual terms on all accelerances together.

The modal constants and residual terms of a row enter linearly and are eliminated (variable projection, G. Golub and
V. Pereyra, SIAM J. Numer. Anal. 10, 1973), so Levenberg and Marquardt's iteration, with analytic derivatives, runs
over the poles alone. For independent Gaussian noise of known variance the sum of squares is the negative
log-likelihood, and the inverse of the full normal matrix is the covariance, equal to the Cramer-Rao bound.
"""

from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.modal.modal_model import LARGEST_LOSS_FACTOR, DampingKind, modal_basis

_CONVERGED = 1e-6  # of the chi-square of one residual, still to be gained: a thousandth of a standard deviation
_MOST_STEPS = 60
_NO_STEP_HELPS = 1e10  # damping at which steps have shrunk below rounding


class UnresolvedModesError(AnalysisError):
    """The lines do not tell the modes apart.

    Attributes:
        reached: the fit where the search ended, or None where there was none to start from.
    """

    def __init__(self, message: str, reached: "ModalFit | None" = None) -> None:
        super().__init__(message)
        self.reached = reached


@dataclass(frozen=True)
class ModalData:
    """The data of a fit.

    Attributes:
        frequency: (lines,) in Hz.
        accelerance: (rows, lines) in (m/s^2)/N.
        deviation: (rows, lines) standard deviation of the real and of the imaginary part, same unit.
        kind: where the mirror poles sit.
        decay: decay of the exponential window of the records, 1/s.
    """

    frequency: Real
    accelerance: Complex
    deviation: Real
    kind: DampingKind = DampingKind.STRUCTURAL
    decay: float = 0.0


@dataclass(frozen=True)
class ModalFit:
    """The best fit for given poles, and what the likelihood says about the poles around it.

    Attributes:
        poles: (modes,) in rad/s.
        constants: (modes, rows) complex modal constants A, in 1/kg.
        residual_terms: (terms, rows) complex coefficients of the residual terms, in (m/s^2)/N.
        accelerance: (rows, lines) the fitted accelerance, in (m/s^2)/N.
        chi_square: sum over all lines of squared deviations in units of their standard deviation.
        row_information: (rows, 2 modes, 2 modes) what each row adds to `information`.
        row_gradients: (rows, 2 modes) minus half the slope of each row's chi-square by the same, in s.
        linear_covariance: (rows, n, n) of the linear coefficients were the poles known, n = 2 modes + 2 terms.
        sensitivity: (rows, n, 2 modes) of the linear coefficients to the poles.
    """

    poles: Complex
    constants: Complex
    residual_terms: Complex
    accelerance: Complex
    chi_square: float
    row_information: Real
    row_gradients: Real
    linear_covariance: Real
    sensitivity: Real

    @property
    def gradient(self) -> Real:
        """(2 modes,) minus half the slope of `chi_square` by the poles; zero at the best fit."""
        return np.asarray(np.sum(self.row_gradients, axis=0))

    @property
    def information(self) -> Real:
        """(2 modes, 2 modes) inverse covariance of [Re, Im, Re, Im, ...] of the poles, in s^2."""
        return np.asarray(np.sum(self.row_information, axis=0))

    @property
    def pole_covariance_between_rows(self) -> Real:
        """(2 modes, 2 modes) covariance of the poles by how they move when one row is left out, to first order.

        The jackknife (B. Efron, C. Stein, Annals of Statistics 9, 1981) needs no knowledge of the noise, which may
        hang together from line to line. Its rank is below the number of rows.
        """
        total, rows = self.information, self.row_gradients.shape[0]
        moved = np.array(
            [
                _inverse(total - own) @ gradient
                for own, gradient in zip(self.row_information, self.row_gradients, strict=True)
            ]
        )
        return np.asarray(moved.T @ moved * (rows - 1) / rows)

    @property
    def pole_covariance(self) -> Real:
        """(2 modes, 2 modes) covariance of [Re, Im, Re, Im, ...] of the poles, in 1/s^2."""
        return _inverse(self.information)

    @property
    def constants_covariance(self) -> Real:
        """(modes, 2 rows, 2 rows) covariance of [real parts, imaginary parts] of the constants of each mode."""
        modes, rows = self.constants.shape
        poles = self.pole_covariance
        covariance = np.empty((modes, 2 * rows, 2 * rows))
        for mode in range(modes):
            pair = slice(2 * mode, 2 * mode + 2)
            by_poles = self.sensitivity[:, pair].transpose(1, 0, 2).reshape(2 * rows, -1)
            covariance[mode] = by_poles @ poles @ by_poles.T
            own = self.linear_covariance[:, pair, pair]
            for first in range(2):
                for second in range(2):
                    block = covariance[mode, first * rows : (first + 1) * rows, second * rows : (second + 1) * rows]
                    block[np.diag_indices(rows)] += own[:, first, second]
        return covariance


def fit_constants(data: ModalData, poles: Complex, terms: int) -> ModalFit:
    """Weighted least squares for everything that is linear, the poles (modes,) held."""
    basis = modal_basis(data.frequency, poles, terms, data.kind, data.decay)
    modes = poles.size
    columns = stacked(basis.columns)
    rows, count = data.accelerance.shape[0], columns.shape[1]
    coefficients = np.empty((rows, count))
    covariance = np.empty((rows, count, count))
    sensitivity = np.empty((rows, count, 2 * modes))
    row_information = np.empty((rows, 2 * modes, 2 * modes))
    row_gradients = np.empty((rows, 2 * modes))
    chi_square = 0.0
    for row in range(rows):
        weight = np.tile(1 / data.deviation[row], 2)
        weighted = columns * weight[:, None]
        measured = stacked(data.accelerance[row, :, None])[:, 0] * weight
        covariance[row] = _inverse(weighted.T @ weighted)
        coefficients[row] = covariance[row] @ (weighted.T @ measured)
        residual = measured - weighted @ coefficients[row]
        # one round of iterative refinement: normal equations square the condition of near-repeated modes
        correction = covariance[row] @ (weighted.T @ residual)
        coefficients[row] += correction
        residual -= weighted @ correction
        constants = coefficients[row, : 2 * modes].reshape(modes, 2)
        slope = stacked(basis.slope(constants)) * weight[:, None]
        mixed = weighted.T @ slope
        sensitivity[row] = -covariance[row] @ mixed
        row_information[row] = slope.T @ slope + mixed.T @ sensitivity[row]
        row_gradients[row] = slope.T @ residual
        chi_square += float(residual @ residual)
    pairs = coefficients.reshape(rows, -1, 2)
    linear = (pairs[..., 0] + 1j * pairs[..., 1]).T
    return ModalFit(
        poles=poles,
        constants=linear[:modes],
        residual_terms=linear[modes:],
        accelerance=coefficients @ basis.columns.T,
        chi_square=chi_square,
        row_information=row_information,
        row_gradients=row_gradients,
        linear_covariance=covariance,
        sensitivity=sensitivity,
    )


def refine(data: ModalData, start: Complex, terms: int) -> ModalFit:
    """Maximum-likelihood poles near `start` (modes,), with everything that is linear.

    Raises:
        UnresolvedModesError: no convergence, as when two starting poles coincide or one fits nothing in the data.
    """
    try:
        return _iterated(data, fit_constants(data, start, terms))
    except np.linalg.LinAlgError as singular:
        raise UnresolvedModesError(
            f"two of the {start.size} modes to start from cannot be distinguished in these lines; give a narrower band"
        ) from singular


def _iterated(data: ModalData, fit: ModalFit) -> ModalFit:
    terms, damping = fit.residual_terms.shape[0], 1e-4
    for _ in range(_MOST_STEPS):
        information, gradient = fit.information, fit.gradient
        noise = max(1.0, fit.chi_square / (2 * fit.accelerance.size))
        if gradient @ _inverse(information) @ gradient < _CONVERGED * noise:
            return fit
        curvature = np.diag(np.diag(information))
        while True:
            step = _inverse(information + damping * curvature) @ gradient
            trial = _fit_if_possible(data, fit.poles + step[0::2] + 1j * step[1::2], terms)
            if trial is not None and trial.chi_square <= fit.chi_square:
                break
            damping *= 10
            if damping > _NO_STEP_HELPS:
                return fit  # at the limit of floating point
        fit, damping = trial, damping / 10
    raise UnresolvedModesError(
        f"the modal fit did not converge in {_MOST_STEPS} steps from {fit.poles.size} modes; give a narrower band", fit
    )


def _fit_if_possible(data: ModalData, poles: Complex, terms: int) -> ModalFit | None:
    """The fit, or None where a pole grows instead of decaying, has no resonance, or coincides with another."""
    square = -(poles**2)
    if np.any(poles.real >= 0) or np.any(poles.imag <= 0) or np.any(square.imag > LARGEST_LOSS_FACTOR * square.real):
        return None
    try:
        return fit_constants(data, poles, terms)
    except np.linalg.LinAlgError:
        return None


def stacked(columns: Complex) -> Real:
    """Real parts above imaginary parts: (lines, n) -> (2 lines, n)."""
    return np.concatenate([columns.real, columns.imag])


def _inverse(matrix: Real) -> Real:
    """Inverse of a symmetric positive matrix whose rows may have any units; LinAlgError where it is not positive."""
    diagonal = np.diag(matrix)
    if not np.all(diagonal > 0):
        raise np.linalg.LinAlgError("matrix is not positive definite")
    scale = 1 / np.sqrt(diagonal)
    factor = np.linalg.inv(np.linalg.cholesky(matrix * scale * scale[:, None])) * scale
    return np.asarray(factor.T @ factor)
