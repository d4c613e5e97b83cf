"""A simulator made of a Python function that the user writes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.effect import Acting, StructureEffect, properties_under, read_by
from analysis.gap.structures.simulator import Values

Predict = Callable[[Mapping[str, Any], Conditions], Complex]
"""Function that gives (n,) readings from parameters by name and conditions (n,) by name, which are read-only. Where an
effect changes a parameter from value to value, the function gets (n,) numbers for it."""


@dataclass(frozen=True)
class CallableSimulator:
    """A function with declared parameters, and effects that change these or the readings.

    Properties that effects may change are the parameters themselves.

    Attributes:
        function: of parameters and conditions.
        parameters: shared by all curves.
        candidates: effects that are tried.
        local: parameters that each part has for itself.
        name: for messages.
    """

    function: Predict
    parameters: tuple[Parameter, ...]
    candidates: tuple[StructureEffect, ...] = ()
    local: tuple[Parameter, ...] = ()
    name: str = "callable"

    def effects(self, curves: Sequence[Curve]) -> tuple[StructureEffect, ...]:
        """The effects that were given."""
        del curves
        return self.candidates

    def predict(self, values: Values, acting: Sequence[Acting], curve: Curve) -> Complex:
        """(n,) readings of a curve: the values of the function, as the effects change them."""
        found = self.function(properties_under(acting, values, curve.conditions), curve.conditions)
        return read_by(acting, np.array(found), curve)  # a copy: an effect may write into it, and the function keep it
