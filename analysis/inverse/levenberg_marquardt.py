"""Levenberg's and Marquardt's method for sums of squares given by their normal equations.

D. W. Marquardt, J. Soc. Indust. Appl. Math. 11 (1963) 431-441, with the columns scaled to one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Real

FIRST_DAMPING = 1e-3
PUSH = 8.0  # and twice that at each further refusal of a step: damping that is far too small is soon enough
RELIEF = 0.1  # directions a million times weaker than others need the damping gone before they move
LEAST_DAMPING = 1e-14
MOST_DAMPING = 1e8


@dataclass(frozen=True, eq=False)
class Linearised:
    """A sum of squares about a point: half of its gradient, negative, and half of its second derivative.

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
    """A sum of squares at a point that may be refused: its derivatives are asked for only where it is not.

    Attributes:
        cost: the sum of squares.
        linearised: gives the normal equations there.
    """

    cost: float
    linearised: Callable[[], Linearised]


def _begun_nowhere() -> Linearised:
    raise AnalysisError("a search has begun where there is nothing to be minimised; start it from what can be")


NOWHERE = Trial(float("inf"), _begun_nowhere)
"""Where there is no sum of squares."""


class SumOfSquares(Protocol):
    """What is minimised."""

    @property
    def data(self) -> int:
        """Number of squares, each about one where the model holds."""

    def at(self, values: Real) -> Trial:
        """The sum of squares at `values` (parameters,); `NOWHERE` where there is none."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where the search ended.

    Attributes:
        values: (parameters,).
        at: the normal equations there.
        expected: by how much one more step would lower the sum of squares, to first order.
        steps: how many were taken.
        converged: whether `expected` is below what was asked for.
    """

    values: Real
    at: Linearised
    expected: float
    steps: int
    converged: bool


def minimise(target: SumOfSquares, start: Real, tolerance: float = 1e-4, most_steps: int = 50) -> Minimum:
    """Lower a sum of squares until a step would gain less than `tolerance`, times what a square is on average.

    For a chi-square a tolerance of 1e-4 leaves every parameter within a hundredth of its standard deviation. Where the
    model does not hold, squares exceed one and so do the variances that the misfit stands for.
    """
    values, damping = start, FIRST_DAMPING
    at = target.at(values).linearised()
    for steps in range(most_steps):
        step, expected = _step(at, 0.0)
        if 0 <= expected < tolerance * max(1.0, at.cost / target.data):
            return Minimum(values, at, expected, steps, converged=True)
        push = PUSH
        while True:
            step, predicted = _step(at, damping)
            trial = target.at(values + step)
            gain = (at.cost - trial.cost) / predicted
            if gain > 1e-3:
                break
            damping, push = push * damping, 2 * push
            if damping > MOST_DAMPING:
                return Minimum(values, at, expected, steps, converged=False)
        values = values + step
        damping = max(damping * (RELIEF if gain > 0.7 else 1.0 if gain > 0.25 else 4.0), LEAST_DAMPING)
        at = trial.linearised()
    _, expected = _step(at, 0.0)
    converged = 0 <= expected < tolerance * max(1.0, at.cost / target.data)
    return Minimum(values, at, expected, most_steps, converged)


def inverse(normal: Real) -> Real:
    """Inverse of a symmetric positive matrix, its columns scaled to one first.

    In SI units a normal matrix of joint terms has a condition number of 1e15, scaled of 1e9. What lies below rounding
    counts as rounding: a direction that nothing determines has a large variance and not a negative one.
    """
    scale = 1 / np.sqrt(np.diag(normal))
    values, vectors = np.linalg.eigh(normal * np.outer(scale, scale))
    values = np.maximum(values, values.size * np.finfo(float).eps)  # the largest is one or more
    return np.asarray((vectors / values) @ vectors.T * np.outer(scale, scale))


def _step(at: Linearised, damping: float) -> tuple[Real, float]:
    """The step for this damping, and by how much it lowers the linearised sum of squares."""
    scale = 1 / np.sqrt(np.diag(at.normal))
    scaled = at.normal * np.outer(scale, scale)
    step = scale * np.linalg.solve(scaled + damping * np.eye(scale.size), scale * at.descent)
    return step, float(step @ (2 * at.descent - at.normal @ step))
