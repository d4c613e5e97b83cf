"""Why terms of a joint are not observable, which combinations are hardly determined, and what remedies it, in words."""

from collections.abc import Sequence

from analysis.inverse.experiment_remedies import (
    EQUALITY,
    CylindersAsParameters,
    EqualTerms,
    Remedy,
    RemedyChange,
    SecondAccelerometer,
    WiderBand,
)
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.inverse.undetermined_terms import (
    DETERMINED_HALF_WIDTH,
    CommonFactor,
    KnownInSum,
    LeftBy,
    Reason,
    TooWide,
    Unobservable,
    WeakDirection,
    units_of,
)

INTERVAL_WIDER_THAN_VALUE = "its 95 % interval is wider than the value"
WITHOUT_FIGURES = {
    Unobservable.INCLUDES_ZERO: "its 95 % interval includes zero",
    Unobservable.WIDER_THAN_VALUE: INTERVAL_WIDER_THAN_VALUE,
    Unobservable.FEWER_MODES: "the joints found do not give back as many modes as were measured, so what these "
    "determine is not known",
}
SOURCES = {LeftBy.DATA: "these data leave", LeftBy.TOLERANCES: "the bench's tolerances leave"}


def not_observable_text(joint: IdentifiedJoint) -> dict[str, str]:
    """Reason by name, such as "k12" and "k21", for every element that is not observable."""
    return {name: reason_text(why) for name, why in joint.not_observable.items()}


def reason_text(reason: Reason) -> str:
    """Why a term is not observable."""
    match reason:
        case Unobservable():
            return WITHOUT_FIGURES[reason]
        case KnownInSum(term, other, is_sum, weighted=False):
            return f"only {term} {'+' if is_sum else '-'} {other} is seen"
        case KnownInSum(term, other, is_sum):
            return f"only a weighted {'sum' if is_sum else 'difference'} of {term} and {other} is seen"
        case TooWide(left_by, half_width, partners):
            together = f"; it goes with {', '.join(partners)}" if partners else ""
            return _width_text(SOURCES[left_by], half_width) + together


def _width_text(what: str, width: float) -> str:
    if width >= 1:
        return f"the 95 % interval that {what} at best is wider than the value"
    enough = 100 * DETERMINED_HALF_WIDTH
    # with enough decimals to show that it is more
    decimals = next((count for count in range(4) if round(100 * width, count) > enough), 0)
    return f"{what} ±{100 * width:.{decimals}f} % at best (95 %), less than ±{enough:.0f} % would be enough"


def weak_direction_text(weak: WeakDirection | CommonFactor) -> str:
    """How well a combination of terms is known.

    Such as "k11(I) - k11(II) is known to +-26 EI/L^3 (one standard deviation), k11(I) + k11(II) to 0.04"; coupling and
    rotation count in EI/L^2 and EI/L, which the text says.
    """
    if isinstance(weak, CommonFactor):
        return (
            f"a common factor of all terms is known to {_short(100 * weak.standard_deviation)} % (one standard "
            "deviation), as well as gain, density and Young's modulus are; without it the best known term to "
            f"{_short(100 * weak.best_without)} %"
        )
    *others, unit = units_of([name for name, _ in weak.terms])
    of_one, of_several = (f" {unit}", "") if not others else ("", f"; terms in {', '.join(others)} and {unit}")
    deviation = f"{_short(weak.standard_deviation)}{of_one} (one standard deviation{of_several})"
    text = f"{_sum(weak.terms)} is known to +-{deviation}"
    if weak.reversed_deviation is None:
        return text
    first, (name, weight) = weak.terms
    return f"{text}, {_sum((first, (name, -weight)))} to {_short(weak.reversed_deviation)}"


def _sum(terms: Sequence[tuple[str, float]]) -> str:
    text = ""
    for name, weight in terms:
        size = "" if abs(weight) == 1 else f"{abs(weight):.1f} "
        sign = (" - " if weight < 0 else " + ") if text else ("-" if weight < 0 else "")
        text += f"{sign}{size}{name}"
    return text


def _short(number: float) -> str:
    """Two digits, without an exponent where that is readable."""
    return f"{float(f'{number:.2g}'):g}"


def remedy_text(remedy: Remedy) -> str:
    """The change, and what it does to the weakest direction."""
    unit = " and ".join(remedy.units)
    return f"{_change(remedy.change)}: from +-{remedy.before:.2g} {unit} to +-{remedy.after:.2g} {unit}"


def _change(change: RemedyChange) -> str:
    match change:
        case EqualTerms(joints):
            which = ", ".join(f"joint {name}" for name in joints) or "each joint"
            return f"taking k11 = k22 in {which} within {100 * EQUALITY:g} %"
        case CylindersAsParameters():
            return "the cylinders as parameters"
        case SecondAccelerometer(at):
            return f"a second accelerometer at {at}"
        case WiderBand(highest):
            return f"lines up to {highest:.0f} Hz at the same noise"
