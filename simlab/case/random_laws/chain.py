"""Effects of hammer, accelerometer and analyser whose form is drawn too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simlab.article import SimulatedArticle
from simlab.beam import FreeModes, Load, Real
from simlab.case.campaign import MEASURED, Row
from simlab.case.effects.base import SimulatedEffect, either_sign, one_of
from simlab.case.effects.chain import SENSOR_HEIGHT
from simlab.case.random_laws.curves import curve, draw_curve, logarithmic
from simlab.coupling import Complex

BAND = (2.0, 1024.0)


class SensorGain(SimulatedEffect):
    """A calibration that is off, in every set, not quite alike at every frequency."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> SensorGain:
        return cls(size, "nearly_flat", {"gain": either_sign(rng) * 0.05 * size} | draw_curve(rng, "slope"))

    def passed(self, omega: Complex) -> Complex:
        uneven = 1.0 + 0.06 * curve(self.values, "slope", logarithmic(omega.real / (2 * np.pi), *BAND))
        return np.asarray(1.0 + self.number("gain") * uneven, dtype=np.complex128)


class ChannelDelay(SimulatedEffect):
    """Acceleration comes late against force, through a filter whose delay changes with frequency."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ChannelDelay:
        return cls(size, "filter", {"mean_tau": 50e-6 * size} | draw_curve(rng, "delay"))

    def passed(self, omega: Complex) -> Complex:
        shape = 1.0 + 0.12 * curve(self.values, "delay", omega.real / (2 * np.pi) / BAND[1])
        return np.asarray(np.exp(-1j * omega * self.number("mean_tau") * shape))


class HighpassCorner(SimulatedEffect):
    """The corners of an amplifier and of what comes after it."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> HighpassCorner:
        return cls(size, "two_corners", {"corner_1": 5.0 * size, "corner_2": 5.0 * size * rng.uniform(0.05, 0.6)})

    def passed(self, omega: Complex) -> Complex:
        ratios = [1j * omega / (2 * np.pi * self.number(f"corner_{i}")) for i in (1, 2)]
        return np.asarray(ratios[0] / (1 + ratios[0]) * ratios[1] / (1 + ratios[1]))


class CrossAxisSensitivity(SimulatedEffect):
    """The accelerometer takes some motion along the beam for motion across it, at some height above the axis."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CrossAxisSensitivity:
        values = {"sensitivity": either_sign(rng) * 0.05 * size, "height": SENSOR_HEIGHT * rng.uniform(0.0, 1.2)}
        return cls(size, "at_a_height", values)

    def sensed(self, shape: Real, modes: FreeModes, article: SimulatedArticle) -> Real:
        place = article.sensor_position
        along = modes.shape("x", place) - self.number("height") * modes.shape("r", place)
        return shape + self.number("sensitivity") * along


class ImpactAngle(SimulatedEffect):
    """Blows lean along the beam, by an angle that drifts along the rows, or scatters from one to the next."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ImpactAngle:
        law, mean = one_of(rng, "drifting", "scattering"), either_sign(rng) * 4.0 * size
        walk = draw_curve(rng, "walk")
        angles = {
            row.name: mean * (1.0 + 0.3 * float(curve(walk, "walk", i / (len(MEASURED) - 1))))
            if law == "drifting"
            else mean * (1.0 + 0.4 * float(np.clip(rng.standard_normal(), -2, 2)))
            for i, row in enumerate(MEASURED)
            if row.direction == "y"
        }
        return cls(size, law, {"mean_deg": mean} | {f"angle_{name}": angle for name, angle in angles.items()})

    def struck(self, load: Load, row: Row) -> Load:
        angle = np.radians(float(self.values.get(f"angle_{row.name}", 0.0)))
        return replace(load, x=load.x + load.y * np.sin(angle), y=load.y * np.cos(angle))
