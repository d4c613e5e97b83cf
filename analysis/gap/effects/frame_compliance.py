"""The tester's frame gives way in series with the specimen: 1/k + c, up to 0.5 um/N for a light frame."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import TesterPoints
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class FrameCompliance(Effect):
    """Compliance of the tester's frame."""

    id = "frame_compliance"
    title = "compliance of the tester's frame"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("c", "m/N", 0.0, 0.33e-6, least=0.0),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness / (1 + given["c"] * stiffness)
