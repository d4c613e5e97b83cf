"""Effects that no catalogue foresees: a diagnosis is to say that it does not know these."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simlab.article import JOINT_NAMES, SimulatedArticle, log_uniform
from simlab.beam import FreeModes, Real
from simlab.case.campaign import Points
from simlab.case.effects.base import CylinderState, RowReading, SimulatedEffect, either_sign, one_of
from simlab.case.effects.base_motion import OnBase
from simlab.case.effects.structure import mass_at
from simlab.coupling import Attachment, Complex


def away_from_sensor(rng: np.random.Generator, article: SimulatedArticle) -> float:
    """A place on the beam, m from the left end, between the joints and at least 8 cm from the accelerometer."""
    first = article.sensor_position + 0.08
    return float(rng.uniform(first, article.joints["II"].position - 0.03))


def kinked(article: SimulatedArticle, *places: float) -> SimulatedArticle:
    """The article with further kinks of the beam, m from the left end."""
    return replace(article, kinks=(*article.kinks, *places))


class Absorber(SimulatedEffect):
    """Something soft with a mass hangs on the beam and swings: a tuned absorber that nobody planned."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> Absorber:
        values = {
            "x": away_from_sensor(rng, article),
            "m": 0.06 * size,
            "f": log_uniform(rng, 60.0, 700.0),
            "zeta": rng.uniform(0.01, 0.05),
        }
        return cls(size, "spring_and_mass", values)

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return kinked(article, self.number("x"))

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        own, mass = 2 * np.pi * self.number("f"), self.number("m")
        spring = mass * (own**2 + 2j * self.number("zeta") * own * omega)
        held = -(omega**2) * mass * spring / (spring - omega**2 * mass)
        return [Attachment(modes.shape("y", self.number("x"))[None], held[:, None, None])]


class HungMass(SimulatedEffect):
    """A clamp or a magnet left on the beam."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> HungMass:
        return cls(size, "rigid", {"x": away_from_sensor(rng, article), "m": 0.15 * size})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return kinked(article, self.number("x"))

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        shapes = np.array([modes.shape(direction, self.number("x")) for direction in "xy"])
        return [mass_at(shapes, self.number("m"), omega)]


class GroundedDamper(SimulatedEffect):
    """A cable or a person touches the beam: a damper to the ground, and a little stiffness."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> GroundedDamper:
        values = {"x": away_from_sensor(rng, article), "c": 60.0 * size, "k": rng.uniform(0.0, 1e4)}
        return cls(size, "viscous", values)

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return kinked(article, self.number("x"))

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        held = self.number("k") + 1j * omega * self.number("c")
        return [Attachment(modes.shape("y", self.number("x"))[None], held[:, None, None])]


class MidSpanSpring(SimulatedEffect):
    """Something beneath the beam touches it about its middle: a spring to the ground."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> MidSpanSpring:
        values = {"x": article.beam.length * rng.uniform(0.42, 0.58), "k": 4e5 * size, "eta": rng.uniform(0.0, 0.1)}
        return cls(size, "linear", values)

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return kinked(article, self.number("x"))

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        held = self.number("k") * (1 + 1j * self.number("eta"))
        return [Attachment(modes.shape("y", self.number("x"))[None], np.full((1, 1), held))]


class Crack(SimulatedEffect):
    """A cut takes away bending stiffness over a few centimetres; the curvature jumps at its ends."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> Crack:
        return cls(
            size,
            "softened_length",
            {"x": away_from_sensor(rng, article), "length": rng.uniform(0.02, 0.04), "loss": 0.7 * size},
        )

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        half = 0.5 * self.number("length")
        return kinked(article, self.number("x") - half, self.number("x") + half)

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        # as many points as the series has terms between the ends of the cut: fewer would leave curvature between them
        points, weights = np.polynomial.legendre.leggauss(article.beam.terms)
        half, beam = 0.5 * self.number("length"), article.beam
        shapes = np.array([modes.slope("r", self.number("x") + half * point) for point in points])
        bending = beam.youngs_modulus * beam.width * beam.height**3 / 12
        return [Attachment(shapes, np.diag(-self.number("loss") * bending * half * weights).astype(np.complex128))]


