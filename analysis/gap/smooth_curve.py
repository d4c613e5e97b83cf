"""Smooth functions in place of a law: heights at a few knots, over the logarithm of what they depend on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyval

from analysis.frequency_response import Real
from analysis.gap.effect import Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class SmoothCurve:
    """A polynomial in the logarithm through heights at `knots`, constant outside of them.

    Attributes:
        knots: at which the heights are the parameters.
        zero: a further place, at which the curve is zero; None where there is no such place.
    """

    knots: tuple[float, ...]
    zero: float | None = None

    def parameters(self, name: str, spread: float) -> tuple[Parameter, ...]:
        """A height for each knot, with the standard deviation of its prior."""
        return tuple(Parameter(f"{name}_{knot:g}", "1", 0.0, spread, height=True) for knot in self.knots)

    def at(self, given: Given, name: str, places: Real) -> Real:
        """Heights at `places` of any shape."""
        return self.along(given, name, self.logarithm(places))

    def logarithm(self, places: Real) -> Real:
        """Logarithm of `places`, limited to the knots, for `along`; several curves over the same places share it."""
        return np.asarray(np.log(np.clip(places, min(self._known), max(self._known)) / self._known[0]))

    def along(self, given: Given, name: str, logarithm: Real) -> Real:
        """Heights at places that are given by their `logarithm`."""
        heights = [given[f"{name}_{knot:g}"] for knot in self.knots] + [0.0] * (self.zero is not None)
        powers = np.log(np.array(self._known) / self._known[0])[:, None] ** np.arange(len(self._known))
        return np.asarray(polyval(logarithm, np.linalg.solve(powers, heights)))

    @property
    def _known(self) -> tuple[float, ...]:
        return self.knots if self.zero is None else (*self.knots, self.zero)
