"""Effects on spring and damper: dependence on amplitude, frequency or temperature, and other kinds of damping.

Each changes the properties `stiffness`, `loss_factor`, `damping` or `cubic`, wherever a simulator has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Given, Mechanism
from analysis.gap.jenkins_element import jenkins_element
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Conditions
from analysis.gap.structures.effect import Properties, StructureEffect
from analysis.gap.structures.measured_amplitude import check_scale

KNOTS = 6
"""Number of knots of a smooth function of amplitude, over the measured range."""
LEAST_STIFFNESS = 0.05
"""Least share of the stiffness after a law of amplitude, also far outside the measured range."""
REFERENCE_FREQUENCY = 10.0
"""Hz, at which laws of frequency do not change the stiffness."""
REFERENCE_TEMPERATURE = 20.0
"""degC, at which laws of temperature do not change the stiffness."""


def material_effects(amplitudes: tuple[float, float] | None) -> tuple[StructureEffect, ...]:
    """All effects of this file that could show.

    Args:
        amplitudes: least and largest of displacement, zeros if none is other than zero; None where none is known.
    """
    found: list[StructureEffect] = [
        ViscousDamping(),
        PowerOfFrequency(),
        FractionalZener(),
        ExponentialInTemperature(),
        WilliamsLandelFerry(),
        Arrhenius(),
    ]
    if amplitudes is not None:
        least, largest = amplitudes
        found += [CubicSpring(largest), PowerOfAmplitude(largest), Saturating(largest), SlippingSpring(largest)]
        if largest > 1.5 * least:
            found.append(SmoothAmplitude(tuple(np.geomspace(least, largest, KNOTS).tolist())))
    return tuple(found)


@dataclass(frozen=True)
class OfAmplitude(StructureEffect):
    """Stiffness and loss that follow the amplitude of displacement.

    Attributes:
        largest: largest measured amplitude, m, to which parameters refer; zero if there is none.
    """

    mechanism: ClassVar[Mechanism] = Mechanism.JOINT_AMPLITUDE
    needs: ClassVar[frozenset[str]] = frozenset({"amplitude"})
    largest: float = 1.0

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Relative to the largest amplitude.

        Raises:
            AnalysisError: that is zero.
        """
        check_scale(self.largest)
        return self.own_parameters


def _softened(properties: Properties, stiffness: Real, loss: Real) -> Properties:
    """Properties with the storage stiffness changed by a share of itself, and loss added as a share of it."""
    before = properties["stiffness"]
    after = before * (1 + np.maximum(stiffness, LEAST_STIFFNESS - 1))
    return {
        **properties,
        "stiffness": after,
        "loss_factor": (properties["loss_factor"] * before + loss * before) / after,
    }


class AmplitudeDependence(OfAmplitude):
    """Laws by which stiffness falls and loss grows with amplitude."""

    id = "amplitude_dependence"
    title = "stiffness falls and loss grows with amplitude"


class PowerOfAmplitude(AmplitudeDependence):
    """Stiffness falls and loss grows with a power of amplitude, as under micro-slip."""

    law = "power of amplitude"
    own_parameters = (
        Parameter("softening", "1", 0.0, 0.1),
        Parameter("loss", "1", 0.0, 0.1),
        Parameter("exponent", "1", 1.0, 0.5, positive=True),
    )

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """Changes in proportion to a power of amplitude, from their shares at the largest amplitude."""
        share = (conditions["amplitude"] / self.largest) ** given["exponent"]
        return _softened(properties, -given["softening"] * share, given["loss"] * share)


class Saturating(AmplitudeDependence):
    """Stiffness falls from one plateau to another, with most loss between (the Kraus form)."""

    law = "between two plateaus"
    own_parameters = (
        Parameter("softening", "1", 0.0, 0.2),
        Parameter("loss", "1", 0.0, 0.2),
        Parameter("half_amplitude", "1", 0.3, 1.0, positive=True),
    )

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """`half_amplitude`: amplitude at half the fall, over the largest measured one."""
        ratio = conditions["amplitude"] / self.largest / given["half_amplitude"]
        fall, peak = ratio / (1 + ratio), 2 * np.sqrt(ratio) / (1 + ratio)
        return _softened(properties, -given["softening"] * fall, given["loss"] * peak)


