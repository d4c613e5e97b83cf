"""Effects of the rubber beyond a constant complex stiffness. They show in both rigs or between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from simlab.article import SimulatedArticle, log_uniform
from simlab.beam import Real
from simlab.case.campaign import PRESET_MM, Campaign
from simlab.case.effects.base import CylinderState, SimulatedEffect, either_sign, one_of
from simlab.coupling import Complex

REFERENCE_AMPLITUDE = 10e-6
"""Amplitude (m zero to peak) at which an amplitude law gives the baseline's stiffness."""
REFERENCE_FREQUENCY = 70.0
"""Frequency (Hz) at which a frequency law gives the baseline's stiffness."""
REFERENCE_KELVIN = 296.15


class AmplitudeDependence(SimulatedEffect):
    """Filler contacts break: stiffness falls with amplitude, and loss peaks while it falls.

    Laws, each over its value at 10 um: Kraus's agglomeration (Rubber Chem. Technol. 57, 1984, 48); contacts with
    log-normal breaking amplitudes; a power law that levels off towards small amplitudes.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> AmplitudeDependence:
        law = one_of(rng, "kraus", "kraus", "contacts", "power")
        values: dict[str, float | str] = {"k0_over_kinf": 1.0 + 2.0 * size}
        if law == "kraus":
            values |= {"m": rng.uniform(0.4, 0.7), "xc": log_uniform(rng, 5e-6, 100e-6)}
        elif law == "contacts":
            values |= {"median": log_uniform(rng, 8e-6, 80e-6), "spread": rng.uniform(0.8, 1.5)}
        else:
            values |= {"x0": log_uniform(rng, 3e-6, 30e-6)}
        values["loss_peak"] = size * rng.uniform(0.4, 1.4)
        values["shear_share"] = 1.0 if rng.random() < 0.5 else rng.uniform(0.5, 1.0)
        values["felt"] = one_of(rng, "component", "component", "whole")
        return cls(size, law, values)

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        amplitude = state.deformation if self.values["felt"] == "whole" else state.amplitude
        ratio = self.number("k0_over_kinf")
        changed = stiffness.copy()
        for column, share in enumerate((self.number("shear_share"), 1.0, 1.0)):
            own = 1.0 + share * (ratio - 1.0)
            elastic, loss = self._relative(amplitude, own)
            at_elastic, at_loss = self._relative(np.array([REFERENCE_AMPLITUDE]), own)
            before = stiffness[:, column]
            changed[:, column] = before.real * (elastic / at_elastic) + 1j * before.imag * (loss / at_loss)
        return changed

    def _relative(self, amplitude: Real, ratio: float) -> tuple[Real, Real]:
        """Storage and loss stiffness at `amplitude`, each over what is left of it at large amplitude."""
        peak = self.number("loss_peak")
        if self.law == "kraus":
            root = (amplitude / self.number("xc")) ** self.number("m")
            return 1.0 + (ratio - 1.0) / (1.0 + root**2), 1.0 + 2.0 * peak * root / (1.0 + root**2)
        if self.law == "contacts":
            z = np.log(amplitude / self.number("median")) / self.number("spread")
            elastic = ratio - (ratio - 1.0) * ndtr(z)
            return np.asarray(elastic), np.asarray(1.0 + peak * np.exp(-0.5 * z**2))
        # the whole range of stiffness is passed between no amplitude and 100 um
        power = np.log(ratio) / np.log1p(100e-6 / self.number("x0"))
        elastic = (1.0 + amplitude / self.number("x0")) ** -power
        return elastic, elastic ** (1.0 - min(peak, 0.9))


class CubicStiffness(SimulatedEffect):
    """A spring that hardens or softens with the square of amplitude: k (1 + beta x^2), equivalent linear.

    It keeps a fifth of its stiffness at whatever amplitude, which is beyond those of a campaign.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CubicStiffness:
        law = one_of(rng, "quadratic", "saturating")
        return cls(size, law, {"beta": either_sign(rng) * size * 0.3 / (50e-6) ** 2})

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        square = state.amplitude**2
        if self.law == "saturating":
            square = square / (1.0 + square / (60e-6) ** 2)
        kept = np.maximum(1.0 + self.number("beta") * square, 0.2)
        return np.asarray(stiffness.real * kept[:, None] + 1j * stiffness.imag)


