"""Cylinders that are stiffer under the tester's preset than under the beam: 0.2 to 1 per mm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class PreloadStiffening(Effect):
    """Stiffness grows with the preset, loss does not.

    Attributes:
        preset_mm: of the tester.
    """

    id = "preload_stiffening"
    title = "stiffening under the tester's preset"
    law = "stiffness alone"
    preset_mm: float = 0.5

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(measurement.preset * 1e3 or 0.5),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("s", "1/mm", 0.0, 0.67),)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        more = given["s"] * self.preset_mm
        return cylinders.scaled(1 + more, 1 + self.loss_share(given) * more) if loading.tester else cylinders

    def loss_share(self, given: Given) -> float:
        """What loss grows by, over what stiffness grows by."""
        return 0.0


@dataclass(frozen=True)
class PreloadWithLoss(PreloadStiffening):
    """Stiffness and loss grow alike."""

    law = "stiffness and loss alike"

    def loss_share(self, given: Given) -> float:
        return 1.0


@dataclass(frozen=True)
class PreloadWithSomeLoss(PreloadStiffening):
    """Loss grows by a share of what stiffness grows by."""

    law = "loss by a share"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*super().parameters, Parameter("loss_share", "1", 0.5, 0.25))

    def loss_share(self, given: Given) -> float:
        return given["loss_share"]
