"""A mesh that is too coarse: ten elements put the third free mode of the paper's bar 0.19 % high."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class MeshError(Effect):
    """Squared free frequencies are off by a share that grows with them; `third_mode` is that of the third."""

    id = "mesh_error"
    title = "mesh of the simulation"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("third_mode", "1", 0.0, 0.0025),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, mesh=bench.mesh + given["third_mode"])
