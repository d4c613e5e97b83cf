"""The protocol of a simulator: implement it for another structure or another solver."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from analysis.frequency_response import Complex
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import Acting, StructureEffect

Values = Mapping[str, float]
"""Values of parameters, by name."""


class Simulator(Protocol):
    """Predicts curves from parameters and effects."""

    @property
    def name(self) -> str:
        """Name for reports and messages."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Parameters that all curves share, with their priors."""

    @property
    def local(self) -> Sequence[Parameter]:
        """Parameters of each part alone, such as the gain of a set-up; at their centres for an unseen part."""

    def effects(self, curves: Sequence[Curve]) -> Sequence[StructureEffect]:
        """Candidates that these curves could show."""

    def predict(self, values: Values, acting: Sequence[Acting], curve: Curve) -> Complex:
        """(n,) readings of one curve, in its units; the measured values in `curve` must not be used.

        Args:
            values: of the shared and of the part's local parameters.
            acting: effects with values of their parameters.
            curve: its observable and conditions.

        Raises:
            AnalysisError: there is no solution at these values.
        """
