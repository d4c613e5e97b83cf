"""Effects of the beam, its mesh, and the accelerometer on it."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter
from analysis.gap.smooth_curve import SmoothCurve


class YoungsModulus(Effect):
    """Young's modulus is off: handbooks of steels differ by 3 %."""

    id = "youngs_modulus"
    title = "Young's modulus off"
    mechanism = Mechanism.BEAM
    form_is_known = True
    own_parameters = (Parameter("relative", "1", 0.0, 0.02),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, modulus=bench.modulus + given["relative"])


class Density(Effect):
    """Density is off: steels, and the true section of a beam, differ by up to 2 %."""

    id = "density"
    title = "density off"
    mechanism = Mechanism.BEAM
    form_is_known = True
    own_parameters = (Parameter("relative", "1", 0.0, 0.0133),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, density=bench.density + given["relative"])


class MeshError(Effect):
    """The mesh is too coarse: squared free frequencies are off by a share that grows with them.

    `third_mode` is that share for the third free mode; with ten elements the paper's frequency is 0.19 % too high.
    """

    id = "mesh_error"
    title = "mesh of the simulation"
    mechanism = Mechanism.BEAM
    own_parameters = (Parameter("third_mode", "1", 0.0, 0.0025),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, mesh=bench.mesh + given["third_mode"])


ETA = Parameter("eta", "1", 0.0, 0.0067, least=0.0)
REFERENCE = 200.0
"""Hz, at which a loss factor that follows frequency has the value `eta`."""


class BeamDamping(Effect):
    """Cables, bolts and coatings damp the beam, up to 1 %: a loss factor that is the same at all frequencies."""

    id = "beam_damping"
    title = "damping in the beam"
    mechanism = Mechanism.BEAM
    law = "structural"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (ETA,)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, loss=bench.loss + given["eta"])


class DampingFollowingFrequency(BeamDamping):
    """A loss factor that is a power of frequency: 1 for a viscous material, -1 for drag."""

    law = "power of frequency"
    own_parameters = ETA, Parameter("power", "1", 0.0, 0.5)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, loss=bench.loss + given["eta"] * (setting.frequency / REFERENCE) ** given["power"])


BESIDE_ETA = SmoothCurve((50.0, 100.0, 450.0, 900.0), zero=REFERENCE)
"""Logarithm of a loss factor over the one at `REFERENCE`, by frequency in Hz."""


class DampingAlongCurve(BeamDamping):
    """A loss factor that is any positive function of frequency: what damps one mode need not damp the next."""

    law = "any curve over frequency"
    own_parameters = (ETA, *BESIDE_ETA.parameters("log_share", 0.5))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        share = np.exp(BESIDE_ETA.at(given, "log_share", setting.frequency))
        return replace(bench, loss=bench.loss + given["eta"] * share)


class DampingOfModes(BeamDamping):
    """Every mode gains the same damping ratio, half of a loss factor at its resonance."""

    law = "a ratio more for each mode"

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, ratio=bench.ratio + given["eta"] / 2)


@dataclass(frozen=True)
class MoreFreeDamping(BeamDamping):
    """All damping ratios of the free beam grow in proportion.

    Attributes:
        highest: damping ratio of the highest modes in the drawing, which gains half the loss factor.
    """

    law = "ratios in proportion"
    highest: float = 1.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        ratios = measurement.drawing.damping_ratios
        return (cls(highest=ratios[-1]),) if np.any(np.asarray(ratios[-1:]) > 0) else ()

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, damping=bench.damping + given["eta"] / 2 / self.highest)


class AccelerometerMass(Effect):
    """The accelerometer's mass, which the model leaves out: 2 to 40 g with its base and cable."""

    id = "accelerometer_mass"
    title = "mass of the accelerometer"
    mechanism = Mechanism.BEAM
    law = "mass alone"
    form_is_known = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("m", "kg", 0.0, 0.027, least=0.0),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, sensor_mass=bench.sensor_mass + given["m"])


class AccelerometerWithCable(AccelerometerMass):
    """`AccelerometerMass` with a cable, held beside the beam, that damps it a little: some tenths of N s/m."""

    law = "with a cable that damps"
    own_parameters = (*AccelerometerMass.own_parameters, Parameter("c", "N s/m", 0.0, 0.2, least=0.0))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(super().beam(given, bench, setting), sensor_damping=bench.sensor_damping + given["c"])


@dataclass(frozen=True)
class ElementAboveTheAxis(Effect):
    """Mixin before a law: the accelerometer's element sits above the beam, and moves along it as the beam turns.

    Attributes:
        surface: height of the beam's surface above its axis, m; an element is some 8 mm above its base.
    """

    surface: float = 0.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(measurement.drawing.beam.height / 2),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*super().parameters, Parameter("height", "m", self.surface + 0.008, 0.006))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(super().beam(given, bench, setting), sensor_height=given["height"])


class AccelerometerOnTheSurface(ElementAboveTheAxis, AccelerometerWithCable):
    """`AccelerometerWithCable` above the beam's axis."""

    law = "above the axis"


OVER_MODES = SmoothCurve((60.0, 130.0, 260.0, 480.0, 900.0))


class BeamOverFrequency(Effect):
    """Any smooth modulus and loss over frequency: each mode has a frequency and a loss of its own."""

    id = "beam"
    title = "another beam"
    mechanism = Mechanism.BEAM
    law = "smooth curve"
    law_free = True
    own_parameters = (*OVER_MODES.parameters("modulus", 0.02), *OVER_MODES.parameters("loss", 0.006))

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        modulus, loss = (OVER_MODES.at(given, name, setting.frequency) for name in ("modulus", "loss"))
        return replace(bench, loss=bench.loss + loss - 1j * modulus)  # of the complex modulus 1 + i loss
