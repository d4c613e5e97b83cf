"""Effects of the elastomer tester whose form is drawn too."""

from __future__ import annotations

import numpy as np

from simlab.article import SimulatedArticle
from simlab.case.campaign import CONFIGURATIONS, Points
from simlab.case.effects.base import SimulatedEffect
from simlab.case.effects.tester import in_series
from simlab.case.random_laws.curves import curve, draw_curve
from simlab.coupling import Complex

HIGHEST = 250.0
"""Hz; no tester's grid goes beyond it."""


def draw_shares(rng: np.random.Generator, spread: float) -> dict[str, float]:
    """Share of a property for each configuration, as fixtures differ."""
    return {f"share_{i}": 1.0 + spread * rng.uniform(-1.0, 1.0) for i in range(len(CONFIGURATIONS))}


def shares(effect: SimulatedEffect, points: Points) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """(points,) share that `draw_shares` drew for each point."""
    return np.array([effect.number(f"share_{i}") for i in range(len(CONFIGURATIONS))])[points.configuration]


class FrameCompliance(SimulatedEffect):
    """Frame and fixtures give, with some loss, and with a fixture for each configuration."""

    reduces_motion = True

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FrameCompliance:
        return cls(size, "fixtures", {"mean_c": 0.5e-6 * size, "loss": rng.uniform(0.0, 0.08)} | draw_shares(rng, 0.12))

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        lossy = 1 - 1j * self.number("loss")
        compliance: Complex = np.asarray(self.number("mean_c") * shares(self, points) * lossy, dtype=np.complex128)
        return in_series(stiffness, compliance)


class FixtureInertia(SimulatedEffect):
    """The fixture between specimen and load cell moves, one of its own for each configuration."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FixtureInertia:
        return cls(size, "fixtures", {"mean_m": 0.2 * size} | draw_shares(rng, 0.12))

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        return np.asarray(
            stiffness - (2 * np.pi * points.frequency) ** 2 * self.number("mean_m") * shares(self, points)
        )


class FrameResonance(SimulatedEffect):
    """The frame magnifies towards two resonances, both damped; the first makes a share of its motion."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FrameResonance:
        resonance = 300.0 / np.sqrt(max(size, (300.0 / 900.0) ** 2))
        values = {"f_r": resonance, "second": resonance * rng.uniform(1.6, 3.0), "share": rng.uniform(0.75, 0.95)}
        return cls(size, "two_modes", values | {"zeta": rng.uniform(0.003, 0.02)})

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        first, second = (
            1.0 / (1 - ratio**2 + 2j * self.number("zeta") * ratio)
            for ratio in (points.frequency / self.number("f_r"), points.frequency / self.number("second"))
        )
        return np.asarray(stiffness * (self.number("share") * first + (1 - self.number("share")) * second))


class TransducerLag(SimulatedEffect):
    """One of force and displacement passes a filter whose delay changes with frequency."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> TransducerLag:
        return cls(size, "filter", {"mean_tau": 300e-6 * size} | draw_curve(rng, "delay"))

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        shape = 1.0 + 0.12 * curve(self.values, "delay", points.frequency / HIGHEST)
        return np.asarray(stiffness * np.exp(2j * np.pi * points.frequency * self.number("mean_tau") * shape))
