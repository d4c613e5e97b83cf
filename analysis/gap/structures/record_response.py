"""The response of a single degree of freedom with a cubic spring to a recorded force.

Solved for the whole record at once in the frequency domain, where damping may be structural: by damped Newton steps,
each the solution of a linear system by GMRES, after division by the linear part with the mean stiffness of the cubic
spring. Rest before the record is assumed.
"""

from collections.abc import Callable

import numpy as np
from scipy.fft import next_fast_len
from scipy.sparse.linalg import LinearOperator, gmres

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

FINER = 2
"""Multiple of the sample rate at which the cubic force is computed, as it has three times the bandwidth."""
REST = 0.25
"""Share by which the record is lengthened with zeros, so that the response decays."""
AGREED = 1e-4
"""Length of a Newton step, over the size of the response, below which it is the last one."""
EXACT, MOST_PRODUCTS = 1e-2, 80
"""Relative error of a step, and the largest number of matrix products in the linear system for it."""
MOST_STEPS, LEAST_SHARE = 20, 1 / 64
"""Largest number of Newton steps, and the least share of one; a step is halved until the error falls."""


def record_response(stiffness: Callable[[Real], Complex], cubic: float, force: Real, sample_rate: float) -> Real:
    """(n,) displacement under a force record.

    Args:
        stiffness: dynamic stiffness (lines,), N/m, with mass and damping, as a function of frequencies (lines,), Hz.
        cubic: k3 of the force k3 x^3, N/m^3.
        force: (n,) N.
        sample_rate: Hz.

    Raises:
        AnalysisError: the steps do not settle, as for a spring that folds the response over.
    """
    count = force.size
    long = 2 * next_fast_len((count + int(REST * count)) // 2)
    linear = stiffness(np.asarray(np.fft.rfftfreq(long, 1 / sample_rate), dtype=float))
    applied = np.fft.irfft(np.fft.rfft(force, long) / linear, long)
    if not cubic:
        return applied[:count]

    def fine(response: Real) -> Real:
        return np.asarray(FINER * np.fft.irfft(np.fft.rfft(response), FINER * long))

    def under(forces: Real, softer: Complex) -> Real:
        """Displacement by forces at the finer rate."""
        return np.fft.irfft(np.fft.rfft(forces)[: linear.size] / FINER / softer, long)

    response = np.zeros(long)
    for _ in range(MOST_STEPS):
        tangent = 3 * cubic * fine(response) ** 2
        mean = float(np.mean(tangent[: FINER * count]))

        def off(at: Real, softer: Complex = linear + mean) -> Real:
            missing = applied - at - under(cubic * fine(at) ** 3, linear)
            return np.fft.irfft(np.fft.rfft(missing) * linear / softer, long)

        def slope(step: Real, tangent: Real = tangent, mean: float = mean) -> Real:
            return np.asarray(step + under((tangent - mean) * fine(step), linear + mean))

        before = off(response)
        step, _ = gmres(LinearOperator((long, long), slope, dtype=float), before, rtol=EXACT, restart=MOST_PRODUCTS,
                        maxiter=1)  # fmt: skip
        share, size = 1.0, np.linalg.norm(before)
        while share > LEAST_SHARE and not np.linalg.norm(off(response + share * step)) < (1 - share / 4) * size:
            share /= 2
        response = response + share * step
        if np.linalg.norm(step) <= AGREED * np.linalg.norm(response):
            return np.asarray(response[:count])
        if share <= LEAST_SHARE:
            break
    raise AnalysisError("the response to the record does not settle: the cubic spring is too strong")
