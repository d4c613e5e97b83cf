"""Causal laws of frequency for the joints, with their derivatives, and the priors of their parameters.

A joint is stated at 100 Hz, where its k + i h is free. Elsewhere

    z(f) = z(100 Hz) g(f) / g(100 Hz),    g(f) = (i f)^a (1 + r t) / (1 + t),    t = (i f / f_r)^b,

which is a power of frequency for r = 1 and the fractional Zener model for a = 0 (T. Pritz, J. Sound and Vibration 195,
1996, 103-115). Stiffness and loss of g are tied by causality: it is analytic in i f and real for real i f. The
loss angle of z beyond that of g is the same at all frequencies, as in a constant joint. With a = 0 and r = 1 the joint
is exactly constant. All parameters are Gaussian about a constant joint, or about the middle of the band.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import expit

from analysis.frequency_response import Complex, Real
from analysis.inverse.frequency_law import FrequencyLaw

REFERENCE_FREQUENCY = 100.0  # Hz, at which the terms of joints that follow frequency are stated
LAW_PARAMETERS = ("exponent", "rise", "corner", "order")
"""a; ln r, of the stiffness far above the relaxation over that far below; ln f_r / 200 Hz; ln b / (1 - b)."""
CORNER = 200.0  # Hz
STEEPEST = 0.5 / (2 * (1 + np.cos(np.pi / 4)))
"""d^2 ln |g| / d ln f d ln r at f = f_r, r = 1 and b = 1/2."""
MOST_RISE = 2 * 0.5  # two standard deviations, to start a search from
FARTHEST = 5.0
"""Largest magnitude of a parameter; no law of an elastomer lies beyond it."""
PRIORS = {
    FrequencyLaw.AUTO: (0.0, 0.0, 0.0, 0.0),
    FrequencyLaw.CONSTANT: (0.0, 0.0, 0.0, 0.0),
    FrequencyLaw.POWER: (0.1, 0.0, 0.0, 0.0),
    FrequencyLaw.ZENER: (0.0, 0.5, 1.0, 0.7),
}
"""Standard deviations of the parameters; zero holds one. Rubber has exponents of 0.02 to 0.2, rises of 0.1 to 1 in the
band, and orders of 0.3 to 0.7. The search of a choice begins with constant joints."""


def law_of(active: Sequence[bool]) -> FrequencyLaw:
    """The law whose parameters, in the order of `LAW_PARAMETERS`, are free."""
    free = [bool(each) for each in active]
    return next(
        law
        for law in (FrequencyLaw.CONSTANT, FrequencyLaw.POWER, FrequencyLaw.ZENER)
        if free == list(map(bool, PRIORS[law]))
    )


def zener_like(exponents: Real) -> Real:
    """(4, joints) fractional Zener laws that rise about `CORNER` as these powers (joints,) do, to first order.

    A power that no elastomer has, as of a fit that is wrong for other reasons, gives a rise that one can have.
    """
    found = np.zeros((len(LAW_PARAMETERS), exponents.size))
    found[LAW_PARAMETERS.index("rise")] = np.clip(exponents / STEEPEST, -MOST_RISE, MOST_RISE)
    return found


def growth(parameters: Real, logarithm: Complex) -> Complex:
    """(joints, lines) z(f) / z(100 Hz).

    Args:
        parameters: (4, joints) in the order of `LAW_PARAMETERS`.
        logarithm: (lines,) ln of i f / (i 100 Hz); under an exponential window of the decay d, i f is d / 2 pi + i f.
    """
    exponent, rise, *_ = parameters
    t, t0 = (_relaxation(parameters, each)[0] for each in (logarithm, np.zeros(1)))
    more = np.expm1(rise)[:, None]
    above = np.log(1 + more * t / (1 + t)) - np.log(1 + more * t0 / (1 + t0))
    return np.asarray(np.exp(exponent[:, None] * logarithm + above))


def growth_slopes(parameters: Real, logarithm: Complex) -> Complex:
    """(4, joints, lines) derivatives of ln(z(f) / z(100 Hz)) in the parameters; arguments as of `growth`."""
    found = _slopes(parameters, logarithm) - _slopes(parameters, np.zeros(1))
    return np.asarray(found)


def _slopes(parameters: Real, logarithm: Complex | Real) -> Complex:
    t, over = _relaxation(parameters, logarithm)
    ratio, order = np.exp(parameters[1])[:, None], expit(parameters[3])[:, None]
    below = 1 + ratio * t
    by_logarithm = t * (ratio / below - 1 / (1 + t))
    exponent = np.broadcast_to(logarithm, t.shape)
    return np.array([exponent, ratio * t / below, -order * by_logarithm, order * (1 - order) * over * by_logarithm])


def _relaxation(parameters: Real, logarithm: Complex | Real) -> tuple[Complex, Complex]:
    """(joints, lines) t, and ln of i f / f_r."""
    _, _, corner, order = parameters
    over = logarithm + np.log(1j * REFERENCE_FREQUENCY / CORNER) - corner[:, None]
    return np.exp(expit(order)[:, None] * over), over
