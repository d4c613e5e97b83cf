"""The law of frequency that joints follow, chosen by evidence.

The evidence of a law is the likelihood, averaged over the priors of its parameters (Laplace's approximation; D. J. C.
MacKay, Neural Computation 4, 1992). Its parameters cost what the data narrow their priors by, so that constant joints
win where they explain the data as well. Where single blows are known, lines are not independent, and chi-square falls
the more by chance; its fall then counts less in proportion (R. E. Chandler, S. Bate, Biometrika 94, 2007).
"""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from analysis.frequency_response import Real
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.frequency_laws import LAW_PARAMETERS, PRIORS
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.tolerances import places_of_law
from analysis.inverse.validity_checks import MISFIT

LOG_ODDS = float(np.log(0.25 / 0.5))
"""Prior log odds of a power, or of a fractional Zener law, to constant joints: that joints follow frequency is as
probable as not, and both laws are equally probable."""


RISING = ("exponent", "rise")
"""Parameters that are not negative: stiffness of what stores and loses energy does not fall with frequency. With a
mass at the joint it seems to."""
FALLING = 3.0
"""Standard errors below zero of such a parameter that are no longer noise."""


def may_follow(constant: JointFit) -> bool:
    """Whether a power of frequency of some joints would have the better odds, to first order."""
    prior = PRIORS[FrequencyLaw.POWER][0]
    powers = [cause for cause in constant.causes if cause.is_law_of_joint and cause.gain > 0]
    each = [cause.gain / 2 + np.log(abs(cause.value) / np.sqrt(cause.gain) / prior) for cause in powers]
    return bool(LOG_ODDS + sum(max(0.0, odds) for odds in each) > 0)


def log_odds(constant: JointFit, rival: JointFit) -> float:
    """Logarithm of the odds of joints that follow a law against constant ones, fitted to the same data and noise."""
    at = _law_places(rival, LAW_PARAMETERS)
    room = (_log_determinant(rival.noise_covariance[np.ix_(at, at)]) - _log_determinant(_prior(rival, at))) / 2
    return LOG_ODDS + _gain(constant, rival) / min(constant.noise_scale, rival.noise_scale) / 2 + room


def is_the_reason(constant: JointFit, rival: JointFit) -> bool:
    """Whether a law with better odds is the reason why constant joints do not fit.

    It is not the reason if the stiffness falls with frequency, if the law leaves more than noise, or if another cause
    that is missing with constant joints explains more, such as a mass at a joint.
    """
    rising = _law_places(rival, RISING)
    above = rival.values[rising] / np.sqrt(np.diag(rival.noise_covariance)[rising])
    other = max((cause.gain for cause in constant.causes if not cause.grows), default=0.0)
    fits = float(np.mean(rival.chi_square_per_row)) <= MISFIT
    return fits and bool(np.min(above) >= -FALLING) and _gain(constant, rival) >= other


def _gain(constant: JointFit, rival: JointFit) -> float:
    """Fall of chi-square, over what it falls by chance where lines are independent."""
    at = np.ix_(*2 * [_law_places(rival, LAW_PARAMETERS)])
    by_blows = float(eigh(rival.noise_covariance[at], rival.independent_covariance[at], eigvals_only=True)[-1])
    return (_chi_square(constant) - _chi_square(rival)) / max(1.0, by_blows)


def _law_places(fit: JointFit, parameters: Collection[str]) -> NDArray[np.intp]:
    """Numbers of these parameters of all joints, where they are free."""
    places = [place for each in parameters for place in places_of_law(each, len(fit.joints))]
    return np.array([fit.likelihood.numbers[place] for place in places if place in fit.likelihood.numbers])


def _chi_square(fit: JointFit) -> float:
    return fit.likelihood.at(fit.values).cost


def _prior(fit: JointFit, at: NDArray[np.intp]) -> Real:
    of_bench = at - len(fit.likelihood.parameters.labels)
    return fit.likelihood.active_tolerance[np.ix_(of_bench, of_bench)]


def _log_determinant(covariance: Real) -> float:
    return float(np.linalg.slogdet(covariance)[1])
