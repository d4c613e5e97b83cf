"""The shape of a gap that no law explains: a smooth complex function at one place of the beam rig or of the tester.

The function is a Gaussian process over frequency, order or amplitude, known by its heights at a few knots. On the beam
it is added to the closest local change at one place (`local_change`), which takes up any sharp resonance. Size and
length of correlation are those of the highest marginal likelihood.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from analysis.dof import Direction
from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Configuration, Measurement, TesterPoints
from analysis.gap.outside_catalogue.local_change import ARM, MASS, RATE, STIFFER, BendingPiece, LocalChange
from analysis.gap.parameter import Parameter

KNOTS = 8
LENGTH = 0.3
"""Length of correlation to begin with, as a share of the range of the function's coordinate."""
SIZE = 0.1
"""Standard deviation to begin with, of a relative reading or of a stiffness over `BeamShape.unit_stiffness`."""
LOW = 100.0
"""Hz, from which the logarithm of frequency counts and below which frequency itself does."""


@dataclass(frozen=True)
class Smooth:
    """A complex Gaussian process with real and imaginary part alike, of zero mean.

    Attributes:
        first, last: ends of its coordinate.
        length: of correlation, as a share of that range.
        size: standard deviation of each part.
    """

    first: float
    last: float
    length: float = LENGTH
    size: float = SIZE

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Two parameters for each knot, independent of each other in the prior."""
        return tuple(Parameter(f"{part}_{n}", "1", 0.0, 1.0) for part in ("real", "imaginary") for n in range(KNOTS))

    def basis(self, coordinate: Real) -> Real:
        """(..., KNOTS) matrix that gives heights from the parameters of either part."""
        knots = np.linspace(0.0, 1.0, KNOTS)
        place = (np.clip(coordinate, self.first, self.last) - self.first) / (self.last - self.first)
        factor = np.linalg.cholesky(self._kernel(knots, knots) + 1e-6 * np.eye(KNOTS))
        return np.asarray(self.size * np.linalg.solve(factor, self._kernel(knots, place)).T)

    def _kernel(self, one: Real, other: Real) -> Real:
        return np.asarray(np.exp(-(((one[:, None] - other) / self.length) ** 2) / 2))

    def at(self, given: Given, coordinate: Real) -> Complex:
        """(n,) the function at `coordinate` (n,)."""
        real, imaginary = ([given[f"{part}_{n}"] for n in range(KNOTS)] for part in ("real", "imaginary"))
        return np.asarray(self.basis(coordinate) @ (np.array(real) + 1j * np.array(imaginary)))


@dataclass(frozen=True)
class Shape(Effect):
    """A smooth function at one place.

    Attributes:
        smooth: the function.
    """

    id = "shape"
    title = "a smooth function at one place"
    mechanism = Mechanism.BEAM
    unit: ClassVar[str] = "1"
    smooth: Smooth = field(default_factory=lambda: Smooth(0.0, 1.0))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.smooth.parameters


def over_frequency(frequency: Real) -> Real:
    """Coordinate of frequencies, Hz."""
    return np.asarray(np.log1p(frequency / LOW))


@dataclass(frozen=True)
class BeamShape(Shape):
    """Dynamic stiffness at one place of the beam, N/m, or N m where it turns.

    Attributes:
        change: the local change that the function is added to; it has the place.
    """

    law = "a dynamic stiffness at one place of the beam"
    change: LocalChange = field(default_factory=LocalChange)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*self.change.parameters, *self.smooth.parameters)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        changed = self.change.beam(given, bench, setting)
        return replace(changed, local_stiffness=self.stiffness(given, bench.pole))

    def unit_stiffness(self, pole: Complex) -> Real:
        """(lines,) stiffness that the function multiplies: a usual share of the beam's own there."""
        change = self.change
        if isinstance(change, BendingPiece):
            return np.full(pole.shape, STIFFER * change.bending_stiffness / (2 * change.piece * change.length))
        lever = (ARM * change.length) ** 2 if change.motion is Direction.ROTATION else 1.0
        return np.asarray(MASS * change.mass * lever * (RATE**2 + np.abs(pole) ** 2))

    def stiffness(self, given: Given, pole: Complex) -> Complex:
        """(lines,) dynamic stiffness of the local change and the function together."""
        frequency = np.abs(pole.imag) / (2 * np.pi)
        smooth = self.smooth.at(given, over_frequency(frequency))
        return self.change.stiffness(given, pole) + self.unit_stiffness(pole) * smooth


@dataclass(frozen=True)
class ChainShape(Shape):
    """The reading of the accelerometer over the hammer's, relative: over frequency, of all sets or one.

    Attributes:
        of_set: index of the one; None for all.
    """

    law = "the reading of the measuring chain"
    mechanism = Mechanism.MEASURING_CHAIN
    of_set: int | None = None

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, chain=bench.chain * (1 + self.relative(given, setting)))

    def relative(self, given: Given, setting: Setting) -> Complex:
        """(rows or 1, lines or 1) relative change of the reading."""
        found = self.smooth.at(given, over_frequency(setting.frequency))[None]
        return found if self.of_set is None else (setting.state == self.of_set)[:, None] * found


