"""Loss that depends on frequency while stiffness does not: h proportional to w^p, viscous at p = 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter

REFERENCE = 100.0
"""Hz, about the middle of what the tester sees."""
SHEAR, COMPRESSION = ((1.0,), (0.0,), (0.0,)), ((0.0,), (1.0,), (1.0,))


@dataclass(frozen=True)
class LossLaw(Effect):
    """One power for all mechanisms."""

    id = "loss_law"
    title = "loss that follows frequency"
    law = "power"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("p", "1", 0.0, 0.6),)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        return cylinders.scaled(1.0, np.exp(given["p"] * np.log(loading.frequency / REFERENCE)))


@dataclass(frozen=True)
class LossLawOfEach(LossLaw):
    """A power for shear and another for compression, with which rotation goes."""

    law = "powers of shear and compression"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("p_shear", "1", 0.0, 0.6), Parameter("p_compression", "1", 0.0, 0.6))

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        powers = given["p_shear"] * np.array(SHEAR) + given["p_compression"] * np.array(COMPRESSION)
        return cylinders.scaled(1.0, np.exp(powers * np.log(loading.frequency / REFERENCE)))


@dataclass(frozen=True)
class PartViscous(LossLaw):
    """A part of the loss is viscous: 1 + q (f / 100 Hz - 1), of shear and of compression."""

    law = "viscous part"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("q_shear", "1", 0.0, 0.5), Parameter("q_compression", "1", 0.0, 0.5))

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        share = given["q_shear"] * np.array(SHEAR) + given["q_compression"] * np.array(COMPRESSION)
        return cylinders.scaled(1.0, 1 + share * (loading.frequency / REFERENCE - 1))
