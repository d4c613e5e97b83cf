"""A joint whose foundation gives way: in series with k_f (1 + i eta) - w^2 m_f, resonant at 30 to 1500 Hz."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter

ACROSS = ((0.0,), (1.0,), (0.0,))
BOTH_WAYS = ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0))


@dataclass(frozen=True)
class FoundationCompliance(Effect):
    """The foundation of one joint moves across the bar.

    Attributes:
        joint: its place in the drawing.
    """

    id = "foundation_compliance"
    title = "foundation that gives way"
    law = "across the bar"
    joint: int = 0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return tuple(cls(place) for place in range(len(measurement.drawing.joints)))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("f", "Hz", 200.0, 1.0, positive=True, starts=(-1.4, -0.7, -0.2, 0.3, 0.9, 1.6)),
            Parameter("k_f", "N/m", 1.5e7, 1.0, positive=True, starts=(0.0, 2.5)),
            Parameter("eta", "1", 0.05, 0.7, positive=True),
        )

    @property
    def _ways(self) -> np.ndarray:
        return np.array(ACROSS)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        stiffness = given["k_f"]
        mass = stiffness / (2 * np.pi * given["f"]) ** 2
        foundation = stiffness * (1 + 1j * given["eta"]) + pole**2 * mass
        changed = np.repeat(joints, pole.size // len(joints), axis=0)
        z, ways = changed[:, self.joint], self._ways
        base = ways.T @ z @ ways + foundation[:, None, None] * np.eye(ways.shape[1])
        changed[:, self.joint] = z - z @ ways @ np.linalg.solve(base, ways.T @ z)
        return changed


@dataclass(frozen=True)
class FoundationBothWays(FoundationCompliance):
    """The foundation of one joint moves across and along the bar alike."""

    law = "across and along the bar"

    @property
    def _ways(self) -> np.ndarray:
        return np.array(BOTH_WAYS)
