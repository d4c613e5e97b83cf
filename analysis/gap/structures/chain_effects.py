"""Effects of sensors and cables: the reading differs from the true response."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.effect import Given, Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import StructureEffect


def chain_effects(curves: Sequence[Curve]) -> tuple[StructureEffect, ...]:
    """The effects of this file that complex curves over frequency could show."""
    seen = any(each.is_complex and "frequency" in each.conditions for each in curves)
    return (Delay(), GainSlope()) if seen else ()


class Delay(StructureEffect):
    """The response is read with a delay."""

    id = "time_delay"
    title = "a delay between the channels"
    mechanism = Mechanism.MEASURING_CHAIN
    form_is_known = True
    needs = frozenset({"frequency"})
    own_parameters = (Parameter("delay", "s", 0.0, 1e-3),)

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        """The readings, turned by the phase -w delay; real ones, such as amplitudes, have no phase."""
        if not curve.is_complex:
            return values
        return np.asarray(values * np.exp(-2j * np.pi * curve.conditions["frequency"] * given["delay"]))


class GainSlope(StructureEffect):
    """The sensitivity changes with frequency."""

    id = "gain_slope"
    title = "a sensitivity that changes with frequency"
    mechanism = Mechanism.MEASURING_CHAIN
    needs = frozenset({"frequency"})
    own_parameters = (Parameter("per_decade", "1", 0.0, 0.1),)

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        """The readings times a gain that is one at the geometric mean of the frequencies, and at 0 Hz."""
        frequency = np.abs(curve.conditions["frequency"])
        logarithms = np.log10(np.where(frequency > 0, frequency, 1.0))
        decades = np.where(frequency > 0, logarithms - logarithms.sum() / max(1, np.count_nonzero(frequency)), 0.0)
        return np.asarray(values * (1 + given["per_decade"] * decades))
