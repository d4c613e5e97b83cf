"""Effects that spoil single records: blows that bounce, and the mains. Such a case brings the raw blows to see them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simlab.article import SimulatedArticle, log_uniform
from simlab.beam import Real
from simlab.case.campaign import LINE_SPACING, RECORDED, Campaign
from simlab.case.effects.base import SimulatedEffect, one_of
from simlab.coupling import Complex


class DoubleHit(SimulatedEffect):
    """The hammer bounces, after about the same or another delay each time: force and response get 1 + r e^(-i w dt)."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> DoubleHit:
        values = {"ratio": 0.8 * size, "dt": log_uniform(rng, 4e-3, 30e-3), "share": rng.uniform(0.6, 1.0)}
        return cls(size, one_of(rng, "alike", "scattered"), values)

    def measured(self, campaign: Campaign) -> Campaign:
        return replace(campaign, recorded=RECORDED)

    def bounce(self, rng: np.random.Generator) -> tuple[float, float] | None:
        """Delay in s and relative height of one blow's bounce; None for a blow that does not."""
        if rng.random() >= self.number("share"):
            return None
        scatter = self._scatter * float(np.clip(rng.standard_normal(), -2, 2))
        return self.number("dt") * (1 + scatter), self.number("ratio") * rng.uniform(0.7, 1.0)

    @property
    def _scatter(self) -> float:
        return 0.02 if self.law == "alike" else 0.3

    def bounced(self, rng: np.random.Generator, frequency: Real, blows: tuple[int, int]) -> Complex:
        delay = self.number("dt") * (1 + self._scatter * np.clip(rng.standard_normal((*blows, 1)), -2, 2))
        ratio = self.number("ratio") * rng.uniform(0.7, 1.0, (*blows, 1))
        bounces = rng.random((*blows, 1)) < self.number("share")
        return np.asarray(1 + bounces * ratio * np.exp(-2j * np.pi * frequency * delay))


class MainsHum(SimulatedEffect):
    """The mains and its multiples on the accelerometer, at another phase in every record."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> MainsHum:
        values: dict[str, float | str] = {
            "amplitude": 0.1 * size,
            "mains_hz": 50.0 if rng.random() < 0.7 else 60.0,
            "off_hz": rng.normal(0.0, 0.02),
        }
        return cls(size, one_of(rng, "all_multiples", "odd_multiples"), values)

    def measured(self, campaign: Campaign) -> Campaign:
        return replace(campaign, recorded=RECORDED)

    @property
    def tones(self) -> dict[float, float]:
        """Amplitude in m/s^2 by frequency in Hz."""
        mains = self.number("mains_hz") + self.number("off_hz")
        multiples = (1, 3, 5, 7, 9) if self.law == "odd_multiples" else (1, 2, 3, 4, 5)
        return {multiple * mains: self.number("amplitude") / multiple for multiple in multiples}

    def hummed(self, rng: np.random.Generator, frequency: Real, blows: tuple[int, int]) -> Complex:
        total = np.zeros((*blows, frequency.size), dtype=np.complex128)
        for tone, amplitude in self.tones.items():
            away = (tone - frequency) / LINE_SPACING
            # transform of a sine over one record; distance from its own line is in lines
            leaked = 0.5 / LINE_SPACING * np.sinc(away) * np.exp(1j * np.pi * away)
            total += amplitude * np.exp(2j * np.pi * rng.random((*blows, 1))) * leaked
        return total
