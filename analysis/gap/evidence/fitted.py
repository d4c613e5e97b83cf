"""The common part of fitted models of any structure: scores with a standard normal prior, and a cost about them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.evidence.residual_structure import Misfit
from analysis.gap.parameter import Parameter
from analysis.inverse.levenberg_marquardt import Linearised, inverse


class Target(Protocol):
    """A likelihood that was maximised."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Parameters of the bench and of the effects: the first of the unknowns, in order."""

    @property
    def log_normalisation(self) -> float:
        """Log normalisation of its density, where that differs between models of the same data."""

    @property
    def data(self) -> int:
        """Number of real values, each with a square of about one where the model holds."""


T = TypeVar("T", bound=Target, covariant=True)


@dataclass(frozen=True, eq=False)
class Fitted(Generic[T]):
    """The most likely parameters of one model.

    Attributes:
        likelihood: that was maximised.
        scores: (unknowns,).
        at: the normal equations at `scores`.
        converged: whether one more step would gain less than the tolerance.
    """

    likelihood: T
    scores: Real
    at: Linearised
    converged: bool

    @property
    def chi_square(self) -> float:
        """Chi-square without the priors."""
        return self.at.cost - float(self.scores @ self.scores)

    @property
    def per_datum(self) -> float:
        """Chi-square per real or imaginary part."""
        return self.chi_square / self.likelihood.data

    @property
    def cost_per_datum(self) -> float:
        """Chi-square with the priors, per real or imaginary part: 1 in the mean of right models.

        A wrong model can leave little of the data, at the cost of tolerances far beyond what is stated.
        """
        return self.at.cost / self.likelihood.data

    @cached_property
    def covariance(self) -> Real:
        """(unknowns, unknowns) of the scores."""
        return inverse(self.at.normal)

    @property
    def deviations(self) -> Real:
        """(unknowns,) standard deviations of the scores."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def value(self, name: str) -> float:
        """The value of a parameter of the bench or of an effect."""
        for parameter, score in zip(self.likelihood.parameters, self.scores, strict=False):
            if parameter.name == name:
                return float(np.real(parameter.value(float(score))))
        raise KeyError(name)


class AnyEffect(Protocol):
    """The properties of an effect that a verdict needs; `analysis.gap.effect.Effect` explains each."""

    @property
    def id(self) -> str:
        """Name in its catalogue."""

    @property
    def law(self) -> str:
        """Name of the law."""

    @property
    def law_free(self) -> bool:
        """Whether it is a smooth function in place of a law."""

    @property
    def mechanism(self) -> str:
        """The mechanism that it belongs to."""

    @property
    def form_is_known(self) -> bool:
        """Whether a real bench follows it exactly."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Its parameters, with their plausible ranges."""

    @property
    def expected(self) -> float:
        """Probability that it acts, by what instruments beside the data show; 0 where they say nothing of it."""


class AnyModel(Protocol):
    """The properties of a fitted model that a verdict needs."""

    @property
    def effects(self) -> Sequence[AnyEffect]:
        """The effects that it has."""

    @property
    def ids(self) -> Sequence[str]:
        """Ids of its effects."""

    @property
    def fit(self) -> Fitted[Any]:
        """Its most likely parameters."""

    @property
    def overdispersed_fit(self) -> Fitted[Any] | None:
        """The fit with chi-square divided by the overdispersion of a contest; None where it was not fitted again."""

    def fit_with(self, overdispersion: float) -> Fitted[Any]:
        """The fit with chi-square divided by an overdispersion."""

    @property
    def misfit(self) -> Misfit:
        """The misfit beyond noise."""

    @property
    def log_evidence(self) -> float:
        """Log evidence with noise alone."""

    def log_predictive_density(self, overdispersion: float) -> float:
        """Log density of parts of the data that are left out in turn."""

    def places(self, effect: int) -> range:
        """Indices, among the parameters, of those of one of its effects."""
