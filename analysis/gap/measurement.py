"""The data of a diagnosis: the bench as drawn, hammer sets, points of the tester, and stated tolerances."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from enum import IntEnum, StrEnum
from functools import cached_property
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.structure.beam import Beam

Indices = NDArray[np.intp]


class Rig(StrEnum):
    """Where the joints are measured; the value is its name in documents."""

    BEAM = "inverse"
    """Under a beam that is struck."""
    TESTER = "direct"
    """In the elastomer tester."""


class Configuration(IntEnum):
    """How cylinders are mounted in the tester, and which sum of shear a and compression b it then measures."""

    COMPRESSION = 0
    """One cylinder: b."""
    SHEAR = 1
    """A pair: 2a."""
    ANGLED = 2
    """A pair at 45 degrees: a + b."""


@dataclass(frozen=True)
class DrawnJoint:
    """A joint as drawn: a lower and an upper cylinder at a node.

    Attributes:
        name: such as "I".
        node: of the beam, numbered from 1.
        inclinations: theta of Eq. (10) of the lower and the upper cylinder, rad.
        eccentricity: distance of both cylinders from the beam's axis, m; the lower one counts as negative.
        added_mass: known mass of the caps, kg.
    """

    name: str
    node: int
    inclinations: tuple[float, float]
    eccentricity: float
    added_mass: float = 0.0


@dataclass(frozen=True, eq=False)
class Drawing:
    """The bench as drawn, SI.

    Attributes:
        beam: its section, length and material.
        node_positions: (nodes,) m from the left end.
        damping_ratios: of the free beam's elastic modes; the last holds for those above.
        joints: at least one.
        accelerometer: its node and direction.
        accelerometer_mass: known, kg.
    """

    beam: Beam
    node_positions: Real
    damping_ratios: tuple[float, ...]
    joints: tuple[DrawnJoint, ...]
    accelerometer: Dof
    accelerometer_mass: float = 0.0


@dataclass(frozen=True, eq=False)
class HammerSet:
    """One roving-hammer set. Sets with the same values are equal, so that caches treat copies of a set as the set.

    Attributes:
        inputs: (rows,) points struck.
        frequency: (lines,) Hz, above zero.
        accelerance: (rows, lines) (m/s^2)/N.
        deviation: (rows, lines) standard deviation per real and imaginary part.
        peak_force: of a blow, N.
        temperature: degrees Celsius; nan where it was not recorded.
        coherence: (rows, lines) 0 to 1; None where it was not recorded.
        decay: of the exponential window that the records are stated to carry, 1/s.
        reference: (rows, lines) accelerance without the noise of the line itself; None takes it from neighbours.
        asked: number of the last rows that are asked for and were not measured in this set.
    """

    inputs: tuple[Dof, ...]
    frequency: Real
    accelerance: Complex
    deviation: Real
    peak_force: float
    temperature: float = float("nan")
    coherence: Real | None = None
    decay: float = 0.0
    reference: Complex | None = None
    asked: int = 0

    def __post_init__(self) -> None:
        expected = (len(self.inputs), self.frequency.size)
        if self.accelerance.shape != expected or self.deviation.shape != expected:
            raise AnalysisError(f"accelerances and their deviation must have shape (rows, lines) = {expected}")
        if self.coherence is not None and self.coherence.shape != expected:
            raise AnalysisError(f"coherence must have shape (rows, lines) = {expected}, or be None")
        if not self.inputs or self.frequency.size == 0 or not np.all(self.frequency > 0):
            raise AnalysisError("a hammer set needs at least one row and lines above 0 Hz")
        if not np.all(np.isfinite(self.accelerance)) or not np.all(self.deviation > 0):
            raise AnalysisError("accelerances must be finite and their standard deviation above zero")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, HammerSet) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    @cached_property
    def _digest(self) -> bytes:
        """Hash of all values."""
        values = [getattr(self, each.name) for each in fields(self)]
        digest = blake2b(repr([each for each in values if not isinstance(each, np.ndarray)]).encode(), digest_size=16)
        for each in values:
            if isinstance(each, np.ndarray):
                digest.update(np.ascontiguousarray(each).tobytes())
        return digest.digest()

    @cached_property
    def from_neighbours(self) -> Complex:
        """(rows, lines) accelerance between the two neighbours of each line, with none of its own noise.

        A relative error is a share of this. A share of the measured value would favour models that are too small: they
        leave less noise (R. W. Peelle's puzzle; G. D'Agostini, Nucl. Instrum. Methods A 346, 1994, 306-311).
        """
        if self.reference is not None:
            return self.reference
        f, y, last = self.frequency, self.accelerance, self.frequency.size - 1
        if not last:
            return y
        before, after = np.abs(np.arange(last + 1) - 1), np.minimum(np.arange(last + 1) + 1, last)
        after[-1] = last - 1
        share = np.where(after > before, (f - f[before]) / np.where(after > before, f[after] - f[before], 1.0), 0.0)
        return np.asarray(y[:, before] + share * (y[:, after] - y[:, before]))

    def lines(self, keep: NDArray[np.bool_] | Indices) -> HammerSet:
        """This set with some of its lines."""
        return replace(
            self,
            frequency=self.frequency[keep],
            accelerance=self.accelerance[:, keep],
            deviation=self.deviation[:, keep],
            coherence=None if self.coherence is None else self.coherence[:, keep],
            reference=self.from_neighbours[:, keep],
        )

    def thinned(self, lines: int) -> HammerSet:
        """This set with about `lines` of its lines, evenly spread."""
        return self.lines(np.arange(0, self.frequency.size, max(1, self.frequency.size // lines)))

    def struck_at(self, inputs: tuple[Dof, ...], frequency: Real) -> HammerSet:
        """A set struck at other points: accelerances are zero, and noise is the mean of this set's rows."""
        noise = np.interp(frequency, self.frequency, np.sqrt(np.mean(self.deviation**2, axis=0)))
        shape = len(inputs), frequency.size
        nothing = np.zeros(shape, dtype=complex)
        return replace(
            self,
            inputs=inputs,
            frequency=frequency,
            accelerance=nothing,
            deviation=np.broadcast_to(noise, shape),
            coherence=None,
            reference=None,
        )

    def rows(self, keep: NDArray[np.bool_]) -> HammerSet:
        """This set with some of its rows."""
        inputs = tuple(dof for dof, kept in zip(self.inputs, keep, strict=True) if kept)
        return replace(
            self,
            inputs=inputs,
            accelerance=self.accelerance[keep],
            deviation=self.deviation[keep],
            coherence=None if self.coherence is None else self.coherence[keep],
            reference=self.from_neighbours[keep],
        )


