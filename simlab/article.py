"""The test article as it was built: bar, joints and accelerometer, each a little off the drawing.

What a lab does not know better than its tolerances is drawn by seed: half a tolerance is one standard deviation, and
nothing is off by more than one tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simlab.beam import Bar, Real
from simlab.elastomer import REFERENCE_TEMPERATURE, Complex, Cylinder, Elastomer, scattered

NODE_POSITIONS = (0.0, *(0.0595 + 0.099375 * i for i in range(9)), 0.914)
"""The drawing's nodes 1 to 11, m from the left end; the joints are at 2 and 10."""
JOINT_NODES = {"I": 2, "II": 10}
SENSOR_NODE = 3
INCLINATIONS_DEG = {"I": (-45.0, 135.0), "II": (45.0, -135.0)}
ECCENTRICITY = 0.006
TERMS_BETWEEN_KINKS = 24
"""Of the bar's series from each joint, and from the accelerometer, to the next: exact to 8 kHz, to 1e-4 (m/s^2)/N."""
CYLINDERS = {
    "I": Cylinder(shear=0.36e6, compression=2.30e6, rotation=18.0),
    "II": Cylinder(shear=0.49e6, compression=2.70e6, rotation=22.0),
}

TOLERANCES = {
    "youngs_modulus": 0.005,
    "density": 0.003,
    "node_position": 0.001,
    "inclination_deg": 0.5,
}


@dataclass(frozen=True)
class Joint:
    """Two cylinders, lower and upper, that hold the bar at one place.

    Attributes:
        position: m from the left end.
        inclinations_deg: theta of Eq. (10) of each cylinder.
        eccentricities: where each takes hold, m above the neutral axis.
    """

    position: float
    inclinations_deg: tuple[float, float]
    eccentricities: tuple[float, float]
    cylinders: tuple[Cylinder, Cylinder]

    def dynamic_stiffness(
        self, amplitude: float, frequency: ArrayLike, temperature: float = REFERENCE_TEMPERATURE
    ) -> Complex:
        """(..., 3, 3) k + ih at the bar's axis in x, y and rotation (N/m, N, N m) for frequencies (...) in Hz."""
        total = np.zeros((*np.shape(frequency), 3, 3), dtype=np.complex128)
        for cylinder, angle, arm in zip(self.cylinders, self.inclinations_deg, self.eccentricities, strict=True):
            cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
            # deformation across (shear), along (compression) and about the cylinder for a unit x, y, rotation of the
            # section: the point at height `arm` moves by -arm times the rotation in x
            local = np.array([[cos, sin, -arm * cos], [-sin, cos, arm * sin], [0.0, 0.0, 1.0]])
            outer = (local[:, :, None] * local[:, None, :]).reshape(3, 9)
            total += (cylinder.dynamic_stiffness(amplitude, frequency, temperature) @ outer).reshape(total.shape)
        return total

    def lateral_stiffness(
        self, amplitude: float, frequency: ArrayLike, temperature: float = REFERENCE_TEMPERATURE
    ) -> Complex:
        """(..., 2, 2) k + ih out of plane, sideways and in rotation: both cylinders in shear, and turning."""
        total = np.zeros((*np.shape(frequency), 2, 2), dtype=np.complex128)
        for cylinder in self.cylinders:
            local = cylinder.dynamic_stiffness(amplitude, frequency, temperature)
            total[..., 0, 0] += local[..., 0]
            total[..., 1, 1] += local[..., 2]
        return total


@dataclass(frozen=True)
class Article:
    """Bar, joints I and II, and where the accelerometer really is (m from the left end)."""

    bar: Bar
    joints: dict[str, Joint]
    sensor_position: float

    @property
    def elastomer(self) -> Elastomer:
        """The same cylinders, for the tester."""
        return Elastomer({name: joint.cylinders for name, joint in self.joints.items()})


def draw_article(seed: int, tolerances: float = 1.0) -> Article:
    """Build the article of `seed`; `tolerances` scales everything drawn, 0 gives the drawing itself."""
    rng = np.random.default_rng([seed, 1])

    def off(name: str, count: int = 1) -> Real:
        return tolerances * TOLERANCES[name] * np.clip(0.5 * rng.standard_normal(count), -1, 1)

    nominal = Bar()
    youngs_modulus = nominal.youngs_modulus * (1 + float(off("youngs_modulus")[0]))
    density = nominal.density * (1 + float(off("density")[0]))
    joints = {}
    for name, node in JOINT_NODES.items():
        lower, upper = np.array(INCLINATIONS_DEG[name]) + off("inclination_deg", 2)
        joints[name] = Joint(
            position=NODE_POSITIONS[node - 1] + float(off("node_position")[0]),
            inclinations_deg=(float(lower), float(upper)),
            eccentricities=(-ECCENTRICITY, ECCENTRICITY),
            cylinders=(scattered(CYLINDERS[name], rng, tolerances), scattered(CYLINDERS[name], rng, tolerances)),
        )
    sensor = NODE_POSITIONS[SENSOR_NODE - 1] + float(off("node_position")[0])
    bar = Bar(
        youngs_modulus=youngs_modulus,
        density=density,
        terms=TERMS_BETWEEN_KINKS,
        kinks=tuple(sorted([sensor, *(joint.position for joint in joints.values())])),
    )
    return Article(bar, joints, sensor)