class SlippingSpring(OfAmplitude):
    """A spring in series with dry friction, beside the structure (Jenkins element, first harmonic)."""

    id = "coulomb_friction"
    title = "dry friction in the joint"
    law = "Jenkins element"
    own_parameters = (
        Parameter("stiffness_share", "1", 0.0, 0.1, least=0.0, starts=(0.2, 0.05)),
        Parameter("slip_amplitude", "1", 0.2, 1.0, positive=True),
    )

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """It sticks below the slip amplitude, which is relative to the largest; harmonic balance beyond it."""
        stick, slip = jenkins_element(given["slip_amplitude"] * self.largest / conditions["amplitude"])
        share = given["stiffness_share"]
        return _softened(properties, share * stick, share * slip)


class CubicSpring(OfAmplitude):
    """A force that grows with the cube of displacement (Duffing)."""

    id = "cubic_stiffness"
    title = "a cubic spring"
    law = "Duffing"
    form_is_known = True
    own_parameters = (Parameter("share", "1", 0.0, 0.3),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """`share`: the cubic force over the linear one, at the largest amplitude."""
        del conditions
        cubic = given["share"] * np.max(properties["stiffness"]) / self.largest**2
        return {**properties, "cubic": properties["cubic"] + cubic}


@dataclass(frozen=True)
class SmoothAmplitude(StructureEffect):
    """Stiffness and loss as smooth functions of amplitude, in place of a law.

    Attributes:
        knots: amplitudes, m, each a constant factor above the one before.
    """

    id: ClassVar[str] = Mechanism.JOINT_AMPLITUDE
    title: ClassVar[str] = "stiffness and loss follow amplitude, by no known law"
    mechanism: ClassVar[Mechanism] = Mechanism.JOINT_AMPLITUDE
    law: ClassVar[str] = "a smooth function of amplitude"
    law_free: ClassVar[bool] = True
    needs: ClassVar[frozenset[str]] = frozenset({"amplitude"})
    knots: tuple[float, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The rise of stiffness and of loss from each knot to the next."""
        return tuple(
            Parameter(f"{name}_{place}", "1", 0.0, 0.02)
            for name in ("stiffness", "loss")
            for place in range(1, len(self.knots))
        )

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """Curves that are zero at the first knot."""
        stiffness, loss = (self._curve(given, name, conditions["amplitude"]) for name in ("stiffness", "loss"))
        return _softened(properties, stiffness, loss)

    def _curve(self, given: Given, name: str, amplitude: Real) -> Real:
        heights = np.cumsum([0.0, *(given[f"{name}_{place}"] for place in range(1, len(self.knots)))])
        step = np.log(self.knots[1] / self.knots[0])
        return smooth(heights, np.log(np.maximum(amplitude, 1e-300) / self.knots[0]) / step)


def smooth(heights: Real, places: Real) -> Real:
    """A smooth curve through heights at 0, 1, 2 ..., at `places` of any shape; straight beyond its ends.

    Cubic Hermite pieces, whose slopes are the mean of those to both neighbours.
    """
    rises = np.diff(heights)
    slopes = np.concatenate([rises[:1], (rises[1:] + rises[:-1]) / 2, rises[-1:]])
    inside = np.clip(places, 0.0, heights.size - 1.0)
    left = np.minimum(inside.astype(int), heights.size - 2)
    t, rise = inside - left, rises[left]
    first, last = slopes[left], slopes[left + 1]
    curve = heights[left] + t * (first + t * (3 * rise - 2 * first - last + t * (first + last - 2 * rise)))
    return np.asarray(curve + (places - inside) * np.where(places > inside, slopes[-1], slopes[0]))


class ViscousDamping(StructureEffect):
    """Viscous damping in addition to or in place of the structural one: loss grows with frequency."""

    id = "viscous_damping"
    title = "damping is viscous, not structural"
    mechanism = Mechanism.JOINT_FREQUENCY
    form_is_known = True
    needs = frozenset[str]()
    own_parameters = (Parameter("viscous", "1", 0.0, 1.0, least=0.0, starts=(0.5,)),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """`viscous`: share of the loss at the natural frequency that grows with frequency; the rest stays."""
        del conditions
        stiffness, mass = properties["stiffness"], properties["mass"]
        natural = np.sqrt(np.max(stiffness) / mass) if np.all(np.asarray(mass) > 0) else 2 * np.pi * REFERENCE_FREQUENCY
        loss, share = properties["loss_factor"], given["viscous"]
        return {
            **properties,
            "loss_factor": loss * (1 - share),
            "damping": properties["damping"] + share * loss * stiffness / natural,
        }


class FrequencyDependence(StructureEffect):
    """Laws by which stiffness and loss follow frequency."""

    id = "frequency_dependence"
    title = "stiffness and loss follow frequency"
    mechanism = Mechanism.JOINT_FREQUENCY
    needs = frozenset({"frequency"})


class PowerOfFrequency(FrequencyDependence):
    """Stiffness and loss grow with a power of frequency, causally: k (i f / f0)^n."""

    law = "power of frequency"
    own_parameters = (Parameter("exponent", "1", 0.0, 0.1),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """At the reference frequency nothing changes, except for the loss that the exponent brings.

        An exponent below zero takes away loss; it goes no further than to none, as no material gives energy.
        """
        ratio = np.maximum(np.abs(conditions["frequency"]), 1e-9) / REFERENCE_FREQUENCY
        least = -np.arctan(np.maximum(np.min(properties["loss_factor"]), 0.0)) / (np.pi / 2)
        return _multiplied(properties, np.asarray((1j * ratio) ** np.maximum(given["exponent"], least)))


class FractionalZener(FrequencyDependence):
    """Stiffness rises from rubber to glass over frequency (fractional Zener)."""

    law = "fractional Zener"
    own_parameters = (
        Parameter("rise", "1", 3.0, 1.5, positive=True, starts=(0.0, 1.5)),
        Parameter("corner", "Hz", 10.0, 4.0, positive=True, starts=(-1.0, 0.0, 1.0)),
        Parameter("order", "1", 0.4, 0.5, positive=True),
    )

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """`rise`: stiffness of the glass over that of the rubber, less one; `properties` has that of the glass."""
        power = (1j * np.maximum(np.abs(conditions["frequency"]), 1e-12) / given["corner"]) ** min(given["order"], 1.0)
        rise = given["rise"]
        return _multiplied(properties, np.asarray((1 + (1 + rise) * power) / (1 + power) / (1 + rise)))


def _multiplied(properties: Properties, factor: Complex) -> Properties:
    """Properties with the complex stiffness k (1 + i loss) times a complex factor."""
    whole = properties["stiffness"] * (1 + 1j * properties["loss_factor"]) * factor
    return {**properties, "stiffness": whole.real, "loss_factor": whole.imag / whole.real}


class TemperatureShift(StructureEffect):
    """Laws by which stiffness follows temperature."""

    id = "temperature_shift"
    title = "stiffness follows temperature"
    mechanism = Mechanism.JOINT_STATE


class ExponentialInTemperature(TemperatureShift):
    """Stiffness falls exponentially with temperature, by the same share for each kelvin."""

    law = "exponential in temperature"
    needs = frozenset({"temperature"})
    own_parameters = (Parameter("per_kelvin", "1/K", 0.0, 0.02),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """exp(-a (T - T0))."""
        factor = np.exp(-given["per_kelvin"] * (conditions["temperature"] - REFERENCE_TEMPERATURE))
        return {**properties, "stiffness": properties["stiffness"] * factor}


class WilliamsLandelFerry(TemperatureShift):
    """Time-temperature superposition: warmer is slower (M. L. Williams, R. F. Landel, J. D. Ferry, JACS 77, 1955)."""

    law = "Williams-Landel-Ferry"
    needs = frozenset({"temperature", "frequency"})
    own_parameters = (
        Parameter("c1", "1", 10.0, 0.6, positive=True),
        Parameter("c2", "K", 150.0, 0.6, positive=True),
    )

    def conditions(self, given: Given, conditions: Conditions) -> Conditions:
        """The reduced frequency takes the place of frequency."""
        warmer = conditions["temperature"] - REFERENCE_TEMPERATURE
        exponent = -given["c1"] * warmer / np.maximum(given["c2"] + warmer, 1.0)
        return {**conditions, "frequency": conditions["frequency"] * 10 ** np.clip(exponent, -60, 60)}


class Arrhenius(TemperatureShift):
    """Time-temperature superposition with an activation energy."""

    law = "Arrhenius"
    needs = frozenset({"temperature", "frequency"})
    own_parameters = (Parameter("activation", "kJ/mol", 200.0, 0.6, positive=True),)

    def conditions(self, given: Given, conditions: Conditions) -> Conditions:
        """The reduced frequency takes the place of frequency."""
        inverse = 1 / (conditions["temperature"] + 273.15) - 1 / (REFERENCE_TEMPERATURE + 273.15)
        exponent = given["activation"] * 1e3 / 8.314462618 * inverse / np.log(10)
        return {**conditions, "frequency": conditions["frequency"] * 10 ** np.clip(exponent, -60, 60)}
