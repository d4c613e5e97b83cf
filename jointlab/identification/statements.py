"""Statements about a fit to accelerances, in sentences: laws of joints, leaning blows, the effect of a prior."""

import math
from collections.abc import Mapping

import numpy as np
from scipy.special import expit

from analysis.interval import Estimate
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.frequency_laws import CORNER, REFERENCE_FREQUENCY
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.undetermined_terms import term_names

LEAN_SIGNIFICANCE = 3.0
"""Standard deviations from which on a lean of the blows is mentioned."""
MOSTLY = 0.5
"""Share of a term's variance from which on the term comes more from the prior than from the data."""


def fit_statements(fit: JointFit) -> list[str]:
    """How joints follow frequency, and where blows lean; empty for constant joints and straight blows."""
    statements = [
        f"Joint {name} follows {_law(fit.law, parameters)}; its terms are those at {REFERENCE_FREQUENCY:g} Hz."
        for name, parameters in fit.law_parameters.items()
    ]
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


def _law(law: FrequencyLaw, parameters: Mapping[str, Estimate]) -> str:
    if law is FrequencyLaw.POWER:
        exponent = parameters["exponent"]
        low, high = exponent.interval()
        return f"the power {exponent.value:.4f} ({low:.4f} – {high:.4f}) of frequency"
    rise, corner, order = (parameters[name] for name in ("rise", "corner", "order"))
    of_rise, of_corner = np.exp([rise.value, *rise.interval()]), CORNER * np.exp([corner.value, *corner.interval()])
    low, high = expit(order.interval())
    return (
        f"a fractional Zener law: its stiffness changes by a factor of {of_rise[0]:.3f} ({of_rise[1]:.3f} – "
        f"{of_rise[2]:.3f}) about {of_corner[0]:.3g} Hz ({of_corner[1]:.3g} – {of_corner[2]:.3g}), with the order "
        f"{expit(order.value):.2f} ({low:.2f} – {high:.2f})"
    )


def regularisation_statements(fit: JointFit, share: float) -> list[str]:
    """Assumptions of a regularised fit, and their effect on the terms.

    Args:
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
