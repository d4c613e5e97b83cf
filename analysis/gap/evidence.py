"""How well models explain: Laplace's approximation of the evidence.

log Z = -(chi-square + z^t z) / 2 - log |I + J^t P J| / 2, with unknown scores z of unit prior variance.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from analysis.gap.fit import Fit


def log_evidence(found: Fit) -> float:
    """Of a fitted model, up to a constant that all models of the same data share.

    A parameter that cannot lie below a bound has half a Gaussian for its prior: what the other half would have
    explained is taken off, and the prior of the remaining half doubled.
    """
    _, logarithm = np.linalg.slogdet(found.at.normal)
    total = -found.at.cost / 2 - logarithm / 2
    for place, parameter in enumerate(found.likelihood.simulation.shared):
        if np.isfinite(parameter.least):
            least = (parameter.least - parameter.centre) / parameter.spread
            deviation = found.deviations[place]
            above = norm.logcdf((found.scores[place] - least) / deviation)
            total += float(above - norm.logcdf(-least))
    return float(total)
