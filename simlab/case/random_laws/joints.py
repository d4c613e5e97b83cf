"""Effects of the rubber whose laws are random functions."""

from __future__ import annotations

import numpy as np

from simlab.article import SimulatedArticle, log_uniform
from simlab.beam import Real
from simlab.case.campaign import CONFIGURATIONS, PRESET_MM
from simlab.case.effects import elastomer
from simlab.case.effects.base import CylinderState, SimulatedEffect, either_sign, one_of
from simlab.case.effects.elastomer import REFERENCE_AMPLITUDE, jenkins
from simlab.case.random_laws.curves import GRID, curve, draw_curve, logarithmic, rising
from simlab.coupling import Complex

AMPLITUDES = (1e-8, 1e-3)
FREQUENCIES = (1.0, 2000.0)
ELEMENTS = 14
SLIDERS = 9
LARGE = 50e-6
"""Amplitude (m zero to peak) at which a spring that is not linear has its size."""
SOFTEST = 0.3
"""Share of its stiffness that a softening spring keeps at any amplitude."""


class AmplitudeDependence(SimulatedEffect):
    """Stiffness falls with amplitude by a random smooth curve, and the loss factor peaks about where it falls."""

    felt = True

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> AmplitudeDependence:
        values = {
            "drop": 2.0 * size,
            "centre": log_uniform(rng, 4e-6, 80e-6),
            "decades": rng.uniform(0.35, 0.9),
            "loss_height": size * rng.uniform(0.3, 1.4),
            "loss_later": rng.uniform(-0.08, 0.08),
            "shear_share": rng.uniform(0.5, 1.0),
        }
        return cls(size, "random_curve", values | draw_curve(rng, "density"))

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        changed = stiffness.copy()
        for column, (felt, share) in enumerate(((0, self.number("shear_share")), (1, 1.0), (1, 1.0))):
            elastic, loss = self._at(state.amplitudes[:, felt], share)
            at_elastic, at_loss = self._at(np.array([REFERENCE_AMPLITUDE]), share)
            before = stiffness[:, column]
            ratio = elastic / at_elastic
            changed[:, column] = before.real * ratio + 1j * before.imag * ratio * loss / at_loss
        return changed

    def _at(self, amplitude: Real, share: float) -> tuple[Real, Real]:
        """Stiffness over that at large amplitude, and the loss factor over that at small, at `amplitude` (n,) m."""
        u, centre = logarithmic(amplitude, *AMPLITUDES), logarithmic(self.number("centre"), *AMPLITUDES)
        width = self.number("decades") / 5.0
        density = np.exp(0.6 * curve(self.values, "density", GRID) - 0.5 * ((GRID - centre) / width) ** 2)
        loss = np.interp(u - self.number("loss_later"), GRID, density / density.max())
        return 1.0 + share * self.number("drop") * (1.0 - rising(density, u)), 1.0 + self.number("loss_height") * loss


class CubicStiffness(SimulatedEffect):
    """A spring that hardens or softens by a random power of amplitude about two, up to some limit; no loss.

    One that softens reaches its limit before it has no stiffness left.
    """

    felt = True

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CubicStiffness:
        values = {
            "change": either_sign(rng) * 0.3 * size,
            "power": rng.uniform(1.6, 2.4),
            "limit": log_uniform(rng, 50e-6, 300e-6),
            "shear_share": rng.uniform(0.6, 1.0),
        }
        if values["change"] < 0.0:
            farthest = LARGE * ((1.0 - SOFTEST) / -values["change"]) ** (1.0 / values["power"])
            values["limit"] = min(values["limit"], farthest)
        return cls(size, "random_power", values)

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        power, limit = self.number("power"), self.number("limit")
        grown = (state.amplitudes / LARGE) ** power / (1.0 + (state.amplitudes / limit) ** power)
        shares = np.array([self.number("shear_share"), 1.0, 1.0])
        change = self.number("change") * grown[:, [0, 1, 1]] * shares
        return np.asarray(stiffness.real * (1.0 + change) + 1j * stiffness.imag)


class CoulombFriction(SimulatedEffect):
    """Sliders that each stick and slip beside the spring: Iwan's model with random strengths (J. Appl. Mech. 33, 1966).

    Some stick as stiff as others, some slip at a tenth of the mean displacement and some at ten times it.
    """

    felt = True

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CoulombFriction:
        values: dict[str, float | str] = {"force": 0.1 * 50.0**size, "stick": rng.uniform(0.1, 0.4)}
        strengths, springs = np.exp(rng.normal(0.0, 0.9, SLIDERS)), np.exp(rng.normal(0.0, 0.5, SLIDERS))
        values |= {f"force_{i}": float(each) for i, each in enumerate(strengths / strengths.sum())}
        values |= {f"stick_{i}": float(each) for i, each in enumerate(springs / springs.sum())}
        return cls(size, "iwan", values)

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        changed = stiffness.copy()
        for column in (0, 1):
            for i in range(SLIDERS):
                force = self.number("force") * self.number(f"force_{i}")
                stick = self.number("stick") * self.number(f"stick_{i}") * stiffness[:, column].real
                changed[:, column] += jenkins(force, stick, state.amplitudes[:, column])
        return changed


