"""The weighted regression for one joint's matrix, Eqs. (28)-(37), and its statistics, Section 7.

A joint matrix has 18 unknowns [k11, k12, ... k33, h11, ... h33]; symmetry leaves the 12 of `TERMS`.
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

UPPER = tuple(combinations_with_replacement(range(3), 2))
"""Places of the upper triangle, row by row: the order of the six stiffnesses and of the six dampings."""
TERMS = tuple(f"{letter}{p + 1}{q + 1}" for letter in "kh" for p, q in UPPER)
"""The twelve unknowns of a symmetric joint."""

NEGLIGIBLE = 1e-6  # a row so much smaller than the mode's largest is rounding: scaled to unity it would be all noise
RANK = 1e-10  # smallest singular value of the scaled columns, as a share of the largest


def symmetry() -> Real:
    """(18, 12) T_s of Eq. (36): from the upper triangles of k and h to all their terms, row by row."""
    half = np.zeros((9, 6))
    for column, (p, q) in enumerate(UPPER):
        half[[3 * p + q, 3 * q + p], column] = 1.0
    return np.asarray(np.kron(np.eye(2), half))


def equations(displacement: Complex, force: Complex) -> tuple[Real, Real]:
    """Y and its right side of Eq. (32), before weighting.

    Every mode gives Re and Im of conj(u_q) times the three equations f + (k + i h) u = 0, q = 1..3.

    Args:
        displacement: (modes, 3) u at the joint.
        force: (modes, 3) f = (Z psi) at the joint.

    Returns:
        Y (18 modes, 18) and right side (18 modes,), which is -[A', B'] of Eqs. (30), (31). The rows
        of a mode run over p, q for Eq. (28), then over p, q for Eq. (29).
    """
    modes = len(displacement)
    square = displacement.conj()[:, :, None] * displacement[:, None, :]  # q, then the column's index
    block = 2 * np.block([[square.real, -square.imag], [square.imag, square.real]]).reshape(modes, 2, 3, 2, 3)
    coefficients = np.zeros((modes, 2, 3, 3, 2, 3, 3))
    for p in range(3):
        coefficients[:, :, p, :, :, p, :] = block
    product = displacement.conj()[:, None, :] * force[:, :, None]  # p, q
    right = -2 * np.stack([product.real, product.imag], axis=1)
    return coefficients.reshape(18 * modes, 18), right.reshape(18 * modes)


def weights(coefficients: Real) -> Real:
    """(18 modes,) W of Eqs. (33)-(35) for Y (18 modes, 18): one over the greatest magnitude in each row.

    It is 0 for a row of rounding only.
    """
    greatest = np.max(np.abs(coefficients), axis=1)
    of_mode = np.repeat(np.max(greatest.reshape(-1, 18), axis=1), 18)
    kept = greatest > NEGLIGIBLE * of_mode
    return np.where(kept, 1 / np.where(kept, greatest, 1.0), 0.0)


@dataclass(frozen=True, eq=False)
class Regression:
    """The solution of Eq. (37) for one joint.

    Attributes:
        terms: (12,) in the order of `TERMS`, N/m, N, N m.
        covariance: (12, 12) (Yw^t Yw)^-1 s^2 of Section 7, in the squares of those units.
        observed: (rows,) Gamma_o of Fig. 5, the weighted right sides.
        fitted: (rows,) Gamma_c of Fig. 5.
        freedom: number of independent equations less the twelve terms. Equations (28), (29) repeat each complex
            equation of a mode three times, times conj(u_q) with q = 1..3, so there are 6 to a mode and not 18.
    """

    terms: Real
    covariance: Real
    observed: Real
    fitted: Real
    freedom: int

    @property
    def covariance_of_independent_equations(self) -> Real:
        """(12, 12) covariance that counts every equation once.

        Section 7 takes all 18 rows of a mode for independent; its intervals are too narrow by half with six modes.
        """
        return np.asarray(self.covariance * (self.observed.size - len(TERMS)) / self.freedom)


def solve(displacement: Complex, force: Complex) -> Regression:
    """Least squares for a symmetric joint matrix, Eq. (37), from the motion and force of `equations`.

    Raises:
        AnalysisError: the modes leave some of the twelve terms undetermined.
    """
    coefficients, right = equations(displacement, force)
    weight = weights(coefficients)
    used = weight > 0
    design = (weight[:, None] * coefficients @ symmetry())[used]
    observed = (weight * right)[used]

    scale = np.linalg.norm(design, axis=0)
    scale[scale == 0] = 1.0
    left, singular_values, right_vectors = np.linalg.svd(design / scale, full_matrices=False)
    rank = int(np.sum(singular_values > RANK * singular_values[0]))
    if rank < len(TERMS):
        raise AnalysisError(
            f"{len(displacement)} modes determine {rank} of the {len(TERMS)} terms of a joint matrix; give more modes"
        )
    inverse = right_vectors.T / singular_values / scale[:, None]  # of the design: inverse @ left.T
    terms = inverse @ (left.T @ observed)
    fitted = design @ terms
    residual = observed - fitted
    residual_variance = float(residual @ residual) / (observed.size - len(TERMS))
    return Regression(
        terms=terms,
        covariance=inverse @ inverse.T * residual_variance,
        observed=observed,
        fitted=fitted,
        freedom=6 * len(displacement) - len(TERMS),
    )


def condition_number(displacement: Complex) -> float:
    """Condition number of Yw, Eq. (45), of all 18 unknowns without Eq. (36), from (modes, 3) u at the joint."""
    coefficients, _ = equations(displacement, np.zeros_like(displacement))
    return float(np.linalg.cond(weights(coefficients)[:, None] * coefficients))
