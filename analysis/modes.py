"""Modes, estimated or predicted: complex poles and shapes. They assume no kind of damping."""

from dataclasses import dataclass

import numpy as np

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real


@dataclass(frozen=True)
class Modes:
    """Complex modes in the convention e^(+i w t), with lambda^2 = -w_r^2 (1 + i eta_r).

    Attributes:
        poles: (modes,) lambda_r in rad/s, positive imaginary part, sorted by frequency.
        shapes: (modes, dofs) complex shape components; the scale of each mode is free.
        dofs: (dofs,) of the columns of `shapes`.
        pole_covariance: (2 modes, 2 modes) covariance of [f_1, eta_1, f_2, eta_2, ...] in Hz and 1,
            or None where the modes are exact or the covariance is unknown.
        shape_covariance: (modes, 2 dofs, 2 dofs) covariance of [real, imaginary] of each shape, or None.
    """

    poles: Complex
    shapes: Complex
    dofs: tuple[Dof, ...]
    pole_covariance: Real | None = None
    shape_covariance: Real | None = None

    def __post_init__(self) -> None:
        if self.shapes.shape != (self.poles.size, len(self.dofs)):
            raise AnalysisError(
                f"shapes have shape {self.shapes.shape}, expected (modes, dofs) = {(self.poles.size, len(self.dofs))}"
            )

    @property
    def frequency(self) -> Real:
        """(modes,) natural frequency w_r / 2 pi in Hz."""
        return np.asarray(np.sqrt((-(self.poles**2)).real) / (2 * np.pi))

    @property
    def loss_factor(self) -> Real:
        """(modes,) modal loss factor eta_r, dimensionless; twice the viscous damping ratio where it is small."""
        square = -(self.poles**2)
        return np.asarray(square.imag / square.real)

    def at(self, dof: Dof) -> Complex:
        """(modes,) shape component at `dof`.

        Raises:
            AnalysisError: the shapes have no such component.
        """
        if dof not in self.dofs:
            raise AnalysisError(f"the shapes have no component {dof}; they have {', '.join(map(str, self.dofs))}")
        return np.asarray(self.shapes[:, self.dofs.index(dof)])


def poles_from(frequency: Real, loss_factor: Real) -> Complex:
    """Poles lambda = i w sqrt(1 + i eta) of frequencies in Hz and loss factors, both (modes,)."""
    return np.asarray(2j * np.pi * frequency * np.sqrt(1 + 1j * loss_factor))


def frequency_and_loss_factor_slope(poles: Complex) -> Real:
    """(2 modes, 2 modes) derivatives of [f_1, eta_1, f_2, ...] in Hz and 1 by [Re, Im, Re, ...] of `poles` in rad/s."""
    slope = np.zeros((2 * poles.size, 2 * poles.size))
    for mode, pole in enumerate(poles):
        square = -(pole**2)
        loss_factor = square.imag / square.real
        for part, by_part in enumerate((-2 * pole, -2j * pole)):
            column = 2 * mode + part
            slope[2 * mode, column] = by_part.real / (4 * np.pi * np.sqrt(square.real))
            slope[2 * mode + 1, column] = (by_part.imag - loss_factor * by_part.real) / square.real
    return slope
