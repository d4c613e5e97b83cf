"""Checks of a fit: joints that an elastomer can have, goodness of fit, convergence. Reports show those that fail."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from analysis.dof import Dof
from analysis.frequency_response import Real
from analysis.interval import quantile
from analysis.inverse.joint_estimate import HALF, IdentifiedJoint
from analysis.inverse.model_error import Cause
from analysis.inverse.regression import UPPER
from analysis.structure.joints import least_loss, least_stiffness

MISFIT = 1.1
"""Chi-square per datum above which the noise does not explain the residual. A bench that the model describes gives
1.01 +- 0.01 with stated noise, and 1.02 with noise estimated from neighbouring lines."""
FALSE_ALARMS = 2e-4
"""Share of right models that each of the statistical checks refuses. Joints under blows of a hammer follow frequency a
little, as their amplitude does; at a share of 0.3 % that alone refuses one simulated bench of ten."""

HARMLESS = 0.5
"""Standard deviations by which a cause that was left out may move a term: its 95 % interval still holds at 92 %."""


@dataclass(frozen=True)
class ValidityCheck:
    """One condition.

    Attributes:
        name: such as ``passivity of joint I``.
        passed: whether it holds within the uncertainty.
        text: a sentence with figures.
    """

    name: str
    passed: bool
    text: str


def passivity(joint: IdentifiedJoint, degrees_of_freedom: float) -> ValidityCheck:
    """Whether no motion draws energy from the joint: no eigenvalue of h is negative beyond its uncertainty.

    Args:
        joint: as identified.
        degrees_of_freedom: behind the covariance of its h.
    """
    loss, motion = least_loss(joint.joint.dynamic_stiffness)
    weights = np.array([(1 if p == q else 2) * (motion[p].conjugate() * motion[q]).real for p, q in UPPER])
    deviation = float(np.sqrt(weights @ joint.covariance[HALF:, HALF:] @ weights))
    half = float(quantile(degrees_of_freedom)) * deviation
    passed = loss + half >= 0
    verdict = "no motion draws energy from it" if passed else "a motion draws energy from it, which no elastomer can do"
    text = f"least loss factor of joint {joint.name} {loss:.2g} +-{half:.1g} (95 %): {verdict}"
    return ValidityCheck(f"passivity of joint {joint.name}", bool(passed), text)


def positive_stiffness(joint: IdentifiedJoint, degrees_of_freedom: float) -> ValidityCheck:
    """Whether every motion meets resistance: no eigenvalue of k is negative beyond its uncertainty.

    Args:
        joint: as identified.
        degrees_of_freedom: behind the covariance of its k.
    """
    stiffness, motion = least_stiffness(joint.joint.dynamic_stiffness)
    weights = np.array([(1 if p == q else 2) * (motion[p].conjugate() * motion[q]).real for p, q in UPPER])
    half = float(quantile(degrees_of_freedom)) * float(np.sqrt(weights @ joint.covariance[:HALF, :HALF] @ weights))
    passed = stiffness + half >= 0
    verdict = "every motion meets resistance" if passed else "a motion is pushed on, which no joint at rest can do"
    text = f"least relative stiffness of joint {joint.name} {stiffness:.2g} +-{half:.1g} (95 %): {verdict}"
    return ValidityCheck(f"positive stiffness of joint {joint.name}", bool(passed), text)


def independent_residual(correlation: float) -> ValidityCheck:
    """Whether the residual is as independent from line to line as noise.

    Args:
        correlation: of lines a few apart, in standard deviations, as from `correlation_of_neighbours`.
    """
    limit = float(norm.isf(FALSE_ALARMS))
    passed = correlation <= limit
    text = f"the residual of lines a few apart is alike by {correlation:.1f} standard deviations"
    if not passed:
        text += f", above {limit:.1f}: something is not in the model, even where chi-square is small"
    return ValidityCheck("independent residual", passed, text)


def no_missing_cause(causes: Sequence[Cause], terms: Real) -> ValidityCheck:
    """Whether no cause that the model lacks both shows in the residual and moves a term of the joints.

    Args:
        causes: as from `missing_causes`, the strongest first.
        terms: (terms, parameters) derivative of the joints' terms over the standard deviation of each.
    """
    name = "no missing cause"
    if not causes:
        return ValidityCheck(name, True, "no further cause could be told from the fitted parameters")
    limit = float(chi2.isf(FALSE_ALARMS / len(causes), 1))
    shown = [(cause, float(np.max(np.abs(terms @ cause.moves)))) for cause in causes if cause.gain > limit]
    cause, moved = next(((each, by) for each, by in shown if by > HARMLESS), (causes[0], None))
    text = f"a {cause.name} of {cause.value:.2g} {cause.unit} would lower chi-square by {cause.gain:.3g}"
    if moved is not None:
        text += f" (noise: {limit:.0f} at most) and move a term by {moved:.1f} standard deviations: it, or something "
        text += "like it, is not in the model"
    else:
        text += " and move no term" if shown else ", as noise can"
    return ValidityCheck(name, moved is None, text)


def within_tolerances(labels: Sequence[str], values: Real, tolerances: Real) -> ValidityCheck:
    """Whether the bench is as far from its drawing as its stated tolerances let one expect.

    Args:
        labels: (deviations,) names.
        values: (deviations,) as estimated.
        tolerances: (deviations,) one standard deviation each.
    """
    if not labels:
        return ValidityCheck("tolerances", True, "no deviation of the bench was estimated")
    off = np.abs(values) / tolerances
    worst, limit = int(np.argmax(off)), float(norm.isf(FALSE_ALARMS / 2 / len(labels)))
    passed = bool(off[worst] <= limit)
    text = f"{labels[worst]} is {off[worst]:.1f} tolerances off"
    if not passed:
        text += f", above {limit:.1f}: measure it again, state its tolerance, or look for what is not in the model"
    return ValidityCheck("tolerances", passed, text)


def goodness_of_fit(per_line: Real, per_row: Real, frequency: Real, inputs: tuple[Dof, ...]) -> ValidityCheck:
    """Whether the stated noise explains the residual of the model.

    Args:
        per_line: (lines,) chi-square per datum.
        per_row: (rows,) chi-square per datum.
        frequency: (lines,) Hz.
        inputs: (rows,).
    """
    total = float(np.mean(per_row))
    text = f"chi-square is {total:.3g} per datum"
    if total > MISFIT:
        row, line = int(np.argmax(per_row)), int(np.argmax(per_line))
        text += (
            f", above {MISFIT:g}: the model does not explain the data; worst at {inputs[row]} ({per_row[row]:.3g}) "
            f"and near {frequency[line]:.1f} Hz ({per_line[line]:.3g})"
        )
    return ValidityCheck("fit", total <= MISFIT, text)


def convergence(converged: bool, expected: float) -> ValidityCheck:
    """Whether the search ended at a minimum, where another step lowers chi-square by `expected`."""
    return ValidityCheck("convergence", converged, f"another step would lower chi-square by {expected:.1g}")
