"""The bar bends out of plane too: blows drive it and the accelerometer sees a little of it.

A bar twice as wide as high has its first free modes on edge near 320 and 880 Hz (Fig. 9 shows peaks at 330 and 855 Hz
that no plane model explains).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.dof import Direction
from analysis.gap.bar import bar_of
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter

MODES = 2


@dataclass(frozen=True)
class OutOfPlaneBending(Effect):
    """Two modes, by their shapes on the free bar; blows on the ends and blows across drive them in their own measure.

    Attributes:
        frequencies: of the free bar on edge, Hz.
        at_sensor: shapes at the accelerometer, kg^-1/2.
        at_nodes: (modes) of shapes at each node.
    """

    id = "out_of_plane_bending"
    title = "bending out of plane"
    law = "two modes"
    frequencies: tuple[float, ...] = ()
    at_sensor: tuple[float, ...] = ()
    at_nodes: tuple[tuple[float, ...], ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        drawing = measurement.drawing
        on_edge = replace(drawing.beam, height=drawing.beam.width, width=drawing.beam.height)
        bar = bar_of(replace(drawing, beam=on_edge))
        places = drawing.node_positions
        shapes = np.array([bar.motion(Direction.Y, float(x)) for x in places])
        rigid = np.max(np.abs(shapes), axis=0) < 1e-6
        elastic = np.flatnonzero((bar.free.squared_frequency > 1.0) & ~rigid)[:MODES]
        return (
            cls(
                tuple(float(f) for f in bar.free.frequency[elastic]),
                tuple(float(v) for v in shapes[drawing.accelerometer.node - 1, elastic]),
                tuple(tuple(float(v) for v in shapes[:, mode]) for mode in elastic),
            ),
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        found = [Parameter("coupling", "1", 0.0, 0.053), Parameter("leak", "1", 0.0, 0.3)]
        for place, frequency in enumerate(self.frequencies, start=1):
            found.append(Parameter(f"f_{place}", "Hz", frequency * 1.01, 0.02, positive=True, starts=(-1.0, 0.0, 1.0)))
            found.append(Parameter(f"eta_{place}", "1", 0.01, 0.7, positive=True))
        return (*found, Parameter("second_over_first", "1", 1.0, 0.5))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        along = np.array([dof.direction is Direction.X for dof in setting.inputs])
        driven = given["coupling"] * np.where(along, 1.0, given["leak"])
        added = bench.added
        share = 1.0
        for place, (at_sensor, at_nodes) in enumerate(zip(self.at_sensor, self.at_nodes, strict=True), start=1):
            shape = np.array([at_nodes[dof.node - 1] for dof in setting.inputs])
            square = (2 * np.pi * given[f"f_{place}"]) ** 2
            resonance = 1 / (square * (1 + 1j * given[f"eta_{place}"]) + bench.pole**2)
            added = added + share * np.multiply.outer(driven * shape * at_sensor, resonance)
            share = given["second_over_first"]
        return replace(bench, added=added)