class FrequencyDependence(elastomer.FrequencyDependence):
    """A random spectrum of relaxation times: as many Maxwell elements as a law has no parameters for."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FrequencyDependence:
        return cls(size, "random_spectrum", {"strength": rng.uniform(0.7, 1.3) * size} | draw_curve(rng, "spectrum"))

    def _factor(self, frequency: Real) -> Complex:
        places = np.linspace(0.0, 1.0, ELEMENTS)
        own = 0.5 * (1e4 / 0.5) ** places
        weights = np.exp(curve(self.values, "spectrum", places))
        ratio = 1j * frequency[:, None] / own
        return np.asarray(1.0 + self.number("strength") * (ratio / (1.0 + ratio)) @ (weights / weights.sum()))


class LossLaw(elastomer.LossLaw):
    """Loss that rises or falls with frequency by a random smooth curve; of every mechanism or of one."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> LossLaw:
        mechanism = one_of(rng, "all", "all", "shear", "compression")
        values = {"mean_power": either_sign(rng) * 0.7 * size, "f0": log_uniform(rng, 25.0, 150.0)}
        return cls(size, "random_curve", values | {"mechanism": mechanism} | draw_curve(rng, "density"))

    def _factor(self, frequency: Real) -> Real:
        density = np.exp(0.7 * curve(self.values, "density", GRID))
        u = [rising(density, logarithmic(f, *FREQUENCIES)) for f in (frequency, self.number("f0"))]
        power = self.number("mean_power") * np.log(FREQUENCIES[1] / FREQUENCIES[0])
        return np.asarray(np.exp(power * (u[0] - u[1])))


class TemperatureShift(elastomer.TemperatureShift):
    """The tester's room is colder than the beam's by delta_t; the slope changes with frequency; it may not show."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> TemperatureShift:
        values: dict[str, float | str] = {
            "delta_t": either_sign(rng) * 10.0 * size,
            "stiffness_slope": rng.uniform(0.006, 0.018),
            "loss_slope": rng.uniform(0.004, 0.018),
            "thermometer": one_of(rng, "shows", "shows", "hides"),
        }
        return cls(size, "random_slope", values | draw_curve(rng, "slope"))

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        if not state.in_tester:
            return stiffness
        shape = 1.0 + 0.15 * curve(self.values, "slope", logarithmic(state.frequency, *FREQUENCIES))
        elastic = np.exp(self.number("stiffness_slope") * self.number("delta_t") * shape)[:, None]
        loss = np.exp(self.number("loss_slope") * self.number("delta_t") * shape)[:, None]
        return np.asarray(stiffness.real * elastic + 1j * stiffness.imag * elastic * loss)


class PreloadStiffening(SimulatedEffect):
    """The tester's preset stiffens the rubber, each way of loading by its own share, and its loss by another."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> PreloadStiffening:
        values = {"s": size, "shear_share": rng.uniform(0.1, 1.0), "loss_share": rng.uniform(0.0, 1.2)}
        values |= {f"held_{name}": rng.uniform(0.7, 1.3) for name in CONFIGURATIONS[1:]}  # `s` is that in compression
        return cls(size, "random_shares", values)

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        if state.configuration is None:
            return stiffness
        mounted = np.array([1.0, *(self.number(f"held_{name}") for name in CONFIGURATIONS[1:])])[state.configuration]
        shares = np.array([self.number("shear_share"), 1.0, 1.0])
        strain = self.number("s") * PRESET_MM * mounted[:, None] * shares
        return np.asarray(
            stiffness.real * (1.0 + strain) + 1j * stiffness.imag * (1.0 + self.number("loss_share") * strain)
        )


class ConditioningDrift(SimulatedEffect):
    """The tester's work softens the rubber by a random rising curve of its order."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ConditioningDrift:
        values = {"d": 0.1 * size, "stand_at": float(rng.choice([0.0, rng.uniform()])), "shear": rng.uniform(0.7, 1.2)}
        return cls(size, "random_curve", values | draw_curve(rng, "density"))

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        if not state.in_tester:
            return stiffness
        progress = rising(np.exp(curve(self.values, "density", GRID)), state.order) - self.number("stand_at")
        shares = np.array([self.number("shear"), 1.0, 1.0])
        return np.asarray(stiffness * (1.0 - self.number("d") * progress[:, None] * shares))