@dataclass(frozen=True)
class ChainOverRows(ChainShape):
    """`ChainShape` over the points in the order in which they were struck.

    Attributes:
        points: of the reference set, in order.
    """

    law = "the reading of the measuring chain, point by point"
    points: tuple[str, ...] = ()

    def relative(self, given: Given, setting: Setting) -> Complex:
        place = [self.points.index(str(dof)) if str(dof) in self.points else 0 for dof in setting.inputs]
        return self.smooth.at(given, np.array(place, dtype=float))[:, None]


@dataclass(frozen=True)
class JointOverSets(Shape):
    """The stiffness of a joint, relative, from one hammer set to the next.

    Attributes:
        joint: index of the joint.
    """

    law = "the stiffness of a joint from set to set"
    mechanism = Mechanism.JOINT_STATE
    joint: int = 0

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        changed = np.array(joints)
        changed[:, :, self.joint] *= 1 + self.smooth.at(given, np.arange(float(len(joints))))[:, None, None, None]
        return changed


@dataclass(frozen=True)
class TesterShape(Shape):
    """The tester's reading, relative, in all configurations or one.

    Attributes:
        configuration: the one; None for all.
    """

    law = "the reading of the tester over frequency"
    mechanism = Mechanism.TESTER
    configuration: Configuration | None = None

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        here = self.configuration is None or points.configuration == self.configuration
        return np.asarray(stiffness * (1 + here * self.smooth.at(given, self.coordinate(points))))

    @staticmethod
    def coordinate(points: TesterPoints) -> Real:
        """(points,) what the function depends on."""
        return over_frequency(points.frequency)


class TesterOverOrder(TesterShape):
    """`TesterShape` over the order of measuring, 0 to 1."""

    law = "the reading of the tester during the test"

    @staticmethod
    def coordinate(points: TesterPoints) -> Real:
        return points.fraction


class TesterOverAmplitude(TesterShape):
    """`TesterShape` over the logarithm of amplitude, m."""

    law = "the reading of the tester over amplitude"

    @staticmethod
    def coordinate(points: TesterPoints) -> Real:
        return np.asarray(np.log(points.amplitude))


def shapes_of_readings(measurement: Measurement, by_set: bool = True) -> Iterator[Shape]:
    """Smooth functions of the measuring chain, of joints from set to set and of the tester that could show.

    Args:
        measurement: in which they could show.
        by_set: whether the joints have one state for each hammer set, as they have where no effect follows motion.
    """
    sets, points = measurement.sets, measurement.points
    if sets:
        smooth = Smooth(*_ends(over_frequency(sets[0].frequency)))
        yield ChainShape(smooth)
        alike = {(each.frequency.tobytes(), each.decay) for each in sets}
        if by_set and len(sets) > 1 and len(alike) == 1:
            yield from (ChainShape(smooth, of_set=number) for number in range(len(sets)))
            over_sets = Smooth(0.0, len(sets) - 1.0)
            yield from (JointOverSets(over_sets, joint) for joint in range(len(measurement.drawing.joints)))
        if len(sets[0].inputs) > 2:
            struck = tuple(map(str, sets[0].inputs))
            yield ChainOverRows(Smooth(0.0, len(struck) - 1.0), points=struck)
    if points is not None:
        for kind in (TesterShape, TesterOverOrder, TesterOverAmplitude):
            first, last = _ends(kind.coordinate(points))
            used = sorted({Configuration(int(each)) for each in points.configuration}) if kind is TesterShape else []
            if last > first:
                yield from (kind(Smooth(first, last), each) for each in (None, *(used if len(used) > 1 else ())))


def shape_at(change: LocalChange, measurement: Measurement) -> BeamShape:
    """A smooth function on top of a change at one place of the beam."""
    return BeamShape(Smooth(*_ends(over_frequency(measurement.sets[0].frequency))), change=change)


@dataclass(frozen=True, eq=False)
class FoundShape:
    """A function at the place where it helps most.

    Attributes:
        place: keys and values that name it, SI.
        quantity, unit: of the function.
        over: coordinate that it depends on: frequency (Hz), order (0 to 1), amplitude (m), point (in the order struck)
            or set.
        at: (n,) values of that.
        value: (n,).
        low, high: (n,) ends of the 90 % band of the real and of the imaginary part.
        before, after: gap on held-out data without and with the function in the model, percent; of its rig.
        resembles: something simple; empty where it does not.
    """

    place: Mapping[str, str | float]
    quantity: str
    unit: str
    over: str
    at: Real
    value: Complex
    low: Complex
    high: Complex
    before: float
    after: float
    resembles: str


def _ends(values: Real) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))
