"""Effects of beam, joints and stand beyond the drawing. They show in the beam rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simlab.article import JOINT_NAMES, SimulatedArticle, log_uniform
from simlab.beam import FreeModes, Real, free_modes
from simlab.case.effects.base import RowReading, SimulatedEffect, either_sign, one_of
from simlab.case.effects.base_motion import OnBase
from simlab.coupling import Attachment, Complex


class JointMass(SimulatedEffect):
    """Caps and screws move with the beam at the joints: -w^2 m in both directions, alike at both joints or not."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> JointMass:
        law = one_of(rng, "equal", "equal", "different", "one_joint")
        mass = 0.3 * size
        shares = {"equal": (1.0, 1.0), "different": (1.0, rng.uniform(0.3, 0.9)), "one_joint": (1.0, 0.0)}[law]
        if law != "equal" and rng.random() < 0.5:
            shares = shares[::-1]
        return cls(size, law, {"m": mass * sum(shares) / 2, "m_I": mass * shares[0], "m_II": mass * shares[1]})

    def joints(self, stiffness: Complex, article: SimulatedArticle, omega: Complex) -> Complex:
        first, second = self.number("m_I"), self.number("m_II")
        inertia = np.diag([first, first, 0.0, second, second, 0.0])
        return np.asarray(stiffness - omega[:, None, None] ** 2 * inertia)


class SupportPosition(SimulatedEffect):
    """One joint, or both, clamped elsewhere along the beam than the drawing says, by up to 10 mm."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> SupportPosition:
        shift = 0.01 * size
        law = one_of(rng, "one_joint", "both")
        other = either_sign(rng) * shift * rng.uniform(0.3, 1.0) if law == "both" else 0.0
        first, second = rng.permutation([either_sign(rng) * shift, other])
        return cls(size, law, {"dx_I": float(first), "dx_II": float(second)})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return moved(article, "position", {name: self.number(f"dx_{name}") for name in article.joints})


class CylinderAngle(SimulatedEffect):
    """One joint's cylinders lean off the drawing, in the stand and in the tester's angled fixture alike."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CylinderAngle:
        return cls(size, "one_joint", {"delta_deg": either_sign(rng) * 5.0 * size, "joint": one_of(rng, *JOINT_NAMES)})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return moved(article, "lean_deg", {str(self.values["joint"]): self.number("delta_deg")})


class VerticalOffset(SimulatedEffect):
    """Cylinders that do not sit evenly about the axis, so that k13 and k23 appear."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> VerticalOffset:
        law = one_of(rng, "same_side", "one_joint", "independent")
        shift = either_sign(rng) * 0.005 * size
        other = {"same_side": 1.0, "one_joint": 0.0, "independent": rng.uniform(-1.0, 1.0)}[law]
        first, second = rng.permutation([shift, other * shift])
        return cls(size, law, {"shift_I": float(first), "shift_II": float(second)})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return moved(article, "shift", {name: self.number(f"shift_{name}") for name in article.joints})


class ContactPatch(SimulatedEffect):
    """The cylinders hold the beam over a length: k33 grows by k22 l^2 / 12 where the pressure is even, l^2 / 20 where
    it falls to nothing at the edges as a parabola.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ContactPatch:
        return cls(size, one_of(rng, "even", "even", "parabolic"), {"length": 0.04 * size})

    def joints(self, stiffness: Complex, article: SimulatedArticle, omega: Complex) -> Complex:
        changed = stiffness.copy()
        inertia = self.number("length") ** 2 / (12.0 if self.law == "even" else 20.0)
        for y in (1, 4):
            changed[:, y + 1, y + 1] += inertia * stiffness[:, y, y]
        return changed