class CoulombFriction(SimulatedEffect):
    """Dry friction beside each spring: 4 F_c / (pi x) on the imaginary part, or a slider that first sticks elastically.

    The second law is Jenkins's element by harmonic balance: with a stick stiffness K and F_c / K < x, the loss is
    4 F_c (1 - F_c / (K x)) / (pi x), and K itself adds to the spring below.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> CoulombFriction:
        law = one_of(rng, "coulomb", "jenkins")
        force = 0.1 * 50.0**size if law == "coulomb" else 5.0 * size
        return cls(size, law, {"F_c": force, "stick": rng.uniform(0.1, 0.4)})

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        force, amplitude = self.number("F_c"), state.amplitude[:, None]
        changed = stiffness.copy()
        for column in (0, 1):
            if self.law == "coulomb":
                # no slider dissipates more than the spring beside it could hold
                loss = np.minimum(4.0 * force / (np.pi * amplitude[:, 0]), stiffness[:, column].real)
                changed[:, column] += 1j * loss
            else:
                stick = self.number("stick") * stiffness[:, column].real
                changed[:, column] += jenkins(force, stick, amplitude[:, 0])
        return changed


def jenkins(force: float, stick: Real, amplitude: Real) -> Complex:
    """(n,) equivalent stiffness of a spring `stick` in series with a slider of `force` N at `amplitude`."""
    ratio = np.minimum(force / (stick * amplitude), 1.0)
    turn = np.arccos(1.0 - 2.0 * ratio)
    elastic = stick / np.pi * (turn - 0.5 * np.sin(2.0 * turn))
    loss = 4.0 * stick * ratio * (1.0 - ratio) / np.pi
    return np.asarray(elastic + 1j * loss)


class FrequencyDependence(SimulatedEffect):
    """Stiffness and loss tied over frequency: fractional Zener, four Maxwell elements, or a spring-pot in parallel."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> FrequencyDependence:
        law = one_of(rng, "fractional_zener", "prony4", "springpot")
        if law == "fractional_zener":
            f0 = log_uniform(rng, 5.0, 500.0)
            values = {"B": 1.0 + size, "C": 1.0, "a": rng.uniform(0.2, 0.7), "tau": 1.0 / (2 * np.pi * f0)}
        elif law == "prony4":
            centres = np.array([8.0, 45.0, 220.0, 900.0]) * np.exp(rng.uniform(-0.3, 0.3, 4))
            values = {f"f{i}": float(f) for i, f in enumerate(centres, 1)}
            values |= {f"g{i}": float(g) for i, g in enumerate(size * rng.uniform(0.2, 0.35, 4), 1)}
        else:
            values = {"g": 0.4 * size, "a": rng.uniform(0.2, 0.6)}
        return cls(size, law, values)

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        factor = self._factor(state.frequency) / self._factor(np.array([REFERENCE_FREQUENCY])).real
        return stiffness * factor[:, None]

    def _factor(self, frequency: Real) -> Complex:
        if self.law == "fractional_zener":
            power = (2j * np.pi * frequency * self.number("tau")) ** self.number("a")
            return np.asarray((1.0 + self.number("B") * power) / (1.0 + self.number("C") * power))
        if self.law == "prony4":
            ratios = [(self.number(f"g{i}"), 1j * frequency / self.number(f"f{i}")) for i in (1, 2, 3, 4)]
            return np.asarray(1.0 + sum(g * ratio / (1.0 + ratio) for g, ratio in ratios))
        return np.asarray(1.0 + self.number("g") * (1j * frequency / REFERENCE_FREQUENCY) ** self.number("a"))


