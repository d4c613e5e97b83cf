"""Whether C = alpha M + beta K describes measured damping ratios: zeta_r = alpha / (2 w_r) + beta w_r / 2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls
from scipy.special import chdtrc

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate

REJECTED = 0.01  # p-value of chi-square


@dataclass(frozen=True, eq=False)
class RayleighDamping:
    """The best alpha and beta, neither of them negative, and how well they do.

    Attributes:
        mass_factor: alpha, 1/s.
        stiffness_factor: beta, s; both with the standard errors that they have without the bound at nought.
        damping_ratio: (modes,) what they give.
        worst_share: largest difference from a measured damping ratio, as a share of that or, if larger, of its error.
        chi_square: weighted sum of squares left.
        degrees_of_freedom: of chi-square; nought for two modes, which any alpha and beta fit.
    """

    mass_factor: Estimate
    stiffness_factor: Estimate
    damping_ratio: Real
    worst_share: float
    chi_square: float
    degrees_of_freedom: int

    @property
    def describes(self) -> bool | None:
        """Whether what is left is within the errors, chi-square having a p-value of 0.01 or more; None if untested."""
        if self.degrees_of_freedom == 0:
            return None
        return bool(chdtrc(self.degrees_of_freedom, self.chi_square) >= REJECTED)

    @property
    def text(self) -> str:
        """The assessment in one sentence."""
        law = f"C = alpha M + beta K with alpha = {self.mass_factor.value:.3g} 1/s, beta = "
        law += f"{self.stiffness_factor.value:.3g} s"
        if self.describes is None:
            return f"{law} fits two modes whatever they are; a third would tell whether damping is of that kind"
        left = f"chi-square {self.chi_square:.3g} on {self.degrees_of_freedom}"
        if self.describes:
            return f"{law} describes the damping of the free bar: {left}"
        return (
            f"{law} does not describe the damping of the free bar: {left}, up to {self.worst_share:.0%} off; "
            "use the damping ratios mode by mode"
        )


def rayleigh_damping(angular_frequency: Real, damping_ratio: Real, covariance: Real) -> RayleighDamping:
    """Fit alpha and beta to damping ratios by weighted least squares.

    Args:
        angular_frequency: (modes,) w_r, rad/s.
        damping_ratio: (modes,) zeta_r.
        covariance: (modes, modes) of the damping ratios.

    Raises:
        AnalysisError: fewer than two modes.
    """
    if damping_ratio.size < 2:
        raise AnalysisError("one mode does not tell damping by mass from damping by stiffness; measure two or more")
    root = np.linalg.cholesky(covariance)
    law = np.stack([1 / (2 * angular_frequency), angular_frequency / 2], axis=1)
    columns, measured = np.linalg.solve(root, law), np.linalg.solve(root, damping_ratio)
    size = np.linalg.norm(columns, axis=0)
    factors, left = nnls(columns / size, measured)
    factors = factors / size
    errors = np.sqrt(np.diag(np.linalg.inv((columns / size).T @ (columns / size)))) / size
    fitted = law @ factors
    scale = np.maximum(np.abs(damping_ratio), np.sqrt(np.diag(covariance)))
    return RayleighDamping(
        mass_factor=Estimate(float(factors[0]), float(errors[0])),
        stiffness_factor=Estimate(float(factors[1]), float(errors[1])),
        damping_ratio=fitted,
        worst_share=float(np.max(np.abs(fitted - damping_ratio) / scale)),
        chi_square=float(left**2),
        degrees_of_freedom=damping_ratio.size - 2,
    )
