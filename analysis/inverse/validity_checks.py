"""Checks of a fit: joints that an elastomer can have, goodness of fit, convergence. Reports show those that fail.

What was found is a value here; `jointlab.identification.validity_text` has the words.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm
from scipy.stats import f as f_distribution

from analysis.dof import Dof
from analysis.frequency_response import Complex, Real
from analysis.inverse.joint_estimate import HALF, IdentifiedJoint
from analysis.inverse.model_error import Cause
from analysis.inverse.regression import UPPER
from analysis.structure.joints import Joint, least_loss, least_stiffness

MISFIT = 1.1
"""Chi-square per datum above which the noise does not explain the residual. A bench that the model describes gives
1.01 +- 0.01 with stated noise, and 1.02 with noise estimated from neighbouring lines."""
FALSE_ALARMS = 2e-4
"""Share of right models that each of the statistical checks refuses. Joints under blows of a hammer follow frequency a
little, as their amplitude does; at a share of 0.3 % that alone refuses one simulated bench of ten."""

SMALL_STEP = 0.04
"""Decrease of chi-square by a last step that moves a term by 0.2 standard errors at most: 95 % intervals then hold
94.5 %."""

CLEAR_COUPLING = 0.1
"""Share of k12 in the root of k11 k22, from which the drawing says which sign it has."""

MOST_MOVED = float(norm.isf(0.025))
"""Largest change of a reported term by causes that the model lacks, in standard errors: half of its 95 % interval. Up
to this limit the interval is widened, for which only the size of the cause has to be known. Above it, the estimate
depends on which cause is the true one, because similar causes change the term in different ways."""


@dataclass(frozen=True)
class LeastLoss:
    """Least loss factor of all motions of `joint`, with the half-width of its interval."""

    joint: str
    value: float
    half_width: float


@dataclass(frozen=True)
class LeastStiffness:
    """Least relative stiffness of all motions of `joint`, with the half-width of its interval."""

    joint: str
    value: float
    half_width: float


@dataclass(frozen=True)
class Couplings:
    """Joints that show a coupling, and k12 in N/m of those that couple against their drawing.

    Attributes:
        judged: number of joints.
        against_drawing: name and k12.
    """

    judged: int
    against_drawing: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Correlation:
    """How alike the residual of lines a few apart is, and the limit, in standard deviations."""

    deviations: float
    limit: float


@dataclass(frozen=True)
class StrongestCause:
    """The cause that the model may lack and that matters most.

    Attributes:
        cause: None where no cause could be distinguished from the parameters.
        shows: whether it shows in the residual; if not, noise can have the same effect.
        limit: decrease of chi-square up to which noise has the same effect.
        moves: change of a term by it, standard errors.
        together: the same by all causes.
    """

    cause: Cause | None
    shows: bool = False
    limit: float = 0.0
    moves: float = 0.0
    together: float = 0.0


@dataclass(frozen=True)
class WorstDeviation:
    """The deviation of the bench that is furthest off, and the limit, in tolerances; no label where there is none."""

    label: str | None
    tolerances: float = 0.0
    limit: float = 0.0


@dataclass(frozen=True)
class ChiSquare:
    """Chi-square per datum, of all data, of the worst row and of the worst line, the latter in Hz."""

    total: float
    row: Dof
    of_row: float
    frequency: float
    of_line: float


@dataclass(frozen=True)
class NextStep:
    """Decrease of chi-square to expect of another step of the search."""

    decrease: float


Finding = LeastLoss | LeastStiffness | Couplings | Correlation | StrongestCause | WorstDeviation | ChiSquare | NextStep


@dataclass(frozen=True)
class ValidityCheck:
    """One condition.

    Attributes:
        name: such as ``passivity of joint I``.
        passed: whether it holds within the uncertainty.
        finding: the figures.
    """

    name: str
    passed: bool
    finding: Finding


def passivity(joint: IdentifiedJoint, degrees_of_freedom: float) -> ValidityCheck:
    """Whether no motion draws energy from the joint: no eigenvalue of h is negative beyond its uncertainty.

    Args:
        degrees_of_freedom: behind the covariance of its h.
    """
    loss, motion = least_loss(joint.joint.dynamic_stiffness)
    half = _of_any_motion(motion, joint.covariance[HALF:, HALF:], degrees_of_freedom)
    return ValidityCheck(f"passivity of joint {joint.name}", loss + half >= 0, LeastLoss(joint.name, loss, half))


def positive_stiffness(joint: IdentifiedJoint, degrees_of_freedom: float) -> ValidityCheck:
    """Whether every motion meets resistance: no eigenvalue of k is negative beyond its uncertainty.

    Args:
        degrees_of_freedom: behind the covariance of its k.
    """
    stiffness, motion = least_stiffness(joint.joint.dynamic_stiffness)
    half = _of_any_motion(motion, joint.covariance[:HALF, :HALF], degrees_of_freedom)
    found = LeastStiffness(joint.name, stiffness, half)
    return ValidityCheck(f"positive stiffness of joint {joint.name}", stiffness + half >= 0, found)


def coupling_as_drawn(joints: Sequence[IdentifiedJoint], drawn: Sequence[Joint]) -> ValidityCheck:
    """Whether not all joints couple motion along and across the beam against their drawing.

    If all rows along the beam have the wrong polarity, the mirror image of the bench fits as well as the bench.

    Args:
        joints: as identified.
        drawn: the same joints as drawn, of cylinders that are stiffer in compression than in shear; of any size.
    """
    wrong, judged = list[tuple[str, float]](), 0
    for found, expected in zip(joints, drawn, strict=True):
        stiffness = expected.dynamic_stiffness.real
        share = stiffness[0, 1] / np.sqrt(stiffness[0, 0] * stiffness[1, 1])
        if abs(share) < CLEAR_COUPLING or not found.observable[0, 1]:
            continue
        judged += 1
        if share * found.stiffness[0, 1] < 0:
            wrong.append((found.joint.name, float(found.stiffness[0, 1])))
    passed = not wrong or len(wrong) < judged
    return ValidityCheck("coupling as drawn", passed, Couplings(judged, tuple(wrong)))


def _of_any_motion(motion: Complex, covariance: Real, degrees_of_freedom: float) -> float:
    """Half-width of an interval that holds for u^H a u of all motions u at once, at the one given.

    The motion with the least value is chosen, and one of many is low by chance (H. Scheffe, Biometrika 40, 1953).

    Args:
        motion: (3,) u.
        covariance: (6, 6) of the upper terms of a.
        degrees_of_freedom: behind it.
    """
    weights = np.array([(1 if p == q else 2) * (motion[p].conjugate() * motion[q]).real for p, q in UPPER])
    ratio = chi2.isf(FALSE_ALARMS, HALF) / HALF
    if np.isfinite(degrees_of_freedom):
        ratio = f_distribution.isf(FALSE_ALARMS, HALF, degrees_of_freedom)
    return float(np.sqrt(HALF * ratio * (weights @ covariance @ weights)))


def independent_residual(correlation: float) -> ValidityCheck:
    """Whether the residual is as independent from line to line as noise.

    Args:
        correlation: of lines a few apart, in standard deviations, as from `correlation_of_neighbours`.
    """
    limit = float(norm.isf(FALSE_ALARMS))
    return ValidityCheck("independent residual", correlation <= limit, Correlation(correlation, limit))


def no_missing_cause(causes: Sequence[Cause], terms: Real) -> ValidityCheck:
    """Whether no cause that the model lacks shows in the residual and moves a term out of its own interval.

    Args:
        causes: as from `missing_causes`, the strongest first.
        terms: (terms, parameters) derivative of the terms that are shown over the standard error of each by noise.
    """
    name = "no missing cause"
    if not causes:
        return ValidityCheck(name, True, StrongestCause(None))
    limit = float(chi2.isf(FALSE_ALARMS / len(causes), 1))
    shown = [cause for cause in causes if cause.gain > limit]
    moved = np.array([np.max(np.abs(terms @ cause.reach), initial=0.0) for cause in shown or causes[:1]])
    together = float(np.max(np.sqrt(sum(np.square(terms @ cause.reach) for cause in causes)), initial=0.0))
    cause = (shown or causes)[int(np.argmax(moved))]
    passed = not shown or together <= MOST_MOVED
    found = StrongestCause(cause, bool(shown), limit, float(np.max(moved)), together)
    return ValidityCheck(name, passed, found)


def within_tolerances(labels: Sequence[str], values: Real, tolerances: Real) -> ValidityCheck:
    """Whether the bench is as far from its drawing as its stated tolerances let one expect.

    Args:
        labels: (deviations,) names.
        values: (deviations,) as estimated.
        tolerances: (deviations,) one standard deviation each.
    """
    if not labels:
        return ValidityCheck("tolerances", True, WorstDeviation(None))
    off = np.abs(values) / tolerances
    worst, limit = int(np.argmax(off)), float(norm.isf(FALSE_ALARMS / 2 / len(labels)))
    found = WorstDeviation(labels[worst], float(off[worst]), limit)
    return ValidityCheck("tolerances", bool(off[worst] <= limit), found)


def goodness_of_fit(per_line: Real, per_row: Real, frequency: Real, inputs: tuple[Dof, ...]) -> ValidityCheck:
    """Whether the stated noise explains the residual of the model.

    Args:
        per_line: (lines,) chi-square per datum.
        per_row: (rows,) chi-square per datum.
        frequency: (lines,) Hz.
        inputs: (rows,).
    """
    total = float(np.mean(per_row))
    row, line = int(np.argmax(per_row)), int(np.argmax(per_line))
    found = ChiSquare(total, inputs[row], float(per_row[row]), float(frequency[line]), float(per_line[line]))
    return ValidityCheck("fit", total <= MISFIT, found)


def convergence(converged: bool, expected: float) -> ValidityCheck:
    """Whether the search ended at a minimum, or so near that another step, which lowers chi-square by `expected`, would
    move no term by more than a fifth of its standard error: its root is the largest such move."""
    passed = converged or 0 <= expected <= SMALL_STEP
    return ValidityCheck("convergence", passed, NextStep(expected))
