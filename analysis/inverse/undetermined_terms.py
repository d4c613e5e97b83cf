"""Joint terms that the data do not determine on their own, and why: each term by itself, and combinations of terms.

Reasons and combinations are values here; `jointlab.identification.undetermined_text` has the words.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from analysis.frequency_response import Real
from analysis.interval import Z95
from analysis.inverse.regression import TERMS, UPPER

DETERMINED_HALF_WIDTH = 0.25  # half-width of the 95 % interval of a determined term, as a share of the term
SUM_ONLY = 0.999  # correlation of two terms that are known in a sum or difference only
NAMED_CORRELATION = 0.9  # least correlation of a weakly known term with another one that is named
EQUAL_WEIGHTS = 0.1  # largest deviation from one of the weights of a sum that is written without them
LEADING = 0.3  # weights below this share of the largest are left out of a combination
UNITS = ("EI/L^3", "EI/L^2", "EI/L")
"""Units of terms of translation, coupling and rotation; the index is the number of digits 3 in a name such as k23."""
WEAK = 0.1  # least standard deviation of a weak direction, as a share of the largest stiffness or damping


class Unobservable(Enum):
    """Why a term is not observable, where the reason needs no figures.

    The 95 % interval of the term includes zero, or is wider than the value; or the identified joints do not give back
    as many modes as were measured, so that it is not known what these determine.
    """

    INCLUDES_ZERO = "includes_zero"
    WIDER_THAN_VALUE = "wider_than_value"
    FEWER_MODES = "fewer_modes"


class LeftBy(Enum):
    """What leaves an interval too wide, however well the rest is known."""

    DATA = "data"
    TOLERANCES = "tolerances"


@dataclass(frozen=True)
class KnownInSum:
    """Only a sum or difference of a term and another one is known.

    Attributes:
        term, other: names, as from `term_names`.
        is_sum: whether the sum is known, not the difference.
        weighted: whether the two count in it with unlike weights.
    """

    term: str
    other: str
    is_sum: bool
    weighted: bool


@dataclass(frozen=True)
class TooWide:
    """The least 95 % interval of a term is wider than a quarter of its value.

    Attributes:
        left_by: the cause of the width.
        half_width: of that interval, as a share of the term; infinite for one that is zero.
        partners: names of terms that the term is correlated with.
    """

    left_by: LeftBy
    half_width: float
    partners: tuple[str, ...] = ()


Reason = Unobservable | KnownInSum | TooWide
Reasons = NDArray[np.object_]
"""Of each term a `Reason`, or None where the term is known."""


def term_names(joint_names: Sequence[str]) -> list[str]:
    """(12 joints,) such as "k11(I)", in the order of `regression.TERMS` for each joint."""
    return [f"{term}({joint})" for joint in joint_names for term in TERMS]


def units_of(names: Sequence[str]) -> list[str]:
    """Units in which terms of these `names`, as from `term_names`, count in combinations; each unit once."""
    turns = {name.partition("(")[0].count("3") for name in names}
    return [UNITS[count] for count in sorted(turns)]


def reasons_array(reasons: Sequence[Reason | None]) -> Reasons:
    """(terms,) of these, one for each term."""
    found = np.empty(len(reasons), dtype=np.object_)
    found[:] = reasons
    return found


def undetermined(bound: Real, values: Real, names: Sequence[str]) -> Reasons:
    """(terms,) why each term is not known on its own to a quarter of its value; None where it is.

    A term is known in a sum only if its correlation with another one makes one direction forty times better known than
    the other. Only another experiment changes that, not better data.

    Args:
        bound: (terms, terms) least covariance, the inverse of the Fisher information, as from `modal_bound`.
        values: (terms,).
        names: (terms,) as from `term_names`.
    """
    deviation = np.sqrt(np.diag(bound))
    correlation = bound / np.outer(deviation, deviation) - np.eye(len(bound))
    found: list[Reason | None] = []
    for term, width in enumerate(widths(bound, values).tolist()):
        other = int(np.argmax(np.abs(correlation[term])))
        if abs(correlation[term, other]) >= SUM_ONLY:
            alike = names[term][:3] == names[other][:3]
            weighted = not alike or bool(abs(deviation[term] / deviation[other] - 1) >= EQUAL_WEIGHTS)
            found.append(KnownInSum(names[term], names[other], bool(correlation[term, other] < 0), weighted))
        elif width >= DETERMINED_HALF_WIDTH:
            partners = np.flatnonzero(np.abs(correlation[term]) >= NAMED_CORRELATION).tolist()
            found.append(TooWide(LeftBy.DATA, width, tuple(names[at] for at in partners)))
        else:
            found.append(None)
    return reasons_array(found)


def too_wide(covariance: Real, values: Real, left_by: LeftBy) -> Reasons:
    """(terms,) where an interval is wider than a quarter of the value, and what the width is left by; else None."""
    wide = widths(covariance, values).tolist()
    return reasons_array([TooWide(left_by, width) if width >= DETERMINED_HALF_WIDTH else None for width in wide])


def widths(covariance: Real, values: Real) -> Real:
    """(terms,) half-width of the 95 % interval as a share of the term; infinite for one that is zero."""
    half = Z95 * np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray(half / np.abs(values))


@dataclass(frozen=True, eq=False)
class WeakDirection:
    """A combination of joint terms that the data hardly determine.

    Attributes:
        terms: names and weights, the largest weight 1.
        standard_deviation: of that combination, in units of EI/L^3 (EI/L^2, EI/L for coupling, rotation).
        reversed_deviation: the same with the sign of the second term reversed; None where they are not two.
    """

    terms: tuple[tuple[str, float], ...]
    standard_deviation: float
    reversed_deviation: float | None = None


@dataclass(frozen=True)
class CommonFactor:
    """The common factor of all terms, which the data hardly determine.

    Attributes:
        standard_deviation: of the factor, relative.
        best_without: relative standard deviation of the best known term, were the factor known.
    """

    standard_deviation: float
    best_without: float


WeakDirections = tuple[WeakDirection | CommonFactor, ...]


def weak_directions(
    covariance: Real, joint_names: Sequence[str], unit: Real, values: Real
) -> tuple[WeakDirection, ...]:
    """Combinations of terms that the data hardly determine, the weakest first.

    They are eigenvectors of the covariance of all stiffnesses, and of that of all dampings, scaled by `unit`: those
    uncertain by more than a tenth of the largest term, and those of two terms that are known in a sum only.

    Args:
        covariance: (12 joints, 12 joints) of the terms of all joints.
        joint_names: (joints,).
        unit: (3, 3) of the terms, such as `Beam.stiffness_unit`.
        values: (12 joints,) the terms themselves.
    """
    found = []
    half = len(UPPER)
    scale = np.tile([unit[place] for place in UPPER], 2 * len(joint_names))
    names = term_names(joint_names)
    scaled, values = covariance / np.outer(scale, scale), values / scale
    for kind in range(2):
        chosen = np.flatnonzero((np.arange(scale.size) // half) % 2 == kind)
        block = scaled[np.ix_(chosen, chosen)]
        limit = WEAK * np.max(np.abs(values[chosen]))
        variances, vectors = np.linalg.eigh(block)
        for variance, vector in zip(variances, vectors.T, strict=True):
            leading = np.flatnonzero(np.abs(vector) > LEADING * np.max(np.abs(vector)))
            within = block[np.ix_(leading, leading)]
            if variance > limit**2 or _split(within, variance):
                found.append(_direction(vector[leading], [names[chosen[i]] for i in leading], within))
    return tuple(sorted(found, key=lambda direction: -direction.standard_deviation))


def common_factor(tolerance: Real, bound: Real, values: Real) -> CommonFactor | None:
    """The common factor of all terms, which accelerances do not determine: k, E, rho and the gain scale together.

    Args:
        tolerance: (3, 3) relative covariance of gain, E and rho; with one of them exact, so is the factor.
        bound: (terms, terms) least covariance of the terms, the bench as drawn.
        values: (terms,).

    Returns:
        The factor, or None where it is known.
    """
    if not np.all(np.diag(tolerance) > 0):
        return None
    deviation = float(1 / np.sqrt(np.sum(np.linalg.inv(tolerance))))
    known = np.abs(values) > 0
    best = float(np.min(np.sqrt(np.diag(bound))[known] / np.abs(values[known]), initial=np.inf))
    return None if best >= deviation else CommonFactor(deviation, best)


def _split(covariance: Real, variance: float) -> bool:
    """Whether terms of this covariance are known in a sum only, and a direction of this variance is not that sum."""
    deviation = np.sqrt(np.diag(covariance))
    scale = np.where(deviation > 0, deviation, 1.0)  # cylinders may give a joint a coupling that is exactly zero
    correlation = np.abs(covariance / np.outer(scale, scale)) - np.eye(len(covariance))
    return bool(np.max(correlation) >= SUM_ONLY and variance > np.max(np.diag(covariance)) / 2)


def _direction(vector: Real, names: Sequence[str], block: Real) -> WeakDirection:
    """The combination of this covariance `block`, with weights near one in size rounded to it."""
    weights = vector / vector[np.argmax(np.abs(vector))]
    weights = np.where(np.abs(np.abs(weights) - 1) < 0.1, np.sign(weights), weights) * np.sign(weights[0])
    reversed_deviation = None
    if len(names) == 2:
        other = weights * (1, -1)
        reversed_deviation = float(np.sqrt(max(other @ block @ other, 0.0)))
    deviation = float(np.sqrt(weights @ block @ weights))
    return WeakDirection(tuple(zip(names, weights.tolist(), strict=True)), deviation, reversed_deviation)
