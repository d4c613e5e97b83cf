"""Which joint terms the data determine on their own, and of each other one why not, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.frequency_response import Real
from analysis.inverse.regression import TERMS

ENOUGH = 0.25  # half-width of the 95 % interval, as a share of the term
HALF_WIDTH = 1.96  # of the normal 95 % interval, in standard deviations
SUM_ONLY = 0.999  # correlation of two terms that are known in a sum or difference only
TOGETHER = 0.9  # correlation from which a weakly known term is said to go with another one
ALIKE = 0.1  # how far from one the weights of a sum may be that is written without them

Reasons = NDArray[np.str_]


def term_names(joint_names: Sequence[str]) -> list[str]:
    """(12 joints,) such as "k11(I)", in the order of `regression.TERMS` for each joint."""
    return [f"{term}({joint})" for joint in joint_names for term in TERMS]


def undetermined(bound: Real, values: Real, names: Sequence[str]) -> Reasons:
    """(terms,) why each term is not known on its own, to a quarter of its value; empty where it is.

    A term is known in a sum only where its correlation with another one leaves the two of them undetermined in one
    direction and forty times better known in the other. Better data do not change that, only another experiment does.

    Args:
        bound: (terms, terms) least covariance, the inverse of the Fisher information, as from `modal_bound`.
        values: (terms,).
        names: (terms,) as from `term_names`.
    """
    deviation = np.sqrt(np.diag(bound))
    correlation = bound / np.outer(deviation, deviation) - np.eye(len(bound))
    found = []
    for term, width in enumerate(widths(bound, values)):
        other = int(np.argmax(np.abs(correlation[term])))
        if abs(correlation[term, other]) >= SUM_ONLY:
            ratio = float(deviation[term] / deviation[other])
            found.append(_sum_only(names[term], names[other], correlation[term, other] < 0, ratio))
        elif width >= ENOUGH:
            partners = [names[at] for at in np.flatnonzero(np.abs(correlation[term]) >= TOGETHER).tolist()]
            found.append(_too_wide("these data leave", width) + _together(partners))
        else:
            found.append("")
    return np.array(found, dtype=np.str_)


def too_wide(covariance: Real, values: Real, what: str) -> Reasons:
    """(terms,) that `what` leaves more than a quarter of the value open; empty where it does not.

    Args:
        covariance: (terms, terms).
        values: (terms,).
        what: leaves it open, such as "the bench's tolerances leave".
    """
    wide = widths(covariance, values)
    return np.array([_too_wide(what, width) if width >= ENOUGH else "" for width in wide], dtype=np.str_)


def widths(covariance: Real, values: Real) -> Real:
    """(terms,) half-width of the 95 % interval as a share of the term; infinite for one that is zero."""
    half = HALF_WIDTH * np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray(half / np.abs(values))


def _sum_only(term: str, other: str, known_is_sum: bool, ratio: float) -> str:
    sign, word = ("+", "sum") if known_is_sum else ("-", "difference")
    if term[:3] == other[:3] and abs(ratio - 1) < ALIKE:
        return f"only {term} {sign} {other} is seen"
    return f"only a weighted {word} of {term} and {other} is seen"


def _too_wide(what: str, width: float) -> str:
    if width >= 1:
        return f"the 95 % interval that {what} is wider than the value"
    return f"{what} ±{100 * width:.0f} % (95 %), ±{100 * ENOUGH:.0f} % would be enough"


def _together(partners: Sequence[str]) -> str:
    return f"; it goes with {', '.join(partners)}" if partners else ""
