"""A prior under joint terms that the accelerances leave open, on request, and what it does to them, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.frequency_response import FrequencyResponses
from analysis.inverse.joint_estimate import square
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses, turning_modestly
from analysis.inverse.joint_parameters import HALF, held_terms
from analysis.inverse.tolerances import Tolerances
from analysis.inverse.undetermined_terms import term_names
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint

MOSTLY = 0.5  # share of a term's variance from which on it is the prior's more than the data's


def regularised(
    beam: FreeBeam, measured: FrequencyResponses, start: Sequence[Joint], tolerances: Tolerances, share: float
) -> JointFit:
    """The fit by maximum likelihood with every term held within a `share` of its size about the start.

    How a start turns modes hardly say; so coupling and rotation are held about those of joints as deep as half of the
    beam.
    """
    held = held_terms(turning_modestly(start, beam), share)
    return identify_from_responses(beam, measured, start, parameters=held, tolerances=tolerances)


def regularisation_texts(fit: JointFit, share: float) -> list[str]:
    """What is assumed, and what that does to the terms."""
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


def by_joint(fit: JointFit) -> dict[str, dict[str, list[list[float]]]]:
    """By joint, (3, 3) shares and biases of k and of h."""
    found: dict[str, dict[str, list[list[float]]]] = {}
    for place, name in enumerate(fit.joints):
        found[name] = {}
        for half, letter in enumerate("kh"):
            at = slice(HALF * (2 * place + half), HALF * (2 * place + half + 1))
            found[name][f"{letter}_prior_share"] = square(fit.prior_effect.share[at]).tolist()
            found[name][f"{letter}_bias"] = square(fit.prior_effect.bias[at]).tolist()
    return found
