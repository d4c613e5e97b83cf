"""Student's intervals, and the degrees of freedom of a combination."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from analysis.frequency_response import Real

CONFIDENCE = 0.95
"""Share of true values that an interval holds, where nothing else is said."""
Z90, Z95 = (float(each) for each in ndtri([0.95, 0.975]))
"""Standard deviations to either end of a 90 % and of a 95 % interval of a normal distribution."""


def quantile(degrees_of_freedom: float | Real, confidence: float = CONFIDENCE) -> Real:
    """Of Student's distribution (normal at infinite degrees of freedom), for a two-sided interval."""
    return np.asarray(stdtrit(degrees_of_freedom, (1 + confidence) / 2))


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error.

    Attributes:
        value: in its own unit.
        standard_error: in the same unit.
        degrees_of_freedom: behind the standard error; infinite where it is known in advance.
    """

    value: float
    standard_error: float
    degrees_of_freedom: float = math.inf

    def half_width(self, confidence: float = CONFIDENCE) -> float:
        """Half of the two-sided interval."""
        return float(quantile(self.degrees_of_freedom, confidence)) * self.standard_error

    def interval(self, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """Lower and upper end of the two-sided interval."""
        half = self.half_width(confidence)
        return self.value - half, self.value + half

    def probability_below(self, limit: float) -> float:
        """Probability of values below `limit`, by Student's distribution about `value`; 0 or 1 where that is exact."""
        if self.standard_error == 0:
            return float(self.value < limit)
        return float(stdtr(self.degrees_of_freedom, (limit - self.value) / self.standard_error))


def combined_degrees_of_freedom(variances: Sequence[float], degrees_of_freedom: Sequence[float]) -> float:
    """Degrees of freedom of a sum of independent estimates, after Welch and Satterthwaite.

    F. E. Satterthwaite, Biometrics Bulletin 2, 1946, 110-114.

    Args:
        variances: what each contributes to the variance of the sum.
        degrees_of_freedom: behind each of them.
    """
    parts = np.square(variances) / np.asarray(degrees_of_freedom, dtype=np.float64)
    total = float(np.sum(parts))
    return float(np.sum(variances)) ** 2 / total if total > 0 else math.inf
