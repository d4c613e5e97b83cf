"""The unknowns: parameters with Gaussian priors, and their estimates with intervals."""

from dataclasses import dataclass
from math import exp, inf, log


@dataclass(frozen=True)
class Parameter:
    """A parameter and its Gaussian prior.

    A score z counts standard deviations from the centre: the value is centre + spread z, or centre exp(spread z) for
    one that is positive by nature.

    Attributes:
        name: as in the catalogue of effects, or of the bench.
        unit: "1" where it is a ratio.
        centre: of the prior.
        spread: its standard deviation; of the natural logarithm where `positive`.
        positive: whether it cannot change sign.
        least: values below are impossible, such as masses below zero; the prior then is the half above.
        starts: scores from which a search begins.
        height: whether it is the height of a smooth curve at one of its knots.
        form: whether it says which form a law has, such as an exponent, and not how large its effect is.
    """

    name: str
    unit: str
    centre: float
    spread: float
    positive: bool = False
    least: float = -inf
    starts: tuple[float, ...] = (0.0,)
    height: bool = False
    form: bool = False

    @property
    def kind(self) -> str:
        """The name without what follows in brackets, such as a joint."""
        return self.name.partition("(")[0]

    def value(self, score: float) -> float:
        """The value at a score."""
        return self.centre * exp(self.spread * score) if self.positive else self.centre + self.spread * score

    def relative(self, score: float) -> float:
        """Change of the score for a relative change of a size, to first order; zero for a parameter that is no size.

        A size is positive by nature, or it is zero without the effect. A position is no size, and neither is a ratio
        with a prior about one.
        """
        if self.positive:
            return 1 / self.spread if self.spread else 0.0
        return score if self.centre == 0.0 else 0.0

    def score(self, value: float) -> float:
        """The score of a value; zero where nothing differs from the centre."""
        if not self.spread:
            return 0.0
        return log(value / self.centre) / self.spread if self.positive else (value - self.centre) / self.spread


@dataclass(frozen=True)
class ParameterEstimate:
    """A parameter of an effect with its 90 % interval."""

    value: float
    ci90: tuple[float, float]
    unit: str
