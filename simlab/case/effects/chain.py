"""Effects of hammer, accelerometer and analyser on an accelerance. They show in the beam rig alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simlab.article import SimulatedArticle
from simlab.beam import FreeModes, Load, Real
from simlab.case.campaign import MEASURED, NODES, Row
from simlab.case.effects.base import SimulatedEffect, either_sign, one_of
from simlab.coupling import Complex

SENSOR_HEIGHT = 0.0127 + 0.008
"""Height of the accelerometer's element above the beam's axis, m."""


class SensorGain(SimulatedEffect):
    """A calibration that is off by up to 5 %, in every set."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> SensorGain:
        return cls(size, "flat", {"gain": either_sign(rng) * 0.05 * size})

    def passed(self, omega: Complex) -> Complex:
        return np.asarray(1 + self.number("gain"), dtype=np.complex128)


class ChannelDelay(SimulatedEffect):
    """Acceleration comes late against force: by a time, or by an all-pass filter of first order with that delay."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ChannelDelay:
        return cls(size, one_of(rng, "delay", "delay", "all_pass"), {"tau": 50e-6 * size})

    def passed(self, omega: Complex) -> Complex:
        phase = omega * self.number("tau")
        if self.law == "all_pass":
            phase = 2 * np.arctan(0.5 * phase)
        return np.asarray(np.exp(-1j * phase))


class HighpassCorner(SimulatedEffect):
    """The charge amplifier's or IEPE supply's corner, of first or second order."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> HighpassCorner:
        return cls(size, one_of(rng, "first_order", "first_order", "second_order"), {"corner": 5.0 * size})

    def passed(self, omega: Complex) -> Complex:
        ratio = 1j * omega / (2 * np.pi * self.number("corner"))
        if self.law == "first_order":
            return np.asarray(ratio / (1 + ratio))
        return np.asarray(ratio**2 / (1 + np.sqrt(2) * ratio + ratio**2))


class ExponentialWindow(SimulatedEffect):
    """Records were weighted by exp(-s t), and the added damping was not removed: H(w - i s)."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ExponentialWindow:
        return cls(size, "uncorrected", {"s": 10.0 * size})

    @property
    def window_decay(self) -> float:
        return self.number("s")


class CrossAxisSensitivity(SimulatedEffect):
    """The accelerometer takes some motion along the beam for motion across it: of the axis, or of its own place."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CrossAxisSensitivity:
        sensitivity = either_sign(rng) * 0.05 * size
        return cls(size, one_of(rng, "of_the_axis", "of_the_surface"), {"sensitivity": sensitivity})

    def sensed(self, shape: Real, modes: FreeModes, article: SimulatedArticle) -> Real:
        along = modes.shape("x", article.sensor_position)
        if self.law == "of_the_surface":
            along = along - SENSOR_HEIGHT * modes.shape("r", article.sensor_position)
        return shape + self.number("sensitivity") * along


class ImpactAngle(SimulatedEffect):
    """Blows lean along the beam: all of them, the transverse ones, or those of one row."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ImpactAngle:
        law = one_of(rng, "all", "transverse", "one_row")
        row = MEASURED[int(rng.integers(len(MEASURED)))].name
        return cls(size, law, {"angle_deg": either_sign(rng) * 4.0 * size, "row": row if law == "one_row" else "all"})

    def struck(self, load: Load, row: Row) -> Load:
        if self.law == "transverse" and row.direction == "x":
            return load
        if self.law == "one_row" and row.name != self.values["row"]:
            return load
        cos, sin = np.cos(np.radians(self.number("angle_deg"))), np.sin(np.radians(self.number("angle_deg")))
        return replace(load, x=load.x * cos + load.y * sin, y=load.y * cos + load.x * sin)


class ImpactPosition(SimulatedEffect):
    """One to three rows marked at the wrong place, by up to 8 mm, in every set; never off the beam."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ImpactPosition:
        count = int(rng.integers(1, 4))
        rows = [row for row in MEASURED if row.direction == "y"]
        values: dict[str, float | str] = {}
        for rank, i in enumerate(rng.permutation(len(rows))[:count]):
            inwards = {1: 1.0, NODES: -1.0}.get(rows[i].node)
            sign = either_sign(rng) if inwards is None else inwards
            values[f"shift_{rows[i].node}"] = sign * 0.008 * size * (1.0 if rank == 0 else rng.uniform(0.5, 1.0))
        return cls(size, f"rows_{count}", values)

    def struck(self, load: Load, row: Row) -> Load:
        key = f"shift_{row.node}"
        if row.direction != "y" or key not in self.values:
            return load
        return replace(load, position=load.position + self.number(key))
