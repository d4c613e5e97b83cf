"""A straight line through results over time."""

from collections.abc import Sequence

import numpy as np

from analysis.interval import Estimate

FEWEST = 3
"""Results that a line and its scatter need."""


def change(time: Sequence[float], value: Sequence[float]) -> Estimate | None:
    """The change from the first to the last time by the line of least squares, as a share of the mean value.

    Its standard error is from the scatter about the line, which holds what differs between runs, such as mounting and
    temperature. (N. R. Draper, H. Smith, Applied Regression Analysis, 3rd ed., 1998, section 1.4.)

    Args:
        time: in any unit.
        value: at each time.

    Returns:
        The share, or None where there are fewer than three results, all at one time, or their mean is 0.
    """
    t, y = np.asarray(time, dtype=np.float64), np.asarray(value, dtype=np.float64)
    if t.size < FEWEST or np.ptp(t) == 0 or y.mean() == 0:
        return None
    away = t - t.mean()
    squares, freedom = float(away @ away), t.size - 2
    slope = float(away @ y) / squares
    scatter = y - y.mean() - slope * away
    error = float(np.sqrt(scatter @ scatter / freedom / squares))
    share = float(np.ptp(t) / abs(y.mean()))
    return Estimate(share * slope, share * error, freedom)
