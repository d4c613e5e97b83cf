"""Changes at one place of the beam that no effect of the catalogue makes: an absorber, a cable, a damper, a crack.

They are rivals of the catalogue. Where one of them alone explains a gap better than the catalogue does, the cause is in
no catalogue, whatever effect resembles it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from analysis.dof import Direction
from analysis.frequency_response import Complex
from analysis.gap.bench import BeamBench, LocalMotion, Setting
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter

LOCAL_CHANGE = "local_change"
PLACES = 7
"""Places along the beam from which a search begins, and conditions of the tester."""
SETTINGS = 9
"""Settings of the tester in a usual test: three configurations at three amplitudes."""
CHANGES = 7 * PLACES + SETTINGS + 5
"""Changes that compete, each as likely as another: four kinds on the beam and three in the tester, at every place, a
reading of the tester at every setting, a base that joints share, and joints or readings that differ from row to row or
from set to set."""
RATE = 2 * np.pi * 200.0
"""rad/s, in the middle of the usual band: there, mass, damping and stiffness of usual sizes have equal weight."""
MASS, DAMPING, STIFFNESS = 0.02, 0.01, 0.02
"""Standard deviations of a mass, damper and spring on the beam: shares of its mass, times `RATE` and `RATE`^2."""
ARM = 0.15
"""Lever arm of a mass that turns with the beam, as a share of the beam's length."""
PIECE = 0.05
"""Half the length of a piece with another bending stiffness, as a share of the beam's length."""
STIFFER, LOSSIER = 0.3, 0.1
"""Standard deviations of the piece's bending stiffness and loss factor, relative to the beam's stiffness."""


@dataclass(frozen=True)
class LocalChange(Effect):
    """Something at one place of the beam.

    Attributes:
        place: from which the search begins, as a share of the length.
        length: of the beam, m.
        mass: of the beam, kg.
        bending_stiffness: of the beam, N m^2.
    """

    id = LOCAL_CHANGE
    title = "something at one place of the beam"
    mechanism = Mechanism.BEAM
    motion: ClassVar[Direction]
    piece: ClassVar[float] = 0.0
    """Half the length of the piece that changes, as a share of the beam's length."""
    place: float = 0.5
    length: float = 1.0
    mass: float = 1.0
    bending_stiffness: float = 1.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """One variant for each place."""
        beam = measurement.drawing.beam
        mass, stiffness = beam.density * beam.area * beam.length, beam.flexural_rigidity
        return tuple(cls((n + 0.5) / PLACES, beam.length, mass, stiffness) for n in range(PLACES))

    @property
    def position(self) -> Parameter:
        """The parameter for the position of its middle."""
        return Parameter("position", "m", self.place * self.length, self.length / PLACES / 2)

    def stiffness(self, given: Given, pole: Complex) -> Complex:
        """(lines,) dynamic stiffness at `pole` (lines,)."""
        raise NotImplementedError

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        reach = self.piece * self.length
        position = float(np.clip(given["position"], reach, self.length - reach))
        return replace(
            bench,
            local=LocalMotion(self.motion, reach),
            local_stiffness=self.stiffness(given, bench.pole),
            local_position=position,
        )


class FixedAcross(LocalChange):
    """Mass, damper and spring, such as a cable that touches or a clamp; across the beam."""

    law = "a mass, damper and spring across the beam"
    motion = Direction.Y
    units: ClassVar[tuple[str, str, str]] = ("kg", "N s/m", "N/m")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        lever = 1.0 if self.motion is not Direction.ROTATION else (ARM * self.length) ** 2
        sizes = (MASS, DAMPING * RATE, STIFFNESS * RATE**2)
        own = zip(("m", "c", "k"), self.units, sizes, strict=True)
        return (*(Parameter(name, unit, 0.0, size * self.mass * lever) for name, unit, size in own), self.position)

    def stiffness(self, given: Given, pole: Complex) -> Complex:
        return np.asarray(given["k"] + given["c"] * pole + given["m"] * pole**2)


class FixedTurning(FixedAcross):
    """Mass, damper and spring against turning of the section, such as a rotary damper."""

    law = "an inertia, damper and spring against turning"
    motion = Direction.ROTATION
    units = ("kg m^2", "N m s", "N m")


class BendingPiece(LocalChange):
    """A piece of the beam bends more or less easily, or with more loss, such as a crack or a damping layer."""

    law = "a piece that bends otherwise"
    motion = Direction.ROTATION
    piece = PIECE

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        size = self.bending_stiffness / (2 * PIECE * self.length)
        own = (Parameter("k", "N m", 0.0, STIFFER * size), Parameter("h", "N m", 0.0, LOSSIER * size))
        return (*own, self.position)

    def stiffness(self, given: Given, pole: Complex) -> Complex:
        return np.full(pole.shape, given["k"] + 1j * given["h"])


class Absorber(LocalChange):
    """A mass on a spring: it moves against the beam at its own frequency."""

    law = "a mass on a spring"
    motion = Direction.Y

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("m", "kg", 0.0, MASS * self.mass, least=0.0),
            Parameter("f", "Hz", 200.0, 1.0, positive=True, starts=(-1.4, -0.7, -0.2, 0.3, 0.9, 1.6)),
            Parameter("eta", "1", 0.05, 0.7, positive=True),
            self.position,
        )

    def stiffness(self, given: Given, pole: Complex) -> Complex:
        spring = (2 * np.pi * given["f"]) ** 2 * (1 + 1j * given["eta"])
        return np.asarray(given["m"] * pole**2 * spring / (pole**2 + spring))


KINDS: Sequence[type[LocalChange]] = (FixedAcross, FixedTurning, BendingPiece, Absorber)


def local_changes(measurement: Measurement) -> tuple[Effect, ...]:
    """Every kind at every place; none where no beam was struck."""
    return tuple(each for kind in KINDS for each in kind.variants(measurement)) if measurement.sets else ()
