"""Joint terms that the data do not determine on their own, and why: each term by itself, and combinations of terms."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.frequency_response import Real
from analysis.interval import Z95
from analysis.inverse.regression import TERMS, UPPER

DETERMINED_HALF_WIDTH = 0.25  # half-width of the 95 % interval of a determined term, as a share of the term
SUM_ONLY = 0.999  # correlation of two terms that are known in a sum or difference only
NAMED_CORRELATION = 0.9  # least correlation of a weakly known term with another one that is named
EQUAL_WEIGHTS = 0.1  # largest deviation from one of the weights of a sum that is written without them

Reasons = NDArray[np.str_]
LEADING = 0.3  # weights below this share of the largest are left out of the text
UNITS = ("EI/L^3", "EI/L^2", "EI/L")
"""Units of terms of translation, coupling and rotation; the index is the number of digits 3 in a name such as k23."""
WEAK = 0.1  # least standard deviation of a weak direction, as a share of the largest stiffness or damping


def term_names(joint_names: Sequence[str]) -> list[str]:
    """(12 joints,) such as "k11(I)", in the order of `regression.TERMS` for each joint."""
    return [f"{term}({joint})" for joint in joint_names for term in TERMS]


def units_of(names: Sequence[str]) -> list[str]:
    """Units in which terms of these `names`, as from `term_names`, count in combinations; each unit once."""
    turns = {name.partition("(")[0].count("3") for name in names}
    return [UNITS[count] for count in sorted(turns)]


def undetermined(bound: Real, values: Real, names: Sequence[str]) -> Reasons:
    """(terms,) why each term is not known on its own to a quarter of its value; empty where it is.

    A term is known in a sum only if its correlation with another one makes one direction forty times better known than
    the other. Only another experiment changes that, not better data.

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
            known_is_sum = correlation[term, other] < 0
            if names[term][:3] == names[other][:3] and abs(deviation[term] / deviation[other] - 1) < EQUAL_WEIGHTS:
                found.append(f"only {names[term]} {'+' if known_is_sum else '-'} {names[other]} is seen")
            else:
                word = "sum" if known_is_sum else "difference"
                found.append(f"only a weighted {word} of {names[term]} and {names[other]} is seen")
        elif width >= DETERMINED_HALF_WIDTH:
            partners = [names[at] for at in np.flatnonzero(np.abs(correlation[term]) >= NAMED_CORRELATION).tolist()]
            together = f"; it goes with {', '.join(partners)}" if partners else ""
            found.append(_too_wide("these data leave", width) + together)
        else:
            found.append("")
    return np.array(found, dtype=np.str_)


def too_wide(covariance: Real, values: Real, what: str) -> Reasons:
    """(terms,) text where an interval is wider than a quarter of the value; `what` is the cause of its width.

    Such as "the bench's tolerances leave". The text is empty elsewhere.
    """
    wide = widths(covariance, values)
    return np.array([_too_wide(what, width) if width >= DETERMINED_HALF_WIDTH else "" for width in wide], dtype=np.str_)


def widths(covariance: Real, values: Real) -> Real:
    """(terms,) half-width of the 95 % interval as a share of the term; infinite for one that is zero."""
    half = Z95 * np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray(half / np.abs(values))


def _too_wide(what: str, width: float) -> str:
    if width >= 1:
        return f"the 95 % interval that {what} at best is wider than the value"
    enough = 100 * DETERMINED_HALF_WIDTH
    # with enough decimals to show that it is more
    decimals = next((count for count in range(4) if round(100 * width, count) > enough), 0)
    return f"{what} ±{100 * width:.{decimals}f} % at best (95 %), less than ±{enough:.0f} % would be enough"


@dataclass(frozen=True, eq=False)
class WeakDirection:
    """A combination of joint terms that the data hardly determine.

    Attributes:
        text: such as "k11(I) - k11(II) is known to +-26 EI/L^3 (one standard deviation), k11(I) + k11(II) to 0.04";
            coupling and rotation count in EI/L^2 and EI/L, which the text says.
        terms: names and weights, the largest weight 1.
        standard_deviation: of that combination, in units of EI/L^3 (EI/L^2, EI/L for coupling, rotation).
    """

    text: str
    terms: tuple[tuple[str, float], ...]
    standard_deviation: float


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
                found.append(_in_words(vector[leading], [names[chosen[i]] for i in leading], within))
    return tuple(sorted(found, key=lambda direction: -direction.standard_deviation))


def scale_direction(tolerance: Real, bound: Real, values: Real) -> WeakDirection | None:
    """The common factor of all terms, which accelerances do not determine: k, E, rho and the gain scale together.

    Args:
        tolerance: (3, 3) relative covariance of gain, E and rho; with one of them exact, so is the factor.
        bound: (terms, terms) least covariance of the terms, the bench as drawn.
        values: (terms,).

    Returns:
        The factor, relative, or None where it is known.
    """
    if not np.all(np.diag(tolerance) > 0):
        return None
    deviation = float(1 / np.sqrt(np.sum(np.linalg.inv(tolerance))))
    known = np.abs(values) > 0
    best = np.min(np.sqrt(np.diag(bound))[known] / np.abs(values[known]), initial=np.inf)
    if best >= deviation:
        return None
    text = (
        f"a common factor of all terms is known to {_short(100 * deviation)} % (one standard deviation), as well as "
        f"gain, density and Young's modulus are; without it the best known term to {_short(100 * float(best))} %"
    )
    return WeakDirection(text, (("all terms", 1.0),), deviation)


def _split(covariance: Real, variance: float) -> bool:
    """Whether terms of this covariance are known in a sum only, and a direction of this variance is not that sum."""
    deviation = np.sqrt(np.diag(covariance))
    scale = np.where(deviation > 0, deviation, 1.0)  # cylinders may give a joint a coupling that is exactly zero
    correlation = np.abs(covariance / np.outer(scale, scale)) - np.eye(len(covariance))
    return bool(np.max(correlation) >= SUM_ONLY and variance > np.max(np.diag(covariance)) / 2)


def _in_words(vector: Real, names: Sequence[str], block: Real) -> WeakDirection:
    weights = vector / vector[np.argmax(np.abs(vector))]
    weights = np.where(np.abs(np.abs(weights) - 1) < 0.1, np.sign(weights), weights) * np.sign(weights[0])
    deviation = float(np.sqrt(weights @ block @ weights))
    *others, unit = units_of(names)
    of_one, of_several = (f" {unit}", "") if not others else ("", f"; terms in {', '.join(others)} and {unit}")
    text = f"{_sum(weights, names)} is known to +-{_short(deviation)}{of_one} (one standard deviation{of_several})"
    if len(names) == 2:
        other = weights * (1, -1)
        text += f", {_sum(other, names)} to {_short(np.sqrt(max(other @ block @ other, 0.0)))}"
    return WeakDirection(text, tuple(zip(names, weights.tolist(), strict=True)), deviation)


def _sum(weights: Real, names: Sequence[str]) -> str:
    text = ""
    for weight, name in zip(weights, names, strict=True):
        size = "" if abs(weight) == 1 else f"{abs(weight):.1f} "
        sign = (" - " if weight < 0 else " + ") if text else ("-" if weight < 0 else "")
        text += f"{sign}{size}{name}"
    return text


def _short(number: float) -> str:
    """Two digits, without an exponent where that is readable."""
    return f"{float(f'{number:.2g}'):g}"
