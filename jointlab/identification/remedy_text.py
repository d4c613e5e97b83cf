"""Changes that may improve the weakest direction of an experiment, in words."""

from analysis.inverse.experiment_remedies import (
    EQUALITY,
    CylindersAsParameters,
    EqualTerms,
    Remedy,
    RemedyChange,
    SecondAccelerometer,
    WiderBand,
)


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
