"""Another temperature in the tester than under the beam: stiffness and loss scale, within 10 K."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter

SOFTENING = Parameter("softening", "1/K", 0.008, 0.5, positive=True)
"""Of stiffness. Filled natural rubber about room temperature: 0.5 to 1 % (ISO 18437-4 has shifts like that)."""


@dataclass(frozen=True)
class TemperatureShift(Effect):
    """In the tester it is warmer by delta_t: stiffness falls by a share per K, loss by a multiple of that.

    How much a rubber softens is known to a factor; how much warmer it is, no better than that.
    """

    id = "temperature_shift"
    title = "another temperature in each rig"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("delta_t", "K", 0.0, 6.7), Parameter("loss_ratio", "1", 2.0, 1.0), SOFTENING)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        if not loading.tester:
            return cylinders
        softer = given["softening"] * given["delta_t"]
        return cylinders.scaled(np.exp(-softer), np.exp(-softer * given["loss_ratio"]))
