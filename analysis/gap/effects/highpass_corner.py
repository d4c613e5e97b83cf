"""A high-pass corner of the acceleration channel, 0.1 to 5 Hz: IEPE supplies couple by a capacitor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class HighpassCorner(Effect):
    """A first-order corner, i w / (i w + w_c)."""

    id = "highpass_corner"
    title = "high-pass corner of the acceleration channel"
    law = "first order"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("corner", "Hz", 0.8, 1.0, positive=True, starts=(-0.5, 1.0)),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, chain=bench.chain * bench.pole / (bench.pole + 2 * np.pi * given["corner"]))


@dataclass(frozen=True)
class SecondOrderCorner(HighpassCorner):
    """Two stages in a row, charge amplifier and input."""

    law = "second order"

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        corner = 2 * np.pi * given["corner"]
        passed = bench.pole**2 / (bench.pole**2 + np.sqrt(2) * corner * bench.pole + corner**2)
        return replace(bench, chain=bench.chain * passed)
