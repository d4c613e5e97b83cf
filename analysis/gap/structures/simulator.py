"""The protocol of a simulator: implement it for another structure or another solver."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from analysis.frequency_response import Complex
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import Acting, StructureEffect

Values = Mapping[str, float]
"""Of parameters, by name."""


class Simulator(Protocol):
    """Predicts curves from parameters and effects."""

    @property
    def name(self) -> str:
        """For reports and messages."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Shared by all curves, with their priors."""

    @property
    def local(self) -> Sequence[Parameter]:
        """That each part has for itself, such as the gain of a set-up; a part that was not seen has their centres."""

    def effects(self, curves: Sequence[Curve]) -> Sequence[StructureEffect]:
        """Candidates that these curves could show."""

    def predict(self, values: Values, acting: Sequence[Acting], curve: Curve) -> Complex:
        """(n,) readings of one curve, in its units; its own values are not to be looked at.

        Args:
            values: of the shared and of the part's local parameters.
            acting: effects with values of their parameters.
            curve: its observable and conditions.

        Raises:
            AnalysisError: there is no solution at these values.
        """
