"""What a further effect promises: the gain of one step of a fit that is linearised about a model without it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from analysis.frequency_response import Real
from analysis.gap.fit import Likelihood


@dataclass(frozen=True, eq=False)
class LinearStep:
    """A model linearised about its fit, ready to take in further columns.

    Attributes:
        known: (unknowns, data) whitened derivatives in all unknowns.
        factor: of known known^T + 1.
        scores: (unknowns,).
        cost: chi-square with priors.
    """

    known: Real
    factor: Real
    scores: Real
    cost: float

    @classmethod
    def about(cls, likelihood: Likelihood, scores: Real) -> LinearStep:
        """A model about `scores` (unknowns,)."""
        shared, left = likelihood.columns(scores, range(len(likelihood.simulation.shared)))
        known = np.concatenate([shared, likelihood.own_columns(scores)])
        factor = np.linalg.cholesky(known @ known.T + np.eye(len(known)))
        return cls(known, np.asarray(factor, dtype=np.float64), scores, float(left @ left + scores @ scores))

    def gain(self, columns: Real, start: Real, left: Real) -> float:
        """By how much a step in all unknowns and further ones would lower the cost.

        Args:
            columns: (further, data) whitened derivatives.
            start: (further,) their scores.
            left: (data,) whitened residual there.
        """
        solved = solve_triangular(self.factor, self.known @ columns.T, lower=True)
        known = solve_triangular(self.factor, self.known @ left - self.scores, lower=True)
        reduced = columns @ columns.T + np.eye(len(columns)) - solved.T @ solved
        along = columns @ left - start - solved.T @ known
        lowered = known @ known + along @ np.linalg.solve(reduced, along)
        return float(self.cost - (left @ left + self.scores @ self.scores + start @ start - lowered))
