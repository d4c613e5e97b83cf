"""The modal model of an accelerance: modes with complex poles, and residual terms for what lies out of band.

For a blow at j, at p = i w,

    H_j(p) = sum_r p^2 A_rj / (p^2 - lambda_r^2)  +  sum_k B_jk T_k(w^2)

With lambda_r^2 = -w_r^2 (1 + i eta_r) a mode is -w^2 A / (w_r^2 (1 + i eta_r) - w^2): structural damping exactly,
its mirror pole at -lambda. A viscously damped mode has its mirror pole at conj(lambda) instead,

    p^2 [R_rj / (p - lambda_r) + conj(R_rj) / (p - conj(lambda_r))],    R_rj = A_rj / (2 i Im lambda_r).

Both share lambda and the modal constant A, in 1/kg, which is real where all points move in phase. The residual terms
are Chebyshev polynomials in w^2, lowest first: T_0 is the mass line of modes below the band, the rest are the tails
of modes above it.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from analysis.frequency_response import Complex, Real

LARGEST_LOSS_FACTOR = 0.6
"""A pole damped beyond this has no peak that would tell it from a background: it is not taken for a mode."""


class DampingKind(StrEnum):
    """Where the mirror pole of a mode sits: at -lambda or at conj(lambda)."""

    STRUCTURAL = "structural"
    VISCOUS = "viscous"


@dataclass(frozen=True)
class ModalBasis:
    """Functions of frequency whose real multiples add up to an accelerance.

    Attributes:
        modes: (lines, modes, 2) response to a modal constant of 1 and of i.
        derivatives: (lines, modes, 2, 2) of `modes` by the real and the imaginary part of the pole.
        residuals: (lines, terms, 2) residual terms for a coefficient of 1 and of i.
    """

    modes: Complex
    derivatives: Complex
    residuals: Complex

    @property
    def columns(self) -> Complex:
        """(lines, 2 modes + 2 terms) all functions side by side, modes first."""
        lines = self.modes.shape[0]
        return np.concatenate([self.modes.reshape(lines, -1), self.residuals.reshape(lines, -1)], axis=1)

    def slope(self, constants: Real) -> Complex:
        """(lines, 2 modes) of a row's accelerance by [Re, Im, Re, ...] of the poles.

        Args:
            constants: (modes, 2) real and imaginary parts of the row's modal constants.
        """
        each = self.derivatives[:, :, 0] * constants[:, 0, None] + self.derivatives[:, :, 1] * constants[:, 1, None]
        return np.asarray(each.reshape(len(each), -1))


def modal_basis(frequency: Real, poles: Complex, terms: int, kind: DampingKind, decay: float = 0.0) -> ModalBasis:
    """The model's functions at `frequency` (lines,) in Hz for `poles` (modes,) in rad/s and `terms` residual terms.

    A record that was multiplied by exp(-decay t), in 1/s, has its response at p = decay + i w: the poles then are
    those of the structure without the window.
    """
    laplace: Complex = np.asarray(decay + 2j * np.pi * frequency)[:, None]
    functions = _structural if kind is DampingKind.STRUCTURAL else _viscous
    modes, derivatives = functions(laplace, poles)
    square = 2 * (frequency / frequency[-1]) ** 2 - 1
    chebyshev = np.polynomial.chebyshev.chebvander(square, terms - 1) if terms else np.empty((frequency.size, 0))
    return ModalBasis(modes, derivatives, np.stack([chebyshev, 1j * chebyshev], axis=-1))


def _structural(laplace: Complex, poles: Complex) -> tuple[Complex, Complex]:
    unit = laplace**2 / (laplace**2 - poles**2)
    slope = 2 * poles * unit / (laplace**2 - poles**2)
    modes = np.stack([unit, 1j * unit], axis=-1)
    return modes, np.stack([slope[..., None] * [1, 1j], slope[..., None] * [1j, -1]], axis=-2)


def _viscous(laplace: Complex, poles: Complex) -> tuple[Complex, Complex]:
    damped = poles.imag
    shifted = laplace - poles.real
    denominator = shifted**2 + damped**2
    in_phase = laplace**2 / denominator
    quadrature = in_phase * shifted / damped
    modes = np.stack([in_phase, quadrature], axis=-1)
    by_real = [2 * in_phase * shifted / denominator, in_phase * (2 * shifted**2 / denominator - 1) / damped]
    by_imaginary = [-2 * in_phase * damped / denominator, -quadrature * (1 / damped + 2 * damped / denominator)]
    return modes, np.stack([np.stack(by_real, axis=-1), np.stack(by_imaginary, axis=-1)], axis=-1)
