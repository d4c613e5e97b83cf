"""Levenberg's and Marquardt's method for sums of squares given by their normal equations.

D. W. Marquardt, J. Soc. Indust. Appl. Math. 11 (1963) 431-441, with the columns scaled to one. Where one direction is
known a million times worse than others the minimum lies in a narrow valley, which bends: straight steps would have to
be as short as it is narrow. So steps follow its parabola (as M. K. Transtrum, J. P. Sethna, arXiv:1201.5885, 2012, do;
here from a second step instead of second derivatives).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Real

FIRST_DAMPING = 1e-3
PUSH = 8.0  # factor of the damping after a rejected step, doubled at each further rejection
RELIEF = 0.1  # factor after a good step; directions a million times weaker than others move only without damping
LEAST_DAMPING = 1e-14
STRAIGHT = 0.7  # gain of a step over what was predicted, below which the valley is taken to bend
ACROSS = 1e3  # factor of the damping for a step that goes across a valley and not along it
STRAY = 100.0  # times the predicted gain, by which a step may miss the floor of the valley for the way back to count
MOST_DAMPING = 1e8


@dataclass(frozen=True, eq=False)
class Linearised:
    """A sum of squares about a point, with minus half of its gradient and half of its second derivative.

    Attributes:
        cost: the sum of squares.
        descent: (parameters,) J^t r.
        normal: (parameters, parameters) J^t J.
    """

    cost: float
    descent: Real
    normal: Real


@dataclass(frozen=True, eq=False)
class Trial:
    """A sum of squares at a point that may be rejected; derivatives are computed only where it is accepted.

    Attributes:
        cost: the sum of squares.
        linearised: gives the normal equations there.
    """

    cost: float
    linearised: Callable[[], Linearised]


def _infeasible() -> Linearised:
    raise AnalysisError("the search starts at a point without a sum of squares; choose another start")


NOWHERE = Trial(float("inf"), _infeasible)
"""A point without a sum of squares."""


class SumOfSquares(Protocol):
    """A sum of squares to be minimised."""

    @property
    def data(self) -> int:
        """Number of squares, each about one where the model holds."""

    def at(self, values: Real) -> Trial:
        """The sum of squares at `values` (parameters,); `NOWHERE` where there is none."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """End of a search.

    Attributes:
        values: (parameters,).
        at: the normal equations there.
        expected: decrease of the sum of squares by one more step, to first order.
        steps: number of steps.
        converged: whether `expected` is below the tolerance.
    """

    values: Real
    at: Linearised
    expected: float
    steps: int
    converged: bool


def minimise(
    target: SumOfSquares,
    start: Real,
    tolerance: float = 1e-4,
    most_steps: int = 50,
    *,
    along_valleys: bool = False,
    least_gain: float = 0.0,
) -> Minimum:
    """Lower a sum of squares until a step would gain less than `tolerance`, times what a square is on average.

    For a chi-square a tolerance of 1e-4 leaves every parameter within a hundredth of its standard deviation. Where the
    model does not fit, squares exceed one, and the variances are larger in proportion. `along_valleys` lets steps bend,
    which costs another linearisation where a straight one does not come up to what it promised. Two steps in a row that
    each gain less than a share `least_gain` of what is left beyond noise are the last.
    """
    values, damping, slow = start, FIRST_DAMPING, 0
    at = target.at(values).linearised()
    steps = -1
    for steps in range(most_steps):
        step, expected = _step(at, 0.0)
        if 0 <= expected < tolerance * max(1.0, at.cost / target.data):
            return Minimum(values, at, expected, steps, converged=True)
        push = PUSH
        while True:
            step, predicted = _step(at, damping)
            trial = target.at(values + step)
            gain = (at.cost - trial.cost) / predicted
            if along_valleys and -STRAY < gain < STRAIGHT:
                step, trial = _along_valley(target, values, step, trial, damping)
                gain = (at.cost - trial.cost) / predicted
            if gain > 1e-3:
                break
            damping, push = push * damping, 2 * push
            if damping > MOST_DAMPING:
                return Minimum(values, at, expected, steps, converged=False)
        values = values + step
        damping = max(damping * (RELIEF if gain > 0.7 else 1.0 if gain > 0.25 else 4.0), LEAST_DAMPING)
        slow = slow + 1 if at.cost - trial.cost < least_gain * (at.cost - target.data) else 0
        at = trial.linearised()
        if slow == 2:
            break
    _, expected = _step(at, 0.0)
    converged = 0 <= expected < tolerance * max(1.0, at.cost / target.data)
    return Minimum(values, at, expected, steps + 1, converged)


def _along_valley(target: SumOfSquares, start: Real, step: Real, trial: Trial, damping: float) -> tuple[Real, Trial]:
    """A step from `start` that bends, and the trial at its end; those given where it leads no lower.

    The second step leads back from the side of a bent valley to its floor; the parabola of both is followed downhill.
    """
    back, _ = _step(trial.linearised(), ACROSS * damping)
    found, share = (step, trial), 1.0
    while True:
        bent = share * step + share**2 * back
        there = target.at(start + bent)
        if not there.cost < found[1].cost:
            return found
        found, share = (bent, there), 2 * share


def inverse(normal: Real) -> Real:
    """Inverse of a symmetric positive matrix, its columns scaled to one first.

    In SI units a normal matrix of joint terms has a condition number of 1e15, scaled of 1e9. Eigenvalues below rounding
    are raised to it, so an undetermined direction has a large variance and not a negative one.
    """
    scale = 1 / np.sqrt(np.diag(normal))
    values, vectors = np.linalg.eigh(normal * np.outer(scale, scale))
    values = np.maximum(values, values.size * np.finfo(float).eps)  # the largest is one or more
    return np.asarray((vectors / values) @ vectors.T * np.outer(scale, scale))


def inverse_of_squares(rows: Real) -> Real:
    """Inverse (parameters, parameters) of rows^T rows, from `rows` (any, parameters), columns scaled to one first.

    The squares of directions that are known 1e8 times worse than others are lost in rounding; the rows have them
    (A. Bjorck, Numerical Methods for Least Squares Problems, SIAM 1996, Section 2.4).
    """
    scale = 1 / np.linalg.norm(rows, axis=0)
    _, values, vectors = np.linalg.svd(rows * scale, full_matrices=False)
    half = vectors / np.maximum(values, values.size * np.finfo(float).eps)[:, None] * scale
    return np.asarray(half.T @ half)


def _step(at: Linearised, damping: float) -> tuple[Real, float]:
    """The step for this damping, and its decrease of the linearised sum of squares."""
    scale = 1 / np.sqrt(np.diag(at.normal))
    scaled = at.normal * np.outer(scale, scale)
    damped, pull = scaled + damping * np.eye(scale.size), scale * at.descent
    try:
        step = scale * np.linalg.solve(damped, pull)
    except np.linalg.LinAlgError:  # parameters that the data cannot tell apart at all: the shortest step of many
        step = scale * np.linalg.lstsq(damped, pull)[0]
    return step, float(step @ (2 * at.descent - at.normal @ step))
