"""What a fit to accelerances says besides the joints' terms, in sentences."""

from __future__ import annotations

import math

from analysis.inverse.joint_fit import JointFit
from analysis.inverse.tolerances import REFERENCE_FREQUENCY

TOLD = 3.0  # standard deviations from which a lean is spoken of


def fit_texts(fit: JointFit) -> list[str]:
    """A sentence each."""
    return [*exponent_texts(fit), *lean_texts(fit)]


def exponent_texts(fit: JointFit) -> list[str]:
    """What the joints make of frequency, a sentence each; none where they were taken to be constant."""
    found = []
    for name, exponent in fit.exponents.items():
        low, high = exponent.interval()
        found.append(
            f"Joint {name} follows the power {exponent.value:.4f} ({low:.4f} .. {high:.4f}) of frequency; its terms "
            f"are those at {REFERENCE_FREQUENCY:g} Hz."
        )
    return found


def lean_texts(fit: JointFit) -> list[str]:
    """Where blows leaned most, for whoever strikes; nothing where none is told from a straight one."""
    told = {point: lean for point, lean in fit.leans.items() if abs(lean.value) > TOLD * lean.standard_error}
    if not told:
        return []
    point = max(told, key=lambda each: abs(told[each].value))
    lean, half = math.degrees(abs(told[point].value)), math.degrees(told[point].half_width())
    return [
        f"The hand leans most at {point}, by {lean:.1f} ± {half:.1f} degrees (95 %, as its blows scatter); joints and "
        "intervals allow for it."
    ]
