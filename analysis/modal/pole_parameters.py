"""Frequency and loss factor as functions of the pole."""

from __future__ import annotations

import numpy as np

from analysis.frequency_response import Complex, Real


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
