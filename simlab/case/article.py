"""The test article of a case: the bar on its two joints, each two like cylinders (Eqs. 8-11 of the paper)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simlab.assembly import Complex
from simlab.beam import Bar, Real

JOINT_NAMES = ("I", "II")
JOINT_NODES = {"I": 2, "II": 10}
SENSOR_NODE = 3
NODES = 11
INCLINATIONS_DEG = {"I": (-45.0, 135.0), "II": (45.0, -135.0)}
"""Theta of Eq. (10) of the lower and the upper cylinder on the drawing."""
ECCENTRICITIES = (-0.006, 0.006)

TOLERANCES = {
    "node_position": 0.001,
    "sensor_gain": 0.005,
    "youngs_modulus": 0.005,
    "density": 0.003,
    "impact_position": 0.0015,
    "inclination_deg": 0.5,
    "tester_gain": 0.003,
}
"""One standard deviation of what the lab admits not to know; nothing is off by more than two."""

TYPICAL = {"I": (0.36e6, 2.30e6), "II": (0.49e6, 2.70e6)}
"""Shear and compression stiffness of one cylinder, N/m, from which a sample is up to 18 % off."""


@dataclass(frozen=True)
class Joint:
    """Where two like cylinders, lower and upper, hold the bar, and how.

    Attributes:
        position: m from the left end.
        shear, compression, rotation: a, b (N/m) and c (N m) of one cylinder, k (1 + i gamma).
        lean_deg: how far both cylinders stand off the drawing, towards the vertical.
        shift: m by which both take hold above the drawing.
    """

    position: float
    shear: complex
    compression: complex
    rotation: complex
    lean_deg: float = 0.0
    shift: float = 0.0

    @property
    def cylinder(self) -> Complex:
        """(3,) shear, compression and rotation of one cylinder."""
        return np.array([self.shear, self.compression, self.rotation])


@dataclass(frozen=True)
class Article:
    """The bar as it is, its joints by name, and where the accelerometer is (m from the left end).

    Attributes:
        loss_factor: structural loss of the bar beside its damping ratios.
        damping_scale: factor on the bar's damping ratios.
    """

    bar: Bar
    joints: dict[str, Joint]
    sensor_position: float
    loss_factor: float = 0.0
    damping_scale: float = 1.0


def joint_matrix(name: str, joint: Joint, cylinder: Complex) -> Complex:
    """(lines, 3, 3) dynamic stiffness of joint `name` in x, y and rotation at the bar's axis, N/m, N, N m.

    `cylinder` (lines, 3) is that of one of its cylinders in shear, compression and rotation.
    """
    sign = 1.0 if name == "I" else -1.0
    total = np.zeros((len(cylinder), 9), dtype=np.complex128)
    for drawn, arm in zip(INCLINATIONS_DEG[name], ECCENTRICITIES, strict=True):
        angle, height = np.radians(drawn + sign * joint.lean_deg), arm + joint.shift
        cos, sin = np.cos(angle), np.sin(angle)
        local = np.array([[cos, sin, -height * cos], [-sin, cos, height * sin], [0.0, 0.0, 1.0]])
        total += cylinder @ (local[:, :, None] * local[:, None, :]).reshape(3, 9)
    return total.reshape(-1, 3, 3)


def clipped_normal(rng: np.random.Generator, deviation: float, count: int | None = None) -> Real:
    """Normal numbers of a standard deviation, none beyond two of them."""
    return np.asarray(deviation * np.clip(rng.standard_normal(count), -2.0, 2.0))


def clipped_variance(deviation: float) -> float:
    """Of such numbers."""
    within, density = math.erf(math.sqrt(2.0)), math.exp(-2.0) / math.sqrt(2.0 * math.pi)
    return deviation**2 * (within - 4.0 * density + 4.0 * (1.0 - within))


def draw_node_positions(rng: np.random.Generator) -> tuple[float, ...]:
    """Positions of nodes 1 to 11 on the drawing, m: the joints 53 to 59 mm from the ends, the others even between."""
    length = Bar().length
    inset = 1e-3 * float(rng.integers(53, 60))
    inner = np.round(np.linspace(inset, length - inset, NODES - 2), 4)
    return (0.0, *(float(x) for x in inner), length)


def draw_article(rng: np.random.Generator, nodes: tuple[float, ...]) -> Article:
    """An article on the drawing's `nodes` (11,), everything off by what `TOLERANCES` admit."""
    nominal = Bar()
    bar = Bar(
        youngs_modulus=nominal.youngs_modulus * (1 + float(clipped_normal(rng, TOLERANCES["youngs_modulus"]))),
        density=nominal.density * (1 + float(clipped_normal(rng, TOLERANCES["density"]))),
    )
    joints = {}
    for name in JOINT_NAMES:
        shear, compression = (typical * rng.uniform(0.82, 1.18) for typical in TYPICAL[name])
        shear_loss, compression_loss = rng.uniform(0.08, 0.155), rng.uniform(0.06, 0.135)
        joints[name] = Joint(
            position=nodes[JOINT_NODES[name] - 1] + float(clipped_normal(rng, TOLERANCES["node_position"])),
            shear=complex(shear * (1 + 1j * shear_loss)),
            compression=complex(compression * (1 + 1j * compression_loss)),
            rotation=complex(rng.uniform(6.0, 30.0) * (1 + 1j * compression_loss)),
            lean_deg=float(clipped_normal(rng, TOLERANCES["inclination_deg"])),
        )
    sensor = nodes[SENSOR_NODE - 1] + float(clipped_normal(rng, TOLERANCES["node_position"]))
    return Article(bar, joints, sensor)
