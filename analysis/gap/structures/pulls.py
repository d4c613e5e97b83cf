"""Parameters of a simulation itself that data pull far from their priors: a gap that no effect has explained."""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.gap.parameter import Parameter
from analysis.gap.structures.likelihood import CurveFit

FAR = 3.0
"""Standard deviations of its prior beyond which a parameter is reported; what is beyond counts as misfit."""
IMPLAUSIBLE = 5.0
"""Standard deviations beyond which a gap is not explained by a parameter: its stated tolerance is wrong, or the
simulation lacks something."""


@dataclass(frozen=True)
class Pull:
    """A parameter of the simulator that is far from its prior.

    Attributes:
        parameter: its name.
        part: for a parameter that each part has for itself, which; None for one that all share.
        value, centre: fitted, and of the prior, in `unit`.
        unit: "1" where it is a ratio.
        deviations: distance in standard deviations of the prior, negative below the centre.
    """

    parameter: str
    part: str | None
    value: float
    centre: float
    unit: str
    deviations: float

    @property
    def implausible(self) -> bool:
        """Whether it is beyond `IMPLAUSIBLE` standard deviations."""
        return abs(self.deviations) > IMPLAUSIBLE


def pulls_of(fit: CurveFit) -> tuple[Pull, ...]:
    """Parameters of the simulator that are beyond `FAR` standard deviations, the farthest first."""
    likelihood = fit.likelihood
    shared = likelihood.simulator.parameters
    found = _far(shared, fit.scores[: len(shared)].tolist(), None)
    for part in likelihood.parts:
        found += _far(likelihood.simulator.local, fit.local_of(part).tolist(), part)
    return tuple(sorted(found, key=lambda each: -abs(each.deviations)))


def pull_energy(fit: CurveFit) -> float:
    """Misfit in the pulls, squared standard deviations beyond `FAR`."""
    return sum((abs(each.deviations) - FAR) ** 2 for each in pulls_of(fit))


def _far(parameters: Sequence[Parameter], scores: Sequence[float], part: str | None) -> list[Pull]:
    return [
        Pull(each.name, part, each.value(score), each.centre, each.unit, score)
        for each, score in zip(parameters, scores, strict=True)
        if abs(score) > FAR
    ]
