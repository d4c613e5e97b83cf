"""The test article as it was built: the beam, its two joints of two cylinders each, and the accelerometer."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from simlab.beam import Real, SimulatedBeam
from simlab.coupling import Complex
from simlab.elastomer import REFERENCE_TEMPERATURE, SimulatedCylinder

NODE_POSITIONS = (0.0, *(0.0595 + 0.099375 * i for i in range(9)), 0.914)
"""Nodes 1 to 11 of the paper's drawing, m from the left end."""
JOINT_NODES = {"I": 2, "II": 10}
JOINT_NAMES = tuple(JOINT_NODES)
SENSOR_NODE = 3
INCLINATIONS_DEG = {"I": (-45.0, 135.0), "II": (45.0, -135.0)}
"""Theta of Eq. (10) of the lower and the upper cylinder on the drawing."""
ECCENTRICITIES = (-0.006, 0.006)
"""Where the lower and the upper cylinder hold the beam on the drawing, m above its axis."""
TERMS_BETWEEN_KINKS = 24
"""Terms of the beam's series between neighbouring joints and accelerometer: exact to 8 kHz, to 1e-4 (m/s^2)/N."""

TOLERANCES = {
    "node_position": 0.001,
    "sensor_gain": 0.005,
    "youngs_modulus": 0.005,
    "density": 0.003,
    "impact_position": 0.0015,
    "inclination_deg": 0.5,
    "tester_gain": 0.003,
}
"""Uncertainties of the drawing, one standard deviation; nothing is off by more than two."""


@dataclass(frozen=True)
class SimulatedJoint:
    """Two cylinders, lower and upper, that hold the beam at one place.

    Attributes:
        position: m from the left end.
        cylinders: the lower and the upper one.
        inclinations_deg: theta of Eq. (10) of each cylinder.
        lean_deg: how far both cylinders stand off that, towards the vertical, in the stand and in the tester.
        shift: m by which both hold the beam above the drawing.
        splay_deg: how far the upper cylinder leans further than the lower one.
    """

    position: float
    cylinders: tuple[SimulatedCylinder, SimulatedCylinder]
    inclinations_deg: tuple[float, float]
    lean_deg: float = 0.0
    shift: float = 0.0
    splay_deg: float = 0.0

    def local(self) -> Real:
        """(2, 3, 3) shear, compression and turn of the lower and the upper cylinder for unit x, y, rotation.

        The point of the section at some height above the axis moves by minus that height times the rotation in x.
        """
        sense = -math.copysign(1.0, self.inclinations_deg[0])
        found = []
        for upper, (inclination, arm) in enumerate(zip(self.inclinations_deg, ECCENTRICITIES, strict=True)):
            angle = np.radians(inclination + sense * (self.lean_deg + upper * self.splay_deg))
            height, cos, sin = arm + self.shift, np.cos(angle), np.sin(angle)
            found.append([[cos, sin, -height * cos], [-sin, cos, height * sin], [0.0, 0.0, 1.0]])
        return np.array(found)

    def matrix(self, cylinders: Complex) -> Complex:
        """(n, 3, 3) dynamic stiffness at the beam's axis in x, y and rotation, N/m, N, N m.

        `cylinders` (2, n, 3) are those of both cylinders in shear, compression and rotation.
        """
        total = np.zeros((cylinders.shape[1], 9), dtype=np.complex128)
        for own, local in zip(cylinders, self.local(), strict=True):
            total += own @ (local[:, :, None] * local[:, None, :]).reshape(3, 9)
        return total.reshape(-1, 3, 3)

    def dynamic_stiffness(
        self, amplitude: ArrayLike, frequency: ArrayLike, temperature: float = REFERENCE_TEMPERATURE
    ) -> Complex:
        """(n, 3, 3) k + ih as `matrix`, the cylinders deformed by `amplitude` () or (n,) m at `frequency` (n,) Hz."""
        lines = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
        return self.matrix(np.array([each.dynamic_stiffness(amplitude, lines, temperature) for each in self.cylinders]))


def lateral_stiffness(cylinders: Complex) -> Complex:
    """(n, 2, 2) k + ih out of plane, sideways and in rotation: both `cylinders` (2, n, 3) in shear, and turning."""
    total = np.zeros((cylinders.shape[1], 2, 2), dtype=np.complex128)
    total[:, 0, 0], total[:, 1, 1] = cylinders[:, :, 0].sum(axis=0), cylinders[:, :, 2].sum(axis=0)
    return total


@dataclass(frozen=True)
class SimulatedArticle:
    """The beam as it is, its joints by name, and the accelerometer.

    Attributes:
        sensor_position: m from the left end.
        loss_factor: structural loss of the beam beside its damping ratios.
        damping_scale: factor on the beam's damping ratios.
        cross_axis: share of the motion out of plane that the accelerometer takes for motion in y.
        kinks: m from the left end, where the beam has kinks besides those at joints and accelerometer.
    """

    beam: SimulatedBeam
    joints: dict[str, SimulatedJoint]
    sensor_position: float
    loss_factor: float = 0.0
    damping_scale: float = 1.0
    cross_axis: float = 0.0
    kinks: tuple[float, ...] = ()


def with_kinks(article: SimulatedArticle) -> SimulatedArticle:
    """The same article, its beam exact where it has kinks: at the joints, at the accelerometer, and at its own.

    One series over the whole beam is too stiff there: to an exact model that looks like a gram at the accelerometer.
    """
    places = {article.sensor_position, *(joint.position for joint in article.joints.values()), *article.kinks}
    return replace(article, beam=replace(article.beam, terms=TERMS_BETWEEN_KINKS, kinks=tuple(sorted(places))))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def clipped_normal(rng: np.random.Generator, deviation: float, count: int | tuple[int, ...] | None = None) -> Real:
    """Normal numbers of a standard deviation, none beyond two of them."""
    return np.asarray(deviation * np.clip(rng.standard_normal(count), -2.0, 2.0))


def clipped_variance(deviation: float) -> float:
    """Variance of the numbers of `clipped_normal`."""
    within, density = math.erf(math.sqrt(2.0)), math.exp(-2.0) / math.sqrt(2.0 * math.pi)
    return deviation**2 * (within - 4.0 * density + 4.0 * (1.0 - within))


def off_nominal(rng: np.random.Generator, scale: float = 1.0, nominal: SimulatedBeam | None = None) -> SimulatedBeam:
    """The beam of the drawing, by default the paper's, its modulus and density off by `scale` times the tolerances."""
    nominal = nominal or SimulatedBeam()
    modulus, density = (scale * TOLERANCES[name] for name in ("youngs_modulus", "density"))
    return replace(
        nominal,
        youngs_modulus=nominal.youngs_modulus * (1 + float(clipped_normal(rng, modulus))),
        density=nominal.density * (1 + float(clipped_normal(rng, density))),
    )
