"""Elastomers made of many relaxations, at random, and their sweeps in a tester; not the law that is fitted."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from tests.analysis.direct.points import point

REFERENCE = 23.0
ERROR = 0.002


@dataclass(frozen=True)
class Material:
    """A drawn elastomer: `stiffness(frequency, temperature)` in N/m."""

    stiffness: Callable[[float, float], complex]

    @classmethod
    def drawn(cls, random: np.random.Generator) -> "Material":
        """25 to 44 Maxwell elements between 1 ns and 100 s, shifted by WLF and by T / T_ref."""
        count = int(random.integers(25, 45))
        times = 10 ** random.uniform(-9, 2, count)
        steeper = random.uniform(0, 0.25) / 3
        amounts = 1e6 * 10 ** random.uniform(-1.5, 0.3, count) * (times / 1e-3) ** -steeper
        c1, c2 = random.uniform(5, 12), random.uniform(70, 160)

        def stiffness(frequency: float, temperature: float) -> complex:
            warmer = temperature - REFERENCE
            x = 2j * np.pi * frequency * 10 ** (-c1 * warmer / (c2 + warmer)) * times
            return complex((temperature + 273.15) / (REFERENCE + 273.15) * (1e6 + np.sum(amounts * x / (1 + x))))

        return cls(stiffness)

    def sweeps(
        self, temperatures: Sequence[float], random: np.random.Generator, error: float = ERROR
    ) -> tuple[list[DynamicStiffness], list[float]]:
        """Twelve points from 5 to 200 Hz at each temperature, and the temperature of each."""
        points, at = [], []
        for temperature in temperatures:
            for frequency in np.geomspace(5, 200, 12).tolist():
                true = self.stiffness(frequency, temperature)
                noise = error * abs(true) * complex(*random.normal(size=2))
                points.append(point(true + noise, error, frequency))
                at.append(temperature)
        return points, at
