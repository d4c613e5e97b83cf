"""More effects that no catalogue foresees."""

from __future__ import annotations

import numpy as np

from simlab.article import SimulatedArticle
from simlab.beam import FreeModes
from simlab.case.campaign import CONFIGURATIONS, Points
from simlab.case.effects.base import RowReading, SimulatedEffect, either_sign
from simlab.case.effects.novel import away_from_sensor, kinked
from simlab.coupling import Attachment, Complex


class RotaryDamper(SimulatedEffect):
    """Something on the beam damps its rotation at one place."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> RotaryDamper:
        return cls(size, "viscous", {"x": away_from_sensor(rng, article), "c": 1.2 * size})

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        return kinked(article, self.number("x"))

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        held = 1j * omega * self.number("c")
        return [Attachment(modes.shape("r", self.number("x"))[None], held[:, None, None])]


class LevelGain(SimulatedEffect):
    """The force is read too high or too low in every set but the first, as with another tip or range."""

    sets = 2

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> LevelGain:
        return cls(size, "step", {"step": either_sign(rng) * 0.08 * size, "phase_deg": rng.uniform(-2.0, 2.0) * size})

    def read(self, accelerance: Complex, reading: RowReading) -> Complex:
        if reading.setup == 0:
            return accelerance
        return np.asarray(accelerance * (1.0 + self.number("step")) * np.exp(1j * np.radians(self.number("phase_deg"))))


class CrossTalk(SimulatedEffect):
    """One fixture of the tester adds a share of its own stiffness and loss, by frequency."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CrossTalk:
        values = {
            "configuration": float(rng.integers(len(CONFIGURATIONS))),
            "share": 0.2 * size,
            "corner": rng.uniform(20.0, 150.0),
            "phase": rng.uniform(0.0, np.pi / 2),
        }
        return cls(size, "first_order", values)

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        ratio = 1j * points.frequency / self.number("corner")
        more = self.number("share") * np.exp(1j * self.number("phase")) * ratio / (1 + ratio)
        return np.asarray(stiffness * (1 + np.where(points.configuration == self.number("configuration"), more, 0.0)))
