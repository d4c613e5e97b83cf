"""Frequency and loss factor as functions of the pole, and what an exponential window does to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.modes import Modes


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


def without_window(modes: Modes, decay: float) -> Modes:
    """Modes of the structure from modes of records that were multiplied by exp(-decay t), `decay` in 1/s.

    The window moves every pole left by `decay`. (`estimate_modes` with `window_decay` does the same within its fit.)

    Raises:
        AnalysisError: a mode would have no damping left.
    """
    poles = modes.poles + decay
    if np.any(poles.real >= 0):
        raise AnalysisError(
            f"an exponential window of {decay:g} 1/s adds more damping than mode {int(np.argmax(poles.real)) + 1} has; "
            "check the decay that was used"
        )
    if modes.pole_covariance is None:
        return replace(modes, poles=poles)
    change = frequency_and_loss_factor_slope(poles) @ np.linalg.inv(frequency_and_loss_factor_slope(modes.poles))
    return replace(modes, poles=poles, pole_covariance=change @ modes.pole_covariance @ change.T)
