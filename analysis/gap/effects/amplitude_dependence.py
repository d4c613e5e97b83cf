"""Stiffness that falls and loss that peaks with amplitude, as filled rubber does (Payne's effect)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter

MIDDLE = 25e-6
"""m, zero to peak, at which stiffness and loss keep the values that the baseline gives them."""
BLOW_AMPLITUDE = Parameter("x_100", "m", 3e-6, 1.0, positive=True)
"""Zero to peak at a joint under blows of 100 N, if it is one for all lines."""


@dataclass(frozen=True)
class AmplitudeDependence(Effect):
    """Kraus' law, one amplitude for all lines of a hammer set (G. Kraus, J. Appl. Polym. Sci. 39, 1984, 75-92)."""

    id = "amplitude_dependence"
    title = "stiffness and loss that follow amplitude"
    law = "Kraus"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("k0_over_kinf", "1", 2.0, 0.4, positive=True),
            Parameter("xc", "m", 25e-6, 0.9, positive=True, starts=(-0.5, 0.7)),
            Parameter("m", "1", 0.55, 0.2, positive=True),
            Parameter("loss_peak", "1", 1.0, 0.7),
            BLOW_AMPLITUDE,
        )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = self._amplitude(given, loading)
        storage, loss = self._law(given, amplitude)
        unit, unit_loss = self._law(given, np.array([MIDDLE]))
        return cylinders.scaled(storage / unit, loss / unit_loss)

    def _amplitude(self, given: Given, loading: Loading) -> Real:
        """(n,) zero to peak, m."""
        if loading.tester:
            return loading.amplitude
        return np.full(loading.frequency.size, given["x_100"] * loading.level)

    def _law(self, given: Given, amplitude: Real) -> tuple[Real, Real]:
        """(n,) k' and k'' in units of their own."""
        size = np.exp(given["m"] * np.log(amplitude / given["xc"]))
        storage = 1 + (given["k0_over_kinf"] - 1) / (1 + size**2)
        return storage, 1 + 2 * given["loss_peak"] * size / (1 + size**2)


@dataclass(frozen=True)
class AmplitudeByMode(AmplitudeDependence):
    """Kraus' law, with an amplitude under the beam that falls with frequency as displacement does."""

    law = "Kraus, amplitude by line"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*super().parameters, Parameter("fall", "1", 1.0, 0.7))

    def _amplitude(self, given: Given, loading: Loading) -> Real:
        if loading.tester:
            return loading.amplitude
        falling = np.exp(-given["fall"] * np.log(loading.frequency / 100.0))
        return np.asarray(given["x_100"] * loading.level * falling)


@dataclass(frozen=True)
class AmplitudeTable(Effect):
    """No law at all: a factor on stiffness and one on loss for each amplitude of the tester and each hammer level.

    Attributes:
        amplitudes: of the tester, m, without the one in the middle that the others are compared with.
        levels: of the hammer.
    """

    id = "amplitude_dependence"
    title = "stiffness and loss that follow amplitude"
    law = "table"
    amplitudes: tuple[float, ...] = ()
    levels: tuple[float, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        levels = sorted({each.peak_force for each in measurement.sets})
        points = measurement.points
        found = [] if points is None else sorted({float(x) for x in points.amplitude})
        middle = len(found) // 2
        amplitudes = [x for place, x in enumerate(found) if place != middle]
        return (cls(tuple(amplitudes), tuple(level / 100.0 for level in levels[0 if found else 1 :])),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        names = [f"{x * 2e3:g}mm" for x in self.amplitudes] + [f"{100 * level:g}N" for level in self.levels]
        return tuple(Parameter(f"{part}_{name}", "1", 0.0, 0.35) for name in names for part in ("storage", "loss"))

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        count = loading.frequency.size
        storage, loss = np.zeros((2, count), dtype=complex)
        if loading.tester:
            chosen = [(f"{x * 2e3:g}mm", np.isclose(loading.amplitude, x)) for x in self.amplitudes]
        else:
            chosen = [(f"{100 * x:g}N", np.full(count, np.isclose(loading.level, x))) for x in self.levels]
        for name, here in chosen:
            storage = storage + here * given[f"storage_{name}"]
            loss = loss + here * given[f"loss_{name}"]
        return cylinders.scaled(np.exp(storage), np.exp(loss))
