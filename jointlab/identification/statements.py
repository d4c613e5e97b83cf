"""Statements about a fit to accelerances, in sentences: exponents, leaning blows, the effect of a prior."""

import math

import numpy as np

from analysis.inverse.joint_fit import JointFit
from analysis.inverse.tolerances import REFERENCE_FREQUENCY
from analysis.inverse.undetermined_terms import term_names

LEAN_SIGNIFICANCE = 3.0
"""Standard deviations from which on a lean of the blows is mentioned."""
MOSTLY = 0.5
"""Share of a term's variance from which on the term comes more from the prior than from the data."""


def fit_statements(fit: JointFit) -> list[str]:
    """How joints follow frequency, and where blows lean; empty for constant joints and straight blows."""
    statements = []
    for name, exponent in fit.exponents.items():
        low, high = exponent.interval()
        statements.append(
            f"Joint {name} follows the power {exponent.value:.4f} ({low:.4f} .. {high:.4f}) of frequency; its terms "
            f"are those at {REFERENCE_FREQUENCY:g} Hz."
        )
    significant = {
        point: lean for point, lean in fit.leans.items() if abs(lean.value) > LEAN_SIGNIFICANCE * lean.standard_error
    }
    if not significant:
        return statements
    point = max(significant, key=lambda each: abs(significant[each].value))
    lean, half = math.degrees(abs(significant[point].value)), math.degrees(significant[point].half_width())
    return [
        *statements,
        f"Blows lean most at {point}, by {lean:.1f} ± {half:.1f} degrees (95 %, from their scatter); joints and "
        "intervals allow for it.",
    ]


def regularisation_statements(fit: JointFit, share: float) -> list[str]:
    """Assumptions of a regularised fit, and their effect on the terms.

    Args:
        fit: regularised.
        share: of its size within which every term was held.
    """
    effect = fit.prior_effect
    names = np.array(term_names(tuple(fit.joints)))
    mostly = effect.share > MOSTLY
    deviation = np.sqrt(np.diag(fit.terms_covariance))
    found = [
        f"Regularised: every term is taken to lie within {100 * share:g} % of its size (one standard deviation) about "
        "that of the paper's method, coupling and rotation about those of a joint as deep as half of the beam"
    ]
    if np.any(mostly):
        found.append(f"From this prior more than from the data come {', '.join(names[mostly])}")
    if not np.all(mostly):
        bias = np.where(mostly, 0.0, np.abs(effect.bias) / deviation)
        worst = int(np.argmax(bias))
        found.append(f"All others it biases by {bias[worst]:.2g} standard deviations or less, {names[worst]} the most")
    return found
