"""The bar bends out of plane too: blows drive it and the accelerometer sees a little of it.

A bar twice as wide as high has its first free modes on edge near 320 and 880 Hz (Fig. 9 shows peaks at 330 and 855 Hz
that no plane model explains).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.free_beam_modes import Bar, bar_of
from analysis.gap.measurement import Drawing, Measurement
from analysis.gap.parameter import Parameter

MODES, RIGID_ON_EDGE, HIGHER = 2, 2, 2


@dataclass(frozen=True)
class OutOfPlaneBending(Effect):
    """Two modes, by their shapes on the free bar; blows on the ends and blows across drive them in their own measure.

    Attributes:
        frequencies: of the free bar on edge, Hz.
        at_sensor: shapes at the accelerometer, kg^-1/2.
        at_nodes: (nodes) of shapes at each node.
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
        bar, shapes = on_edge(drawing)
        bending = np.flatnonzero(np.max(np.abs(shapes), axis=0) > 1e-6)
        lower = bending[cls._chosen(bar.free.frequency[bending])]
        return (
            cls(
                frequencies=_floats(bar.free.frequency[lower]),
                at_sensor=_floats(shapes[drawing.accelerometer.node - 1, lower]),
                at_nodes=tuple(_floats(row) for row in shapes[:, lower]),
            ),
        )

    @classmethod
    def _chosen(cls, frequency: Real) -> slice:
        """Which of the bending modes of the bar on edge, the two rigid ones first."""
        return slice(RIGID_ON_EDGE, RIGID_ON_EDGE + MODES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        found = [Parameter("coupling", "1", 0.0, 0.053), Parameter("leak", "1", 0.0, 0.3)]
        for place in range(1, MODES + 1):
            frequency = self.frequencies[self._first + place - 1]
            found.append(Parameter(f"f_{place}", "Hz", frequency * 1.01, 0.02, positive=True, starts=(-1.0, 0.0, 1.0)))
            found.append(Parameter(f"eta_{place}", "1", 0.01, 0.7, positive=True))
        return (*found, Parameter("second_over_first", "1", 1.0, 0.5))

    @property
    def _first(self) -> int:
        """Place of the first elastic mode."""
        return 0

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        along = np.array([dof.direction is Direction.X for dof in setting.inputs])
        driven = given["coupling"] * np.where(along, 1.0, given["leak"])
        added = bench.added
        for place, resonance in enumerate(self._resonances(given, bench.pole)):
            shape = np.array([self.at_nodes[dof.node - 1][place] for dof in setting.inputs])
            share = given["second_over_first"] if place == self._first + 1 else 1.0
            added = added + share * np.multiply.outer(driven * shape * self.at_sensor[place], resonance)
        return replace(bench, added=added)

    def _resonances(self, given: Given, pole: Complex) -> list[Complex]:
        """(lines,) of each mode."""
        return [_resonance(given[f"f_{place}"], given[f"eta_{place}"], pole) for place in range(1, MODES + 1)]


@dataclass(frozen=True)
class RowsOfTheirOwn(OutOfPlaneBending):
    """Two modes that each row shows in a measure of its own: a bar on joints has not the shapes of a free one.

    Attributes:
        rows: points struck.
    """

    law = "two modes, each row its own"
    rows: tuple[Dof, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        struck = {dof for each in measurement.sets for dof in each.inputs}
        return tuple(replace(each, rows=tuple(sorted(struck, key=str))) for each in super().variants(measurement))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        own = [Parameter(_own(row, place), "1", 0.0, 0.02) for row in self.rows for place in range(MODES)]
        return (*super().parameters, *own)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        added = super().beam(given, bench, setting).added
        largest = np.max(np.abs(np.array(self.at_nodes)), axis=0) * np.abs(np.array(self.at_sensor))
        for place, resonance in enumerate(self._resonances(given, bench.pole)):
            share = np.array([given.get(_own(dof, place), 0.0) for dof in setting.inputs])  # 0 where none was struck
            added = added + np.multiply.outer(share * largest[place], resonance)
        return replace(bench, added=added)


@dataclass(frozen=True)
class LowerModes(OutOfPlaneBending):
    """All lower modes of the bar on edge: it moves as a rigid body on its joints too, and bends higher up."""

    law = "lower modes"

    @classmethod
    def _chosen(cls, frequency: Real) -> slice:
        return slice(0, RIGID_ON_EDGE + MODES + HIGHER)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        on_joints = [
            parameter
            for place in range(1, RIGID_ON_EDGE + 1)
            for parameter in (
                Parameter(f"f_rigid_{place}", "Hz", 100.0, 0.4, positive=True),
                Parameter(f"eta_rigid_{place}", "1", 0.1, 0.7, positive=True),
            )
        ]
        return (*super().parameters, *on_joints)

    @property
    def _first(self) -> int:
        return RIGID_ON_EDGE

    def _resonances(self, given: Given, pole: Complex) -> list[Complex]:
        rigid = [_resonance(given[f"f_rigid_{n}"], given[f"eta_rigid_{n}"], pole) for n in (1, 2)]
        higher = [_resonance(f, 0.01, pole) for f in self.frequencies[RIGID_ON_EDGE + MODES :]]
        return [*rigid, *super()._resonances(given, pole), *higher]


def on_edge(drawing: Drawing) -> tuple[Bar, Real]:
    """The bar turned by 90 degrees, and (nodes, N) its shapes across the plane of the paper's model."""
    turned = replace(drawing.beam, height=drawing.beam.width, width=drawing.beam.height)
    bar = bar_of(replace(drawing, beam=turned))
    return bar, np.array([bar.motion(Direction.Y, float(x)) for x in drawing.node_positions])


def _own(row: Dof, place: int) -> str:
    return f"row_{row}_{place + 1}"


def _floats(values: Real) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _resonance(frequency: float, loss: float, pole: Complex) -> Complex:
    """(lines,) receptance of a mode of unit mass."""
    return np.asarray(1 / ((2 * np.pi * frequency) ** 2 * (1 + 1j * loss) + pole**2))
