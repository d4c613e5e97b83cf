"""Least-squares complex frequency-domain estimator of poles, for every model order up to a highest.

Accelerances are fitted by fractions of polynomials in z = exp(i w dt), with one denominator for all rows
(P. Guillaume, P. Verboven, S. Vanlanduit, H. Van der Auweraer, B. Peeters, "A poly-reference implementation of
the least-squares complex frequency-domain estimator", IMAC XXI, 2003). The denominator has square matrix
coefficients, a row and a column for each fixed sensor. With one accelerometer and a roving hammer reciprocity makes
the blows the rows and the accelerometer the one reference, so the coefficients are numbers and the poles of order
n are the n roots of one polynomial: orders up to 60 take milliseconds.

Linear least squares weighs the equation and not the measurement, so its damping is biased by up to some per cent.
The poles are for choosing a model (`stabilisation`) and for starting `modal_refinement`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dgeev

from analysis.errors import AnalysisError, NoModeError
from analysis.frequency_response import Complex, Real

LEAST_ORDER = 10
"""Highest order below which columns of the stabilisation chart are too short to tell a mode from noise."""


@dataclass(frozen=True)
class OrderPoles:
    """The stable poles of one model order.

    Attributes:
        order: degree of the denominator.
        poles: (n,) in rad/s, positive imaginary part, negative real part, sorted by frequency.
    """

    order: int
    poles: Complex


def lscf_poles(frequency: Real, response: Complex, highest_order: int = 60) -> tuple[OrderPoles, ...]:
    """Poles of every order from 1 to `highest_order`, or to the highest that has fewer unknowns than there are data.

    Args:
        frequency: (lines,) in Hz, rising; spacing need not be even.
        response: (rows, lines) or (rows, references, lines) frequency responses of any unit.
        highest_order: degree of the largest denominator.

    Raises:
        NoModeError: there are lines for orders below `LEAST_ORDER` only.
    """
    block = response[:, None, :] if response.ndim == 2 else response
    rows, references, lines = block.shape
    possible = -(-2 * rows * lines // (rows + references)) - 2
    if possible < min(highest_order, LEAST_ORDER):
        raise NoModeError(
            f"{lines} lines in {rows} rows are too few to find modes: they determine poles up to order "
            f"{max(possible, 0)}, and {LEAST_ORDER} is the least; measure more lines, or strike more points"
        )
    step, order = 1 / (2 * frequency[-1]), min(highest_order, possible)
    denominators = _denominators(_reduced_normal_matrix(frequency * step, block, order), references)
    return tuple(OrderPoles(order, _stable_poles(one, step)) for order, one in enumerate(denominators, start=1))


def _reduced_normal_matrix(cycles: Real, block: Complex, order: int) -> Real:
    """Normal equations of the denominator, numerators eliminated: ((order + 1) references,) square, power by power.

    Every block is Toeplitz in the powers of z because |z| = 1, so only its lags are summed over the lines.
    """
    _, references, lines = block.shape
    size = order + 1
    powers = np.vander(np.exp(2j * np.pi * cycles), size, increasing=True)
    parts = np.ascontiguousarray(powers.real), np.ascontiguousarray(powers.imag)
    toeplitz = order + np.arange(size)[None, :] - np.arange(size)[:, None]
    numerator = _lags(np.ones(lines), parts)[toeplitz]  # the same for every row
    mixed = _lags(block, parts)[..., toeplitz].transpose(2, 0, 3, 1)
    own = _lags(np.einsum("ril,rjl->ijl", block.conj(), block), parts)[..., toeplitz].transpose(2, 0, 3, 1)
    coupling = mixed.reshape(size, -1)
    solved = np.linalg.pinv(numerator, rcond=size * np.finfo(float).eps, hermitian=True) @ coupling
    by_row = (-1, size * references)
    normal = own.reshape(by_row) - coupling.reshape(by_row).T @ solved.reshape(by_row)
    return np.asarray(normal)


def _lags(values: Complex | Real, powers: tuple[Real, Real]) -> Real:
    """Real parts (..., 2 order + 1) of the sums over lines of values (..., lines) times z^-order to z^order.

    `powers` are the real and the imaginary parts (lines, order + 1) of z^0 to z^order.
    """
    flat = values.reshape(-1, values.shape[-1])  # one product of matrices is faster than one for each row
    even, odd = flat.real @ powers[0], flat.imag @ powers[1]
    lags = np.concatenate([(even + odd)[:, :0:-1], even - odd], axis=1)
    return lags.reshape(*values.shape[:-1], -1)


def _denominators(normal: Real, references: int) -> list[Real]:
    """Least-squares coefficients (order + 1, references, references) of every order, that of the lowest power 1.

    Fixing the lowest power makes poles that only fit noise unstable, which tells them from those of the structure
    (B. Cauberghe, P. Guillaume, P. Verboven, S. Vanlanduit, E. Parloo, "On the influence of the parameter constraint
    on the stability of the poles and the discrimination capabilities of the stabilisation diagrams", MSSP 19, 2005).
    The equations of an order are the leading ones of the highest, and so is the Cholesky factor.
    """
    square, right = normal[references:, references:], -normal[references:, :references]
    sizes = range(references, len(square) + 1, references)
    try:
        factor = np.linalg.cholesky(square)
    except np.linalg.LinAlgError:  # data without noise have fewer poles than the highest order
        free = [np.linalg.lstsq(square[:n, :n], right[:n], rcond=None)[0] for n in sizes]
    else:
        half = solve_triangular(factor, right, lower=True)
        free = [solve_triangular(factor[:n, :n], half[:n], lower=True, trans="T") for n in sizes]
    unit = np.eye(references)
    return [np.concatenate([unit, coefficients]).reshape(-1, references, references) for coefficients in free]


def _stable_poles(denominator: Real, step: float) -> Complex:
    """Decaying poles of positive frequency of a matrix polynomial in z, lowest power first."""
    order, references = denominator.shape[0] - 1, denominator.shape[1]
    # LAPACK is quickest with the coefficients in the last columns, in Fortran's order; at this size its overhead counts
    companion = np.zeros((order * references, order * references), order="F")
    np.fill_diagonal(companion[references:], 1.0)
    companion[:, -references:] = -denominator[:0:-1].reshape(-1, references)
    real, imaginary, _, _, failed = dgeev(companion, compute_vl=0, compute_vr=0, overwrite_a=1)
    if failed:
        raise AnalysisError(f"the poles of order {order} were not found; lower the order")
    inverse = real + 1j * imaginary  # of z: the lowest power's coefficient is the identity
    poles = -np.log(inverse[inverse.imag < 0]) / step
    poles = poles[poles.real < 0]
    return np.asarray(poles[np.argsort(poles.imag)])