class RotaryLump(SimulatedEffect):
    """Something heavy and wide turns with the beam at one joint."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> RotaryLump:
        return cls(size, "rigid", {"joint": one_of(rng, *JOINT_NAMES), "inertia": 2e-4 * size})

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        place = article.joints[str(self.values["joint"])].position
        return [mass_at(modes.shape("r", place)[None], self.number("inertia"), omega)]


class CommonBase(OnBase):
    """Both joints stand on one plate that moves as a whole, so that each feels the other."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CommonBase:
        stiffness, frequency = 1e7 / size, log_uniform(rng, 40.0, 500.0)
        values = {
            "k": stiffness,
            "f": frequency,
            "m": stiffness / (2 * np.pi * frequency) ** 2,
            "eta": rng.uniform(0.02, 0.1),
        }
        return cls(size, "plate_on_spring", values)

    def base(self, omega: Complex) -> tuple[Real, Complex]:
        plate = np.array([[0.0, 1.0, 0.0, 0.0, 1.0, 0.0]]).T
        base = self.number("k") * (1 + 1j * self.number("eta")) - omega**2 * self.number("m")
        return plate, base[:, None, None]


class RovingDrift(SimulatedEffect):
    """The joints soften while the hammer walks along the beam: in the first set, or in each set again."""

    roving = True

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> RovingDrift:
        return cls(size, one_of(rng, "every_set", "first_set"), {"d": 0.24 * size, "order": one_of(rng, "up", "down")})

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        if state.in_tester or (self.law == "first_set" and state.setup > 0):
            return stiffness
        progress = state.order if self.values["order"] == "up" else 1.0 - state.order
        return stiffness * (1.0 - self.number("d") * (progress - 0.5))[:, None]


class SetStep(SimulatedEffect):
    """The joints settle between the reference set and those after it; the tester got them before."""

    sets = 2

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> SetStep:
        values: dict[str, float | str] = {"step": either_sign(rng) * 0.1 * size, "joint": one_of(rng, *JOINT_NAMES)}
        return cls(size, "one_joint", values)

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        if state.in_tester or state.setup == 0 or state.joint != self.values["joint"]:
            return stiffness
        return stiffness * (1.0 + self.number("step"))


class SensorMountResonance(SimulatedEffect):
    """The accelerometer sits on wax or a magnet that resonates above, or just within, the band."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> SensorMountResonance:
        return cls(size, "one_mode", {"f": 2500.0 * (900.0 / 2500.0) ** size, "zeta": rng.uniform(0.02, 0.08)})

    def read(self, accelerance: Complex, reading: RowReading) -> Complex:
        ratio = reading.omega / (2 * np.pi * self.number("f"))
        damping = 2j * self.number("zeta") * ratio
        return np.asarray(accelerance * (1 + damping) / (1 - ratio**2 + damping))


class GainDrift(SimulatedEffect):
    """The measuring chain drifts along the rows of every set."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> GainDrift:
        return cls(size, "linear", {"drift": either_sign(rng) * 0.08 * size})

    def read(self, accelerance: Complex, reading: RowReading) -> Complex:
        return accelerance * (1 + self.number("drift") * (reading.order - 0.5))


class PhaseOffset(SimulatedEffect):
    """One set's phase is off by the same angle at every line."""

    sets = 2

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> PhaseOffset:
        values: dict[str, float | str] = {"angle_deg": either_sign(rng) * 6.0 * size, "setup": float(rng.integers(2))}
        return cls(size, "one_set", values)

    def read(self, accelerance: Complex, reading: RowReading) -> Complex:
        if reading.setup != int(self.number("setup")):
            return accelerance
        return np.asarray(accelerance * np.exp(1j * np.radians(self.number("angle_deg"))))


class TesterRipple(SimulatedEffect):
    """The tester's gain waves with frequency, as behind a poor filter or a column with a resonance train."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> TesterRipple:
        values = {"depth": 0.05 * size, "period_hz": rng.uniform(25.0, 120.0), "phase": rng.uniform(0.0, 2 * np.pi)}
        return cls(size, "sine", values)

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        wave = np.sin(2 * np.pi * points.frequency / self.number("period_hz") + self.number("phase"))
        return stiffness * (1 + self.number("depth") * wave)
