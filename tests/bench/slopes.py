"""Slopes of series over time, with standard errors that allow for neighbouring values being alike."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Slope:
    """A straight line through a series.

    Attributes:
        value, error: of the slope and its standard error, in the unit of the series per hour.
    """

    value: float
    error: float


def slope_of(seconds: NDArray[np.float64], values: NDArray[np.float64]) -> Slope:
    """The slope of `values` at `seconds` by least squares; both of the same length, three at least.

    The standard error of independent residuals is widened by sqrt((1 + r) / (1 - r)), with their lag-one correlation r
    where that is positive (Santer et al., J. Geophys. Res. 105 (2000) 7337).

    Raises ValueError where there are less than three values.
    """
    if seconds.size < 3:
        raise ValueError(f"a slope with its error needs three values, there are {seconds.size}")
    hours = (seconds - seconds.mean()) / 3600.0
    spread = float(hours @ hours)
    value = float(hours @ values) / spread
    residuals = values - values.mean() - value * hours
    power = float(residuals @ residuals)
    together = float(residuals[1:] @ residuals[:-1]) / power if power > 0.0 else 0.0
    alike = min(max(together, 0.0), 0.99)
    error = np.sqrt(power / (seconds.size - 2) / spread * (1.0 + alike) / (1.0 - alike))
    return Slope(value, float(error))