@dataclass(frozen=True, eq=False)
class RawBlow:
    """The record of one blow.

    Attributes:
        name: of the record, for messages.
        point: struck.
        force: (samples,) N, positive when the hammer pushes.
        acceleration: (samples,) m/s^2.
        sample_rate: Hz.
    """

    name: str
    point: Dof
    force: Real
    acceleration: Real
    sample_rate: float


@dataclass(frozen=True, eq=False)
class TesterPoints:
    """Steady sine points of the tester, in the order of measuring.

    Attributes:
        order: (points,) rank in the order of measuring.
        specimen: (points,) index of the joint in the drawing.
        configuration: (points,) of `Configuration`.
        amplitude: (points,) zero to peak, m.
        frequency: (points,) Hz.
        stiffness: (points,) k + i h, N/m.
        deviation: (points,) standard deviation per real and imaginary part, N/m.
        temperature: (points,) degrees Celsius; nan where it was not recorded.
    """

    order: Real
    specimen: Indices
    configuration: Indices
    amplitude: Real
    frequency: Real
    stiffness: Complex
    deviation: Real
    temperature: Real

    def __post_init__(self) -> None:
        if len({getattr(self, name).shape for name in self.__dataclass_fields__}) != 1 or self.order.ndim != 1:
            raise AnalysisError("columns of the tester's points differ in length")
        if not np.all(np.isfinite(self.stiffness)) or not np.all(self.deviation > 0):
            raise AnalysisError("stiffness must be finite and its standard deviation above zero at every point")

    @cached_property
    def fraction(self) -> Real:
        """(points,) progress of the test: 0 at the first point, 1 at the last."""
        first, last = np.min(self.order), np.max(self.order)
        return np.asarray((self.order - first) / max(last - first, 1.0))

    @cached_property
    def warmth(self) -> Real:
        """(points,) temperature above the mean, K; 0 where it was not recorded."""
        known = np.isfinite(self.temperature)
        mean = float(np.mean(self.temperature[known])) if known.any() else 0.0
        return np.where(known, self.temperature - mean, 0.0)

    @cached_property
    def angled(self) -> NDArray[np.bool_]:
        """(points,) whether the cylinders are an angled pair."""
        return np.asarray(self.configuration == Configuration.ANGLED)

    def only(self, keep: NDArray[np.bool_]) -> TesterPoints:
        """These points, but only those in `keep` (points,)."""
        return TesterPoints(**{name: getattr(self, name)[keep] for name in self.__dataclass_fields__})


