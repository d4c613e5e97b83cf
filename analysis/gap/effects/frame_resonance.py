"""The tester's frame resonates at 250 to 800 Hz and magnifies what is read below: 1 / (1 - (f / f_r)^2)."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import TesterPoints
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class FrameResonance(Effect):
    """Resonance of the tester's frame."""

    id = "frame_resonance"
    title = "resonance of the tester's frame"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("f_r", "Hz", 450.0, 0.5, positive=True, starts=(0.0, 1.2)),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness / (1 - (points.frequency / given["f_r"]) ** 2)
