"""What a measured point weighs in a least squares fit."""

from __future__ import annotations

import numpy as np

from analysis.direct import DynamicStiffness
from analysis.frequency_response import Real

ROUNDING = 1e-9  # of a point's magnitude; an exact point would weigh infinitely
FEWEST_DEGREES = 4.0  # of freedom; below, the expected square is infinite and a point weighs as if it had these


def whitening(point: DynamicStiffness) -> Real:
    """(2, 2) W, N/m to 1, so that W [k, h] of repeats has unit covariance.

    A covariance from few blocks is too small as often as too large, and a square over it is larger in the mean than
    over the true one: nu / (nu - 3) times for two components (Hotelling's T^2). It is taken larger by that.
    """
    freedom = max(point.degrees_of_freedom, FEWEST_DEGREES)
    student = 1.0 if np.isinf(freedom) else freedom / (freedom - 3)
    covariance = student * point.covariance + (ROUNDING * point.magnitude) ** 2 * np.eye(2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