class FoundationCompliance(OnBase):
    """One joint stands on something that gives, with a resonance of its own: k_f (1 + i eta) - w^2 m_f in series."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FoundationCompliance:
        joint = one_of(rng, *JOINT_NAMES)
        cylinder = article.joints[joint].cylinders[0]
        transverse = (cylinder.shear + cylinder.compression).real
        stiffness, frequency = 2.0 * transverse / size, log_uniform(rng, 30.0, 1500.0)
        values: dict[str, float | str] = {
            "joint": joint,
            "f": frequency,
            "k_f": stiffness,
            "m_f": stiffness / (2 * np.pi * frequency) ** 2,
            "eta": rng.uniform(0.02, 0.1),
        }
        return cls(size, one_of(rng, "transverse", "transverse", "both_directions"), values)

    def base(self, omega: Complex) -> tuple[Real, Complex]:
        base = self.number("k_f") * (1 + 1j * self.number("eta")) - omega**2 * self.number("m_f")
        start = 3 * JOINT_NAMES.index(str(self.values["joint"]))
        giving = [start + 1] if self.law == "transverse" else [start, start + 1]
        return np.eye(6)[:, giving], base[:, None, None] * np.eye(len(giving))


class YoungsModulus(SimulatedEffect):
    """Another steel: up to 3 % stiffer or softer than the data sheet."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> YoungsModulus:
        return cls(size, "scale", {"relative": either_sign(rng) * 0.03 * size})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        modulus = article.beam.youngs_modulus * (1 + self.number("relative"))
        return replace(article, beam=replace(article.beam, youngs_modulus=modulus))


class Density(SimulatedEffect):
    """Up to 2 % heavier or lighter than the data sheet."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> Density:
        return cls(size, "scale", {"relative": either_sign(rng) * 0.02 * size})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return replace(
            article, beam=replace(article.beam, density=article.beam.density * (1 + self.number("relative")))
        )


class BeamDamping(SimulatedEffect):
    """The beam itself damps more than it did when free: a structural loss factor, or more viscous damping a mode.

    In the viscous law every damping ratio grows by one factor, such that the stiffest gains eta / 2.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> BeamDamping:
        return cls(size, one_of(rng, "structural", "structural", "viscous"), {"eta": 0.01 * size})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        if self.law == "structural":
            return replace(article, loss_factor=self.number("eta"))
        return replace(article, damping_scale=1.0 + 0.5 * self.number("eta") / article.beam.damping_ratios[-1])


class OutOfPlaneBending(SimulatedEffect):
    """The accelerometer sees the beam bend across its width: its two modes near 330 and 855 Hz, one, or all of them.

    The beam on edge is held, and damped, by both cylinders of each joint in shear; frequencies are Rayleigh's.  Blows
    at the ends excite it by their lean, transverse ones by a small leak of it.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> OutOfPlaneBending:
        values = {"coupling": 0.08 * size, "transverse_leak": rng.uniform(0.0, 0.15), "eta": rng.uniform(0.002, 0.01)}
        return cls(size, one_of(rng, "two_modes", "two_modes", "one_mode", "all_modes"), values)

    def read(self, accelerance: Complex, reading: RowReading) -> Complex:
        article, omega = reading.article, reading.omega[:, None]
        modes = free_modes(article.beam.on_edge())
        bending = np.flatnonzero(np.any(modes.series["y"], axis=(0, 1)))
        wanted = {"two_modes": bending[2:4], "one_mode": bending[2:3], "all_modes": bending[:6]}[self.law]
        held = sum(
            sum(cylinder.shear for cylinder in joint.cylinders) * modes.shape("y", joint.position)[wanted] ** 2
            for joint in article.joints.values()
        )
        square = modes.angular_frequency[wanted] ** 2 * (1 + 1j * self.number("eta")) + held
        residue = modes.shape("y", article.sensor_position)[wanted] * modes.shape("y", reading.position)[wanted]
        weight = self.number("coupling") * (1.0 if reading.row.direction == "x" else self.number("transverse_leak"))
        return np.asarray(accelerance + weight * np.sum(-residue * omega**2 / (square - omega**2), axis=1))


class AccelerometerMass(SimulatedEffect):
    """The accelerometer and its cable weigh something; the cable's share may act across the beam alone."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> AccelerometerMass:
        return cls(size, one_of(rng, "both_directions", "transverse"), {"m": 0.04 * size})

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        directions = "xy" if self.law == "both_directions" else "y"
        shapes = np.array([modes.shape(direction, article.sensor_position) for direction in directions])
        return [mass_at(shapes, self.number("m"), omega)]


def mass_at(shapes: Real, mass: float, omega: Complex) -> Attachment:
    """A mass in kg (or an inertia in kg m^2) that moves with `shapes` (n, modes)."""
    return Attachment(shapes, -mass * omega[:, None, None] ** 2 * np.eye(len(shapes)))


def moved(article: SimulatedArticle, field: str, by: dict[str, float]) -> SimulatedArticle:
    """The article with `by` added to one `field` of some joints, by name of the joint."""
    changed = {
        name: replace(article.joints[name], **{field: getattr(article.joints[name], field) + by[name]}) for name in by
    }
    return replace(article, joints=article.joints | changed)
