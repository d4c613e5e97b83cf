"""What a measured point weighs in a least squares fit."""

from __future__ import annotations

import math

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.frequency_response import Real

ROUNDING = 1e-9  # of a point's magnitude; an exact point would weigh infinitely
FEWEST_DEGREES = 4.0  # of freedom; below, the expected square is infinite and a point weighs as if it had these


def own_covariance(point: DynamicStiffness) -> Real:
    """(2, 2) covariance of [k, h], (N/m)^2, without what the point shares with others."""
    shared = np.array([[error.real, error.imag] for error in point.shared_errors.values()]).reshape(-1, 2)
    return np.asarray(point.covariance - shared.T @ shared)


def error_covariance(point: DynamicStiffness) -> Real:
    """(2, 2) covariance of [k, h] to weigh a point by, (N/m)^2, without what it shares with others.

    A covariance from few blocks is too small as often as too large, and a square over it is larger in the mean than
    over the true one: nu / (nu - 3) times for two components (Hotelling's T^2). It is taken larger by that.
    """
    freedom = max(point.degrees_of_freedom, FEWEST_DEGREES)
    student = 1.0 if math.isinf(freedom) else freedom / (freedom - 3)
    return np.asarray(student * own_covariance(point) + (ROUNDING * point.magnitude) ** 2 * np.eye(2))


def whitening(point: DynamicStiffness) -> Real:
    """(2, 2) W, 1 over N/m, so that W [k, h] of repeats has unit covariance."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(error_covariance(point))))
