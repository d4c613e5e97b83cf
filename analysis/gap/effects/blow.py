"""Effects of how the hammer strikes."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


def _struck(measurement: Measurement) -> tuple[Dof, ...]:
    """Points that were struck."""
    return tuple(sorted({dof for each in measurement.sets for dof in each.inputs}, key=str))


class ImpactAngle(Effect):
    """Transverse blows lean by the same few degrees, and part of their force pulls along the axis."""

    id = "impact_angle"
    title = "blows that lean"
    mechanism = Mechanism.BLOW
    law = "transverse blows, at the axis"
    own_parameters = (Parameter("angle_deg", "deg", 0.0, 2.7),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        leaning = np.array([self.leans(dof) for dof in setting.inputs], dtype=float)
        return replace(bench, lean=bench.lean + leaning * given["angle_deg"] * np.pi / 180)

    def leans(self, dof: Dof) -> bool:
        """Whether blows at a point lean."""
        return dof.direction is Direction.Y

    def bent(self, measurement: Measurement) -> Effect | None:
        return ScatteredLean.variants(measurement)[0]


@dataclass(frozen=True)
class SurfaceBlows(ImpactAngle):
    """Transverse blows lean by the same angle and act at the surface, half the beam's height off the axis."""

    law = "transverse blows, at the surface"
    height: float = 0.0

    def bent(self, measurement: Measurement) -> None:
        return None

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(measurement.drawing.beam.height / 2),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(super().beam(given, bench, setting), strike_height=self.height)


class AllBlows(ImpactAngle):
    """All blows lean by the same angle; on the ends of the beam, part of their force acts across it."""

    law = "all blows"

    def leans(self, dof: Dof) -> bool:
        return True

    def bent(self, measurement: Measurement) -> Effect | None:
        return ScatteredLean(_struck(measurement), all_blows=True)


@dataclass(frozen=True)
class BlowsAtOnePoint(ImpactAngle):
    """Blows lean at one `point`, which is hard to reach."""

    law = "blows at one point"
    point: Dof | None = None

    def bent(self, measurement: Measurement) -> None:
        return None

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return tuple(cls(point) for point in _struck(measurement))

    def leans(self, dof: Dof) -> bool:
        return dof == self.point


@dataclass(frozen=True)
class ImpactPosition(Effect):
    """Points struck across the beam lie up to 8 mm beside their marks, the same in every hammer set."""

    id = "impact_position"
    title = "points struck beside their marks"
    mechanism = Mechanism.BLOW
    law = "each point its own"
    form_is_known = True
    nodes: tuple[int, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        nodes = {dof.node for each in measurement.sets for dof in each.inputs if dof.direction is Direction.Y}
        return (cls(tuple(sorted(nodes))),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"shift_{node}", "m", 0.0, 0.004) for node in self.nodes)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        shift = np.array(
            [given.get(f"shift_{dof.node}", 0.0) if dof.direction is Direction.Y else 0.0 for dof in setting.inputs]
        )
        return replace(bench, blow_offset=bench.blow_offset + shift)


class DoubleHit(Effect):
    """The hammer bounces: a second contact a few milliseconds after the first.

    It shows in the records of blows (`analysis.gap.faults.removal`) and is found there before anything is
    fitted. H1 divides by the force of both contacts: accelerances stay right, and lose coherence where the force
    spectrum has its ripples.
    """

    id = "double_hit"
    title = "double hits of the hammer"
    mechanism = Mechanism.BLOW
    law = "found in records"
    own_parameters = (Parameter("ratio", "1", 0.0, 0.4, least=0.0),)


@dataclass(frozen=True)
class ScatteredLean(ImpactAngle):
    """Transverse blows lean by a common angle, and at each point by a little more or less.

    Attributes:
        points: points struck; only those across the beam unless all blows lean.
        all_blows: whether blows along the beam lean, too.
    """

    law = "each point about a mean"
    points: tuple[Dof, ...] = ()
    all_blows: bool = False

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(tuple(dof for dof in _struck(measurement) if dof.direction is Direction.Y)),)

    def bent(self, measurement: Measurement) -> None:
        return None

    def leans(self, dof: Dof) -> bool:
        return self.all_blows or super().leans(dof)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*self.own_parameters, *(Parameter(f"more_at_{dof}_deg", "deg", 0.0, 1.0) for dof in self.points))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        leaning = super().beam(given, bench, setting)
        more = [given.get(f"more_at_{dof}_deg", 0.0) for dof in setting.inputs]
        return replace(leaning, lean=leaning.lean + np.radians(more))


@dataclass(frozen=True)
class EachBlowItsOwn(Effect):
    """At every point, blows have their own angle and their own distance from the mark.

    Attributes:
        points: struck.
    """

    id = "blow"
    title = "blows that differ from point to point"
    mechanism = Mechanism.BLOW
    law = "each point its own"
    law_free = True
    points: tuple[Dof, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(_struck(measurement)),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        leans = tuple(Parameter(f"lean_{dof}_deg", "deg", 0.0, 2.5) for dof in self.points)
        across = [dof for dof in self.points if dof.direction is Direction.Y]
        return (*leans, *(Parameter(f"shift_{dof}", "m", 0.0, 0.004) for dof in across))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        lean = np.radians([given.get(f"lean_{dof}_deg", 0.0) for dof in setting.inputs])
        shift = np.array([given.get(f"shift_{dof}", 0.0) for dof in setting.inputs])
        return replace(bench, lean=bench.lean + lean, blow_offset=bench.blow_offset + shift)
