"""How much an experiment is expected to tell about which explanation is true.

Each explanation expects Gaussian data of an experiment: a mean, and a covariance of noise and of whatever it does not
know. The mutual information of explanation and data is the entropy that the data take away in the mean (D. V. Lindley,
Ann. Math. Statist. 27, 1956, 986-1005). It has no closed form for a mixture. Data are drawn from each explanation
within the few dimensions in which they differ; in all others they are the same noise, which tells nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from analysis.frequency_response import Real

DRAWS, LEAST_DRAWS = 1000, 50
"""Data drawn from an explanation of a probability of one half or more, and the fewest from any; in between their number
is in proportion to the probability. The information is then known to about 0.03 bit, the same each time."""
SEED = 20
BIT = float(np.log(2.0))


@dataclass(frozen=True, eq=False)
class Expectation:
    """The data that one explanation expects, in standard deviations of their noise.

    Attributes:
        probability: of the explanation before the data; all of them sum to one.
        mean: (data,).
        spread: (k, data) by which each of k independent unknowns of unit variance moves the data.
    """

    probability: float
    mean: Real
    spread: Real


def entropy(probabilities: Sequence[float]) -> float:
    """Entropy of explanations with these probabilities, bits."""
    given = np.array([each for each in probabilities if each > 0])
    return float(-np.sum(given * np.log(given))) / BIT


def expected_information(expected: Sequence[Expectation], draws: int = DRAWS) -> float:
    """Bits that the data are expected to tell: from nothing to the whole entropy."""
    seen = _ReducedExpectations(tuple(expected))
    random = np.random.default_rng(SEED)
    unit = random.standard_normal((draws, seen.basis.shape[0]))
    nats = 0.0
    for own, each in enumerate(expected):
        drawn = unit[: max(LEAST_DRAWS, round(2 * each.probability * draws))]
        logs = seen.log_posterior(seen.means[own] + drawn @ seen.factors[own].T)
        nats += each.probability * float(np.mean(logs[own] - np.log(each.probability)))
    return float(np.clip(nats / BIT, 0.0, entropy([each.probability for each in expected])))


def log_posterior(expected: Sequence[Expectation], data: Real) -> Real:
    """(explanations,) logarithms of the probabilities after `data` (data,), in standard deviations of their noise.

    They are finite where a probability is too small for a number.
    """
    seen = _ReducedExpectations(tuple(expected))
    return np.asarray(seen.log_posterior((seen.basis @ (data - expected[0].mean))[None])[:, 0])


@dataclass(frozen=True, eq=False)
class _ReducedExpectations:
    """Expectations within the dimensions in which they differ, about the mean of the first."""

    expected: tuple[Expectation, ...]

    @cached_property
    def basis(self) -> Real:
        """(r, data) orthonormal basis of these dimensions."""
        first = self.expected[0].mean
        means = [each.mean[None] - first for each in self.expected]
        whole = np.concatenate([*means, *(each.spread for each in self.expected)])
        return np.asarray(np.linalg.qr(whole.T)[0].T)

    @cached_property
    def means(self) -> list[Real]:
        """(r,) mean of each expectation."""
        return [np.asarray(self.basis @ (each.mean - self.expected[0].mean)) for each in self.expected]

    @cached_property
    def factors(self) -> list[Real]:
        """(r, r) Cholesky factor of each covariance."""
        unit = np.eye(len(self.basis))
        parts = [self.basis @ each.spread.T for each in self.expected]
        return [np.asarray(np.linalg.cholesky(unit + part @ part.T)) for part in parts]

    def log_posterior(self, data: Real) -> Real:
        """(explanations, n) for `data` (n, r)."""
        logs = []
        for each, mean, factor in zip(self.expected, self.means, self.factors, strict=True):
            left = solve_triangular(factor, (data - mean).T, lower=True)
            density = -np.sum(left**2, axis=0) / 2 - np.sum(np.log(np.diag(factor)))
            logs.append(density + np.log(each.probability))
        found = np.array(logs)
        return np.asarray(found - logsumexp(found, axis=0))