@dataclass(frozen=True)
class SetUpTolerances:
    """Standard deviations that the laboratory states for its set-up.

    Attributes:
        node_position: of each joint and of the accelerometer along the beam, m.
        sensor_gain: of hammer and accelerometer together in each hammer set, relative.
        youngs_modulus, density: of the beam, relative.
        impact_position: of the blows of each row along the beam, on an end face above or below the axis, m.
        inclination: of both cylinders of each joint together, rad.
        tester_gain: of the tester in all configurations, relative.
        setup_scatter: of the stiffness of each joint from one set-up to another, relative; None where not stated.
        configuration_gain: of the tester's gain from one configuration to another, relative; None where not stated.
        model_error: of an accelerance, relative, coherent over neighbouring lines; None where not stated.
        blow_lean: of the mean lean of the blows of each row in the plane of the beam, rad; None where not stated.
    """

    node_position: float = 1e-3
    sensor_gain: float = 5e-3
    youngs_modulus: float = 5e-3
    density: float = 3e-3
    impact_position: float = 1.5e-3
    inclination: float = float(np.radians(0.5))
    tester_gain: float = 3e-3
    setup_scatter: float | None = None
    configuration_gain: float | None = None
    model_error: float | None = None
    blow_lean: float | None = None


@dataclass(frozen=True, eq=False)
class Measurement:
    """Measurements of one article in both rigs, of which one may be missing.

    Attributes:
        drawing: the bench as drawn.
        sets: hammer sets, the reference first; empty where the beam was not struck.
        points: of the tester, or None.
        tolerances: as stated.
        preset: mean displacement in the tester, m.
        predict: (response, input) pairs whose accelerances are asked for.
        blows: records of the single blows that were kept.
    """

    drawing: Drawing
    sets: tuple[HammerSet, ...]
    points: TesterPoints | None
    tolerances: SetUpTolerances = field(default_factory=SetUpTolerances)
    preset: float = 0.0
    predict: tuple[tuple[Dof, Dof], ...] = ()
    blows: tuple[RawBlow, ...] = ()

    def __post_init__(self) -> None:
        if not self.sets and self.points is None:
            raise AnalysisError("there is neither a hammer set nor a point of the tester: nothing to diagnose")

    def thinned(self, lines: int) -> Measurement:
        """This measurement with about `lines` lines of each hammer set, evenly spread."""
        return replace(self, sets=tuple(each.thinned(lines) for each in self.sets))
