"""Dry friction beside the elastomer: 4 F_c / (pi x) on the loss, with F_c of 0.1 to 5 N."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.effects.amplitude_dependence import BLOW_AMPLITUDE
from analysis.gap.parameter import Parameter

TRANSLATION = np.array([[1.0], [1.0], [0.0]])


@dataclass(frozen=True)
class CoulombFriction(Effect):
    """Each cylinder rubs, in shear as in compression."""

    id = "coulomb_friction"
    title = "dry friction"
    law = "at each cylinder"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("F_c", "N", 0.0, 3.3, least=0.0), BLOW_AMPLITUDE)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = (
            loading.amplitude if loading.tester else np.full(loading.frequency.size, given["x_100"] * loading.level)
        )
        return Cylinders(
            cylinders.storage,
            np.asarray(cylinders.loss + self._rubbing(cylinders) * given["F_c"] * 4 / (np.pi * amplitude)),
        )

    def _rubbing(self, cylinders: Cylinders) -> Complex:
        return TRANSLATION


@dataclass(frozen=True)
class FrictionLikeStiffness(CoulombFriction):
    """Friction in proportion to how stiff a mechanism is, compression taken as one."""

    law = "in proportion to stiffness"

    def _rubbing(self, cylinders: Cylinders) -> Complex:
        return np.asarray(cylinders.storage / cylinders.storage[:, 1:2])
