"""The response of a single degree of freedom to sines whose amplitude changes its properties.

Equivalent linearisation: the properties at the amplitude of the response give the response. The amplitude is the root
of |H(X)| F = X; where a response has folded over there are several, and the lowest is taken.
"""

from collections.abc import Callable

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

SPAN, TRIED = 100.0, 33
"""Factor above and below the amplitude of the linear response that is searched, and number of amplitudes tried."""
STEPS = 20
"""Largest number of steps of false position (Illinois); each leaves less than half of the wrong digits."""
EXACT = 1e-14
"""Relative error of an amplitude that is rounding alone."""


def steady_response(response: Callable[[Real], Complex], linear: Real) -> Complex:
    """(n,) responses whose amplitude agrees with the amplitude that they were computed with.

    Args:
        response: (any, n) responses as a function of amplitudes (any, n).
        linear: (n,) initial amplitudes.

    Raises:
        AnalysisError: no amplitude agrees within a factor of a hundred of the initial one.
    """

    def excess(logarithm: Real) -> Real:
        return np.asarray(np.log(np.abs(response(np.exp(logarithm)))) - logarithm)

    tried = np.log(np.geomspace(1 / SPAN, SPAN, TRIED)[:, None] * linear)
    found = excess(tried)
    beyond = found < 0  # the response is smaller than the amplitude that it was computed with
    if not np.all(np.any(beyond, axis=0)) or np.any(beyond[0]):
        raise AnalysisError("no amplitude of the response agrees with its own stiffness and damping")
    last = np.argmax(beyond, axis=0)
    (lower, upper), (above, below) = (
        [np.take_along_axis(of, (last - back)[None], axis=0)[0] for back in (1, 0)] for of in (tried, found)
    )
    side = np.zeros(linear.shape)
    for _ in range(STEPS):
        middle = lower + (upper - lower) * above / (above - below)
        there = excess(middle)
        short = there >= 0
        # an end that stays a second time counts half, or the other would creep
        former, side = side, np.where(short, 1.0, -1.0)
        share = np.where(side == former, 0.5, 1.0)
        above, below = np.where(short, there, share * above), np.where(short, share * below, there)
        lower, upper = np.where(short, middle, lower), np.where(short, upper, middle)
        if np.all(np.abs(there) < EXACT):
            break
    return response(np.exp(np.where(np.abs(above) < np.abs(below), lower, upper)))
