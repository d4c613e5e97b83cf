"""Least-squares complex frequency-domain estimator of poles, for every model order up to a highest.

Accelerances are fitted by fractions of polynomials in z = exp(i w dt), with one denominator for all rows
(P. Guillaume, P. Verboven, S. Vanlanduit, H. Van der Auweraer, B. Peeters, "A poly-reference implementation of
the least-squares complex frequency-domain estimator", IMAC XXI, 2003). The denominator has square matrix
coefficients, a row and a column for each fixed sensor. With one accelerometer and a roving hammer reciprocity makes
the blows the rows and the accelerometer the one reference, so the coefficients are numbers and the poles of order
n are the n roots of one polynomial: orders up to 60 take milliseconds.

Linear least squares weighs the equation and not the measurement, so its damping is biased by up to some per cent.
The poles are for choosing a model (`analysis.stabilisation`) and for starting `analysis.modal_refinement`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real


@dataclass(frozen=True)
class OrderPoles:
    """The stable poles of one model order.

    Attributes:
        order: degree of the denominator.
        poles: (n,) in rad/s, positive imaginary part, negative real part, sorted by frequency.
    """

    order: int
    poles: Complex


def lscf_poles(frequency: Real, response: Complex, weight: Real, highest_order: int = 60) -> tuple[OrderPoles, ...]:
    """Poles of every order from 1 to `highest_order`.

    Args:
        frequency: (lines,) in Hz, rising; spacing need not be even.
        response: (rows, lines) or (rows, references, lines) frequency responses of any unit.
        weight: (rows, lines) weight of each line, one over its standard deviation.
        highest_order: degree of the largest denominator.

    Raises:
        AnalysisError: too few lines for the order.
    """
    block = response[:, None, :] if response.ndim == 2 else response
    rows, references, lines = block.shape
    if 2 * rows * lines <= (highest_order + 1) * (rows + references):
        raise AnalysisError(f"{lines} lines in {rows} rows are too few for order {highest_order}; lower the order")
    step = 1 / (2 * frequency[-1])
    normal = _reduced_normal_matrix(frequency * step, block, weight, highest_order)
    poles = []
    for order in range(1, highest_order + 1):
        size = (order + 1) * references
        poles.append(OrderPoles(order, _stable_poles(_denominator(normal[:size, :size], references), step)))
    return tuple(poles)


def _reduced_normal_matrix(cycles: Real, block: Complex, weight: Real, order: int) -> Real:
    """Normal equations of the denominator, numerators eliminated: ((order + 1) references,) square, power by power.

    Every block is Toeplitz in the powers of z because |z| = 1, so only its lags are summed over the lines.
    """
    rows, references, _ = block.shape
    size = order + 1
    phase = np.exp(2j * np.pi * np.outer(cycles, np.arange(-order, order + 1)))
    toeplitz = order + np.arange(size)[None, :] - np.arange(size)[:, None]
    square = weight**2
    normal = np.zeros((size * references, size * references))
    for row in range(rows):
        numerator = (square[row] @ phase).real[toeplitz]
        mixed = ((square[row] * block[row]) @ phase).real[:, toeplitz]
        mixed = np.moveaxis(mixed, 0, 2).reshape(size, size * references)
        products = square[row] * block[row].conj()[:, None] * block[row][None, :]
        own = (products @ phase).real[:, :, toeplitz]
        own = own.transpose(2, 0, 3, 1).reshape(size * references, size * references)
        normal += own - mixed.T @ np.linalg.lstsq(numerator, mixed, rcond=None)[0]
    return normal


def _denominator(normal: Real, references: int) -> Real:
    """Least-squares coefficients (order + 1, references, references), that of the lowest power the identity.

    Fixing the lowest power makes poles that only fit noise unstable, which tells them from those of the structure
    (B. Cauberghe, P. Guillaume, P. Verboven, S. Vanlanduit, E. Parloo, "On the influence of the parameter constraint
    on the stability of the poles and the discrimination capabilities of the stabilisation diagrams", MSSP 19, 2005).
    """
    free = np.linalg.lstsq(normal[references:, references:], -normal[references:, :references], rcond=None)[0]
    return np.concatenate([np.eye(references), free]).reshape(-1, references, references)


def _stable_poles(denominator: Real, step: float) -> Complex:
    """Decaying poles of positive frequency of a matrix polynomial in z, lowest power first."""
    order, references = denominator.shape[0] - 1, denominator.shape[1]
    companion = np.eye(order * references, k=references)
    companion[:, :references] = -denominator[1:].transpose(0, 2, 1).reshape(order * references, references)
    inverse = np.linalg.eigvals(companion).astype(complex)  # of z: the lowest power's coefficient is the identity
    poles = -np.log(inverse[inverse.imag < 0]) / step
    poles = poles[poles.real < 0]
    return np.asarray(poles[np.argsort(poles.imag)])
