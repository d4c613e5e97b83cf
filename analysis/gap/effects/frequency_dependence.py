"""Stiffness and loss that depend on frequency together, as causality ties them (Kramers-Kronig)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter

REFERENCE = 50.0
"""Hz at which stiffness keeps the value that the baseline gives it."""
RELAXATIONS = (2.0, 8.0, 30.0, 100.0, 350.0, 1200.0, 4500.0)
"""Hz; broad enough for any smooth law over the rigs' five to thousand."""
FEW = (10.0, 80.0, 600.0)
"""Hz where relaxations of their own places are looked for first."""


@dataclass(frozen=True)
class FrequencyDependence(Effect):
    """A series of relaxations (Prony): any causal law that is smooth over a factor of four in frequency."""

    id = "frequency_dependence"
    title = "stiffness and loss that follow frequency"
    law = "relaxations"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        places = range(1, len(RELAXATIONS) + 1)
        return tuple(Parameter(f"g_{place}", "1", 0.03, 1.2, positive=True) for place in places)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        storage, loss = self._modulus(given, loading.frequency)
        unit, _ = self._modulus(given, np.array([REFERENCE]))
        storage, loss = storage / unit, loss / unit
        return Cylinders(
            np.asarray(cylinders.storage * storage - cylinders.loss * loss),
            np.asarray(cylinders.loss * storage + cylinders.storage * loss),
        )

    def _modulus(self, given: Given, frequency: Real) -> tuple[Real, Real]:
        """(n,) storage and loss over the stiffness at rest."""
        places, strength = self._relaxations(given)
        ratio = frequency / places[:, None]
        return 1 + strength @ (ratio**2 / (1 + ratio**2)), strength @ (ratio / (1 + ratio**2))

    def _relaxations(self, given: Given) -> tuple[Real, Real]:
        """(n,) Hz, and their strengths over the stiffness at rest."""
        return np.array(RELAXATIONS), np.array([given[parameter.name] for parameter in self.parameters])


@dataclass(frozen=True)
class FewRelaxations(FrequencyDependence):
    """Three relaxations that sit wherever they sit, far apart or close: sharper than a series with fixed places."""

    law = "three relaxations"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            parameter
            for number, frequency in enumerate(FEW, start=1)
            for parameter in (
                Parameter(f"g_{number}", "1", 0.1, 1.0, positive=True),
                Parameter(f"f_{number}", "Hz", frequency, 0.8, positive=True),
            )
        )

    def _relaxations(self, given: Given) -> tuple[Real, Real]:
        places = range(1, len(FEW) + 1)
        return np.array([given[f"f_{n}"] for n in places]), np.array([given[f"g_{n}"] for n in places])


@dataclass(frozen=True)
class FractionalZener(FrequencyDependence):
    """(1 + B (i w tau)^alpha) / (1 + C (i w tau)^alpha) (R. L. Bagley, P. J. Torvik, J. Rheology 27, 1983)."""

    law = "fractional Zener"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("ratio", "1", 1.6, 0.5, positive=True),
            Parameter("f", "Hz", 150.0, 1.5, positive=True, starts=(-1.0, 0.5)),
            Parameter("alpha", "1", 0.45, 0.35, positive=True),
        )

    def _modulus(self, given: Given, frequency: Real) -> tuple[Real, Real]:
        alpha, ratio = given["alpha"], given["ratio"]
        size = np.exp(alpha * np.log(frequency / given["f"]))
        turn = alpha * np.pi / 2
        real, imaginary = size * np.cos(turn), size * np.sin(turn)
        below = (1 + real) ** 2 + imaginary**2
        return (
            ((1 + ratio * real) * (1 + real) + ratio * imaginary**2) / below,
            (ratio - 1) * imaginary / below,
        )


@dataclass(frozen=True)
class SpringPot(FrequencyDependence):
    """A spring beside a spring-pot: 1 + g (i f / 100 Hz)^alpha."""

    law = "spring-pot"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("g", "1", 0.0, 0.3), Parameter("alpha", "1", 0.35, 0.4, positive=True))

    def _modulus(self, given: Given, frequency: Real) -> tuple[Real, Real]:
        alpha = given["alpha"]
        size = given["g"] * np.exp(alpha * np.log(frequency / 100.0))
        return 1 + size * np.cos(alpha * np.pi / 2), size * np.sin(alpha * np.pi / 2)
