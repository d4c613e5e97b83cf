"""Effects of beam, joints and stand whose form is drawn too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simlab.article import JOINT_NAMES, SimulatedArticle, log_uniform
from simlab.beam import FreeModes, Load, Real
from simlab.case.campaign import Row
from simlab.case.effects.base import SimulatedEffect, either_sign, one_of
from simlab.case.effects.base_motion import OnBase
from simlab.case.effects.chain import SENSOR_HEIGHT
from simlab.case.effects.structure import mass_at, moved
from simlab.case.random_laws.curves import curve, draw_curve
from simlab.coupling import Attachment, Complex

DAMPED = 9
"""Number of bending modes with a damping of their own."""


class JointMass(SimulatedEffect):
    """Caps and screws at the joints: a mass at each, a little aside of the axis, all of which moves across the beam."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> JointMass:
        first, second = 0.3 * size * rng.uniform(0.5, 1.0, 2)
        values = {"m": (first + second) / 2, "m_I": first, "m_II": second, "along": rng.uniform(0.6, 1.0)}
        return cls(size, "aside", values | {"aside": rng.uniform(-0.008, 0.008)})

    def joints(self, stiffness: Complex, article: SimulatedArticle, omega: Complex) -> Complex:
        inertia, aside = np.zeros((6, 6)), self.number("aside")
        for start, name in enumerate(JOINT_NAMES):
            mass, place = self.number(f"m_{name}"), slice(3 * start, 3 * start + 3)
            inertia[place, place] = mass * np.array(
                [[self.number("along"), 0, 0], [0, 1.0, aside], [0, aside, 2 * aside**2]]
            )
        return np.asarray(stiffness - omega[:, None, None] ** 2 * inertia)


class CylinderAngle(SimulatedEffect):
    """One joint's cylinders lean off the drawing, the upper one not as far as the lower."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CylinderAngle:
        delta = either_sign(rng) * 5.0 * size
        values: dict[str, float | str] = {"delta_deg": delta}
        values |= {"splay_deg": delta * rng.uniform(-0.4, 0.4), "joint": one_of(rng, *JOINT_NAMES)}
        return cls(size, "splayed", values)

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        joint, splay = str(self.values["joint"]), self.number("splay_deg")
        leaning = moved(article, "lean_deg", {joint: self.number("delta_deg") - splay / 2})
        return moved(leaning, "splay_deg", {joint: splay})


class ContactPatch(SimulatedEffect):
    """The cylinders hold the beam over a length, by a pressure of random form that need not be symmetric.

    Where the beam turns, the points that they hold move across it, each by its distance from the joint's place.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ContactPatch:
        second = rng.uniform(1 / 20, 1 / 9)
        held = 0.04 * size
        values = {"held": held, "first": rng.uniform(-0.08, 0.08), "second": second}
        return cls(size, "random_pressure", values | {"length": held * float(np.sqrt(12.0 * second))})

    def joints(self, stiffness: Complex, article: SimulatedArticle, omega: Complex) -> Complex:
        changed, held = stiffness.copy(), self.number("held")
        for y in (1, 4):
            turning = held * self.number("first") * (stiffness[:, y, y + 1] + stiffness[:, y + 1, y])
            changed[:, y + 1, y + 1] += held**2 * self.number("second") * stiffness[:, y, y] + turning
            for way in (y - 1, y):  # along the beam, and across it
                coupled = held * self.number("first") * stiffness[:, way, y]
                changed[:, way, y + 1] += coupled
                changed[:, y + 1, way] += coupled
        return changed


class FoundationCompliance(OnBase):
    """One joint stands on something that gives, and that on something else, each with a resonance of its own."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FoundationCompliance:
        joint = one_of(rng, *JOINT_NAMES)
        cylinder = article.joints[joint].cylinders[0]
        transverse = (cylinder.shear + cylinder.compression).real
        values: dict[str, float | str] = {"joint": joint, "eta": rng.uniform(0.02, 0.1)}
        for number, share in enumerate(rng.dirichlet([4.0, 1.0]), 1):
            values |= {f"k_{number}": 2.0 * transverse / size / share, f"f_{number}": log_uniform(rng, 30.0, 1500.0)}
        return cls(size, "two_stages", values)

    def base(self, omega: Complex) -> tuple[Real, Complex]:
        compliance = np.zeros(omega.size, dtype=np.complex128)
        for number in (1, 2):
            own = 2 * np.pi * self.number(f"f_{number}")
            ratio = 1 + 1j * self.number("eta") - (omega / own) ** 2
            compliance += 1.0 / (self.number(f"k_{number}") * ratio)
        start = 3 * JOINT_NAMES.index(str(self.values["joint"]))
        return np.eye(6)[:, [start + 1]], (1.0 / compliance)[:, None, None]


class BeamDamping(SimulatedEffect):
    """Every bending mode is damped more than it was when the beam hung free, each by its own share."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> BeamDamping:
        return cls(size, "by_mode", {"mean_eta": 0.01 * size} | draw_curve(rng, "modes"))

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        known = article.beam.damping_ratios
        before = np.array([*known, *[known[-1]] * DAMPED])[:DAMPED]
        more = 0.5 * self.number("mean_eta") * np.exp(0.5 * curve(self.values, "modes", np.linspace(0, 1, DAMPED)))
        return replace(article, beam=replace(article.beam, damping_ratios=tuple(float(each) for each in before + more)))


class OutOfPlaneBending(SimulatedEffect):
    """The accelerometer sees the beam bend across its width, all of it, held by cylinders in shear and in rotation."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> OutOfPlaneBending:
        return cls(size, "continuous", {"coupling": 0.08 * size, "transverse_leak": rng.uniform(0.0, 0.15)})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return replace(article, cross_axis=self.number("coupling"))

    def struck(self, load: Load, row: Row) -> Load:
        return replace(load, z=load.z + (1.0 if row.direction == "x" else self.number("transverse_leak")))


class AccelerometerMass(SimulatedEffect):
    """The accelerometer weighs something, above the beam's axis, and its cable damps a little."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> AccelerometerMass:
        return cls(size, "above_the_axis", {"m": 0.04 * size, "c": rng.uniform(0.0, 0.3)})

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        x, y, r = (modes.shape(direction, article.sensor_position) for direction in "xyr")
        shapes = np.array([x - SENSOR_HEIGHT * r, y])
        weight = mass_at(shapes, self.number("m"), omega)
        damped = 1j * omega[:, None, None] * self.number("c") * np.diag([0.0, 1.0])
        return [Attachment(shapes, weight.stiffness + damped)]