class LossLaw(SimulatedEffect):
    """Loss that follows a power of frequency, or part of it viscous; of every mechanism or of one."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> LossLaw:
        law = one_of(rng, "power", "power", "part_viscous")
        sign = either_sign(rng) if law == "power" else 1.0
        mechanism = one_of(rng, "all", "all", "shear", "compression")
        # a loss that falls with frequency meets the baseline lower, or it would be all loss at the first sine points
        f0 = log_uniform(rng, 50.0, 200.0) if sign > 0 else log_uniform(rng, 20.0, 80.0)
        return cls(size, law, {"p": sign * size, "f0": f0, "mechanism": mechanism})

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        changed, factor = stiffness.copy(), self._factor(state.frequency)
        columns = {"all": [0, 1, 2], "shear": [0], "compression": [1, 2]}[str(self.values["mechanism"])]
        for column in columns:
            changed[:, column] = stiffness[:, column].real + 1j * stiffness[:, column].imag * factor
        return changed

    def _factor(self, frequency: Real) -> Real:
        """(n,) of the loss."""
        p, ratio = self.number("p"), frequency / self.number("f0")
        return np.asarray(ratio**p if self.law == "power" else 1.0 - p + p * ratio)


class TemperatureShift(SimulatedEffect):
    """The tester's room is colder than the beam's by delta_t; its thermometer may hang elsewhere and not show it.

    log10 a_T by Williams, Landel and Ferry (J. Am. Chem. Soc. 77, 1955, 3701) with their universal constants about a
    glass transition of 223 K, or by Arrhenius; on a rubber's plateau stiffness and loss go as small powers of a_T.
    """

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> TemperatureShift:
        law = one_of(rng, "wlf", "arrhenius")
        values: dict[str, float | str] = {
            "delta_t": either_sign(rng) * 10.0 * size,
            "stiffness_power": rng.uniform(0.08, 0.16),
            "loss_power": rng.uniform(0.10, 0.25),
            "thermometer": one_of(rng, "shows", "hides"),
        }
        if law == "arrhenius":
            values["activation_kelvin"] = rng.uniform(8e3, 16e3)
        return cls(size, law, values)

    def measured(self, campaign: Campaign) -> Campaign:
        if self.values["thermometer"] == "hides":
            return campaign
        shown = campaign.points.temperature - self.number("delta_t")
        return replace(campaign, points=replace(campaign.points, temperature=shown))

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        if not state.in_tester:
            return stiffness
        shift = self._log_shift(REFERENCE_KELVIN - self.number("delta_t")) - self._log_shift(REFERENCE_KELVIN)
        elastic = float(np.exp(self.number("stiffness_power") * shift))
        loss = float(np.exp(self.number("loss_power") * shift))
        return stiffness.real * elastic + 1j * stiffness.imag * elastic * loss

    def _log_shift(self, kelvin: float) -> float:
        if self.law == "wlf":
            above_glass = kelvin - 223.0
            return float(-np.log(10.0) * 17.44 * above_glass / (51.6 + above_glass))
        return self.number("activation_kelvin") / kelvin


class PreloadStiffening(SimulatedEffect):
    """The tester's preset stiffens the rubber, the stand holds it without one: k (1 + s delta), delta in mm."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> PreloadStiffening:
        return cls(size, one_of(rng, "storage_only", "loss_factor_kept", "quadratic"), {"s": size})

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        if not state.in_tester:
            return stiffness
        strain = self.number("s") * PRESET_MM
        if self.law == "quadratic":
            strain += 0.5 * strain**2
        if self.law == "storage_only":
            return stiffness.real * (1.0 + strain) + 1j * stiffness.imag
        return stiffness * (1.0 + strain)


class ConditioningDrift(SimulatedEffect):
    """The tester's work softens the rubber in the order of the test: evenly, only at first, or by logarithm."""

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> ConditioningDrift:
        law = one_of(rng, "linear", "exponential", "logarithmic")
        values = {"d": 0.1 * size}
        if law == "exponential":
            values["knee"] = rng.uniform(0.1, 0.4)
        return cls(size, law, values)

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        if not state.in_tester:
            return stiffness
        progress = state.order
        if self.law == "exponential":
            knee = self.number("knee")
            progress = np.expm1(-state.order / knee) / np.expm1(-1.0 / knee)
        elif self.law == "logarithmic":
            progress = np.log1p(50.0 * state.order) / np.log(51.0)
        return stiffness * (1.0 - self.number("d") * progress)[:, None]
