"""Joints whose stiffness and loss follow how far they move."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter

MIDDLE = 25e-6
"""m, zero to peak, at which stiffness and loss keep the values that the baseline gives them."""
BLOW_AMPLITUDE = Parameter("x_100", "m", 3e-6, 1.0, positive=True)
"""Zero to peak at a joint under blows of 100 N, at low frequency where a law lets it fall."""
FALL = Parameter("fall", "1", 0.5, 0.8)
"""Power of frequency with which that amplitude falls above the first modes."""
FIRST_MODES = 80.0
"""Hz; below, a beam on joints moves as the blow drives it, and above less and less."""
KNOTS = (0.3e-6, 1.2e-6, 5e-6, 80e-6)
"""m, of a curve that is also zero at `MIDDLE`."""
THROUGH_KNOTS = np.linalg.inv(np.log(np.array(KNOTS) / MIDDLE)[:, None] ** np.arange(1, len(KNOTS) + 1))
"""Takes heights at the knots to the coefficients of a polynomial in the logarithm of amplitude over `MIDDLE`."""
SAME = 1e-6
"""Relative difference below which two levels, or two amplitudes, are the same."""
SHEAR_ALONE = np.array([1.0, 0.0, 0.0])[:, None, None]


def blow_amplitude(given: Given, loading: Loading, component: bool) -> Real:
    """(n,) amplitude of the cylinders, m: as measured in the tester, or in proportion to the blows under the beam."""
    if loading.tester:
        return loading.deformation(component)
    falling = (1 + (loading.frequency / FIRST_MODES) ** 2) ** (-given.get("fall", 0.0) / 2)
    return np.asarray(given["x_100"] * loading.level * falling)


@dataclass(frozen=True)
class AmplitudeDependence(Effect):
    """Stiffness falls and loss peaks with amplitude, as in filled rubber (Payne's effect).

    Kraus' law (G. Kraus, J. Appl. Polym. Sci. 39, 1984, 75-92), in shear to a share of its size in compression.

    Attributes:
        component: whether a cylinder at 45 degrees follows the components of its deformation, or the whole.
    """

    id = "amplitude_dependence"
    title = "stiffness and loss that follow amplitude"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law = "Kraus"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("k0_over_kinf", "1", 2.0, 0.35, positive=True),
        Parameter("xc", "m", 25e-6, 0.9, positive=True, starts=(-0.5, 0.7)),
        Parameter("m", "1", 0.55, 0.2, positive=True),
        Parameter("loss_peak", "1", 0.8, 0.6),
        Parameter("shear_share", "1", 0.9, 0.2),
        BLOW_AMPLITUDE,
        FALL,
    )
    component: bool = False

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return cls(component=False), cls(component=True)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = blow_amplitude(given, loading, self.component)
        storage, loss = self._law(given, amplitude)
        unit, unit_loss = self._law(given, np.array([MIDDLE]))
        return cylinders.scaled(storage / unit, loss / unit_loss)

    def _law(self, given: Given, amplitude: Real) -> tuple[Real, Real]:
        """(3, n) k' and k'', up to a factor."""
        size = (amplitude / given["xc"]) ** given["m"]
        ratio = (given["k0_over_kinf"] - 1) * (1 + (given["shear_share"] - 1) * SHEAR_ALONE)
        return 1 + ratio / (1 + size**2), 1 + 2 * given["loss_peak"] * size / (1 + size**2)


class AmplitudeCurve(AmplitudeDependence):
    """Any smooth curve over the logarithm of amplitude, of storage and of loss, in shear to a share of its own."""

    law = "smooth curve"

    own_parameters = (
        *(Parameter(f"{part}_{1e6 * x:g}um", "1", 0.0, 0.35) for part in ("storage", "loss") for x in KNOTS),
        *(Parameter(f"shear_share_of_{part}", "1", 0.9, 0.2) for part in ("storage", "loss")),
        BLOW_AMPLITUDE,
        FALL,
    )

    def _law(self, given: Given, amplitude: Real) -> tuple[Real, Real]:
        ratio = np.log(np.clip(amplitude, min(KNOTS), max(KNOTS)) / MIDDLE)
        return self._factor(given, "storage", ratio), self._factor(given, "loss", ratio)

    def _factor(self, given: Given, part: str, ratio: Real) -> Real:
        """(3, n), one at `MIDDLE`."""
        heights = np.array([given[f"{part}_{1e6 * x:g}um"] for x in KNOTS])
        exponent = np.polyval([*(THROUGH_KNOTS @ heights)[::-1], 0.0], ratio)
        return np.asarray(np.exp(exponent * (1 + (given[f"shear_share_of_{part}"] - 1) * SHEAR_ALONE)))


@dataclass(frozen=True)
class AmplitudeTable(Effect):
    """No law: a factor for each configuration and amplitude of the tester, and for each level of the hammer.

    Under the beam, shear and compression have a factor each, which may follow a power of frequency.

    Attributes:
        amplitudes: of the tester, m, without the middle one, to which the others are compared.
        levels: of the hammer, over 100 N.
    """

    id = "amplitude_dependence"
    title = "stiffness and loss that follow amplitude"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law = "table"
    interpolates = False
    amplitudes: tuple[float, ...] = ()
    levels: tuple[float, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        levels = sorted({each.peak_force for each in measurement.sets})
        points = measurement.points
        found = [] if points is None else sorted({float(x) for x in points.amplitude})
        middle = len(found) // 2
        amplitudes = [x for place, x in enumerate(found) if place != middle]
        return (cls(tuple(amplitudes), tuple(level / 100.0 for level in levels[0 if found else 1 :])),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        tested = [f"{way}_{x * 2e3:g}mm" for x in self.amplitudes for way in ("straight", "sheared", "angled")]
        struck = [f"{way}_{100 * level:g}N" for level in self.levels for way in ("shear", "compression")]
        own = [Parameter(f"{part}_{name}", "1", 0.0, 0.35) for name in tested + struck for part in ("storage", "loss")]
        return (*own, Parameter("lean", "1", 0.0, 0.1), Parameter("lean_of_loss", "1", 0.0, 0.1))

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        factors = [self._exponent(given, part, loading) for part in ("storage", "loss")]
        return cylinders.scaled(np.exp(factors[0]), np.exp(factors[1]))

    def _exponent(self, given: Given, part: str, loading: Loading) -> Real:
        """(3, n) logarithm of a factor."""
        found = np.zeros((3, 1, loading.frequency.size))
        if loading.tester:
            for x in self.amplitudes:
                here = np.abs(loading.amplitude - x) < SAME * x
                names = [f"{part}_{way}_{x * 2e3:g}mm" for way in ("straight", "sheared", "angled")]
                straight, sheared, angled = (given[name] for name in names)
                ways = np.array([sheared, straight, straight])[:, None, None]
                found = found + here * np.where(loading.angled, angled, ways)
            return found
        for level in self.levels:
            here = np.abs(loading.level - level) < SAME * level
            shear, compression = (given[f"{part}_{way}_{100 * level:g}N"] for way in ("shear", "compression"))
            found = found + here * np.array([shear, compression, compression])[:, None, None]
        leaning = given["lean" if part == "storage" else "lean_of_loss"]
        return found + leaning * np.log(loading.frequency / 200.0)


class CubicStiffness(Effect):
    """Stiffness changes with the square of amplitude, without loss: k (1 + beta x^2).

    At 0.05 mm zero to peak, a beta of 1e8 makes 25 %.
    """

    id = "cubic_stiffness"
    title = "cubic stiffness"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law = "square of amplitude"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("beta", "1/m^2", 0.0, 1e8), BLOW_AMPLITUDE, FALL)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = blow_amplitude(given, loading, component=True)
        return cylinders.scaled(1 + given["beta"] * amplitude**2, 1.0)


class SaturatingStiffness(CubicStiffness):
    """k (1 + beta x^2 / (1 + (x / x_s)^2)): the change levels off beyond an amplitude x_s."""

    law = "levelling off"
    own_parameters = (*CubicStiffness.own_parameters, Parameter("x_s", "m", 60e-6, 0.7, positive=True))

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        square = blow_amplitude(given, loading, component=True) ** 2
        return cylinders.scaled(1 + given["beta"] * square / (1 + square / given["x_s"] ** 2), 1.0)


TRANSLATION = np.array([1.0, 1.0, 0.0])[:, None, None]


class CoulombFriction(Effect):
    """Dry friction beside each cylinder, in shear and in compression: 4 F_c / (pi x) on the loss, F_c of 0.1 to 5 N.

    The loss of a slider is limited to the stiffness of the spring beside it.
    """

    id = "coulomb_friction"
    title = "dry friction"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law = "sliding"
    own_parameters = (Parameter("F_c", "N", 0.7, 1.0, positive=True, starts=(-2.5, -1.2, 0.8)), BLOW_AMPLITUDE, FALL)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = blow_amplitude(given, loading, component=True)
        rubbing = np.minimum(4 * given["F_c"] / (np.pi * amplitude), cylinders.storage)
        return Cylinders(cylinders.storage, np.asarray(cylinders.loss + TRANSLATION * rubbing))


class StickingFriction(Effect):
    """A slider behind a spring, which sticks at small amplitudes (Jenkins' element by harmonic balance).

    A step from a stiff spring goes beyond what the tester shows: a search starts from a soft one too.
    """

    id = "coulomb_friction"
    title = "dry friction"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law = "sticking and sliding"
    own_parameters = (
        Parameter("F_c", "N", 1.5, 0.9, positive=True),
        Parameter("stick", "1", 0.2, 0.6, positive=True, starts=(-3.0, -1.5, 0.0)),
        BLOW_AMPLITUDE,
        FALL,
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        stick = TRANSLATION * given["stick"] * cylinders.storage
        slipping = blow_amplitude(given, loading, component=True) * np.maximum(stick, 1e-9)
        ratio = np.minimum(given["F_c"] / slipping, 1.0)
        turn = np.arccos(1 - 2 * ratio)
        return Cylinders(
            np.asarray(cylinders.storage + stick / np.pi * (turn - np.sin(2 * turn) / 2)),
            np.asarray(cylinders.loss + 4 * stick * ratio * (1 - ratio) / np.pi),
        )
