"""Checks of a fit: passivity of the joints, goodness of fit, convergence. Reports show those that fail."""

from dataclasses import dataclass

import numpy as np

from analysis.dof import Dof
from analysis.frequency_response import Real
from analysis.interval import quantile
from analysis.inverse.joint_estimate import HALF, IdentifiedJoint
from analysis.inverse.regression import UPPER
from analysis.structure.joints import least_loss

MISFIT = 1.5  # chi-square per datum above which the stated noise does not explain the residual


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
