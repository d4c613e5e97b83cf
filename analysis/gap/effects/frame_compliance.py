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
    law = "elastic"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("c", "m/N", 0.0, 0.33e-6, least=0.0),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness / (1 + given["c"] * stiffness)


@dataclass(frozen=True)
class LossyFrame(FrameCompliance):
    """The same with loss of its own, as bolted joints and seals have it: c (1 - i loss)."""

    law = "with loss"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*super().parameters, Parameter("loss", "1", 0.0, 0.03, least=0.0))

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness / (1 + given["c"] * (1 - 1j * given["loss"]) * stiffness)
