"""Effects of the elastomer tester on a dynamic stiffness. They show in the tester alone."""

from __future__ import annotations

import numpy as np

from simlab.article import SimulatedArticle
from simlab.case.campaign import Points
from simlab.case.effects.base import SimulatedEffect, one_of
from simlab.coupling import Complex


def in_series(stiffness: Complex, compliance: Complex | complex) -> Complex:
    """(points,) 1 / (1 / k + c) for a `stiffness` (points,) that may be zero, and a compliance () or (points,), m/N."""
    return np.asarray(stiffness / (1.0 + stiffness * compliance))


class FrameCompliance(SimulatedEffect):
    """Frame and fixtures give: 1 / k + c, without loss or with some."""

    reduces_motion = True

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FrameCompliance:
        law = one_of(rng, "elastic", "elastic", "lossy")
        return cls(size, law, {"c": 0.5e-6 * size, "loss": rng.uniform(0.01, 0.05) if law == "lossy" else 0.0})

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        return in_series(stiffness, self.number("c") * (1 - 1j * self.number("loss")))


class FixtureInertia(SimulatedEffect):
    """The fixture between specimen and load cell moves: k - w^2 m, in full or as a share that varies a little with the
    fixture of each configuration.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FixtureInertia:
        law = one_of(rng, "same_fixture", "same_fixture", "three_fixtures")
        spread = 0.1 if law == "three_fixtures" else 0.0
        values = {"m": 0.2 * size}
        values |= {f"share_{i}": 1.0 + spread * rng.uniform(-1.0, 1.0) for i in range(3)}
        return cls(size, law, values)

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        shares = np.array([self.number(f"share_{i}") for i in range(3)])
        mass = self.number("m") * shares[points.configuration]
        return np.asarray(stiffness - (2 * np.pi * points.frequency) ** 2 * mass)


class FrameResonance(SimulatedEffect):
    """The frame magnifies towards its resonance: 1 / (1 - (f / f_r)^2), undamped or damped."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FrameResonance:
        law = one_of(rng, "undamped", "damped")
        # the whole range, 250 Hz, magnifies 200 Hz by 2.8; a fraction of it is taken of (f / f_r)^2
        resonance = 250.0 / np.sqrt(max(size, (250.0 / 800.0) ** 2))
        return cls(size, law, {"f_r": resonance, "zeta": rng.uniform(0.003, 0.012) if law == "damped" else 0.0})

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        ratio = points.frequency / self.number("f_r")
        return np.asarray(stiffness / (1 - ratio**2 + 2j * self.number("zeta") * ratio))


class TransducerLag(SimulatedEffect):
    """Force and displacement are not sampled together, or one passes a filter: e^(i w tau) or 1 + i w tau."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> TransducerLag:
        return cls(size, one_of(rng, "delay", "delay", "first_order"), {"tau": 300e-6 * size})

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        phase = 2 * np.pi * points.frequency * self.number("tau")
        return np.asarray(stiffness * (np.exp(1j * phase) if self.law == "delay" else 1 + 1j * phase))
