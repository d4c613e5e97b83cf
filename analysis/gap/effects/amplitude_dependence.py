"""Stiffness that falls and loss that peaks with amplitude, as filled rubber does (Payne's effect)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter

MIDDLE = 25e-6
"""m, zero to peak, at which stiffness and loss keep the values that the baseline gives them."""
BLOW_AMPLITUDE = Parameter("x_100", "m", 3e-6, 1.0, positive=True)
"""Zero to peak at a joint under blows of 100 N, at low frequency where a law lets it fall."""
FALL = Parameter("fall", "1", 0.5, 0.8)
"""Power of frequency with which that amplitude falls above the first modes."""
FIRST_MODES = 80.0
"""Hz; below, a beam on joints moves as the blow drives it, and above ever less."""
KNOTS = (0.3e-6, 1.2e-6, 5e-6, 80e-6)
"""m, of a curve that is zero in the middle besides."""
THROUGH_KNOTS = np.linalg.inv(np.log(np.array(KNOTS) / MIDDLE)[:, None] ** np.arange(1, len(KNOTS) + 1))
"""From heights at the knots to the coefficients of a polynomial in the logarithm of amplitude over the middle's."""
SAME = 1e-6
"""Share by which levels, and amplitudes, differ that are one."""
SHEAR_ALONE = np.array([[1.0], [0.0], [0.0]])


def blow_amplitude(given: Given, loading: Loading, component: bool) -> Real:
    """(n,) amplitude that cylinders feel: of the tester, or in proportion to the blows."""
    if loading.tester:
        return loading.felt(component)
    falling = (1 + (loading.frequency / FIRST_MODES) ** 2) ** (-given.get("fall", 0.0) / 2)
    return np.asarray(given["x_100"] * loading.level * falling)


@dataclass(frozen=True)
class AmplitudeDependence(Effect):
    """Kraus' law (G. Kraus, J. Appl. Polym. Sci. 39, 1984, 75-92), in shear to a share of what it is in compression.

    Attributes:
        component: whether a cylinder at 45 degrees feels the components of its deformation, or the whole.
    """

    id = "amplitude_dependence"
    title = "stiffness and loss that follow amplitude"
    law = "Kraus"
    component: bool = False

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return cls(component=False), cls(component=True)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("k0_over_kinf", "1", 2.0, 0.35, positive=True),
            Parameter("xc", "m", 25e-6, 0.9, positive=True, starts=(-0.5, 0.7)),
            Parameter("m", "1", 0.55, 0.2, positive=True),
            Parameter("loss_peak", "1", 0.8, 0.6),
            Parameter("shear_share", "1", 0.9, 0.2),
            BLOW_AMPLITUDE,
            FALL,
        )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = blow_amplitude(given, loading, self.component)
        storage, loss = self._law(given, amplitude)
        unit, unit_loss = self._law(given, np.array([MIDDLE]))
        return cylinders.scaled(storage / unit, loss / unit_loss)

    def _law(self, given: Given, amplitude: Real) -> tuple[Real, Real]:
        """(3, n) k' and k'' in units of their own."""
        size = (amplitude / given["xc"]) ** given["m"]
        ratio = (given["k0_over_kinf"] - 1) * (1 + (given["shear_share"] - 1) * SHEAR_ALONE)
        return 1 + ratio / (1 + size**2), 1 + 2 * given["loss_peak"] * size / (1 + size**2)


@dataclass(frozen=True)
class AmplitudeCurve(AmplitudeDependence):
    """Any smooth curve over the logarithm of amplitude, of storage and of loss, in shear to a share of its own."""

    law = "smooth curve"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        curves = [Parameter(f"{part}_{1e6 * x:g}um", "1", 0.0, 0.35) for part in ("storage", "loss") for x in KNOTS]
        shares = [Parameter(f"shear_share_of_{part}", "1", 0.9, 0.2) for part in ("storage", "loss")]
        return (*curves, *shares, BLOW_AMPLITUDE, FALL)

    def _law(self, given: Given, amplitude: Real) -> tuple[Real, Real]:
        ratio = np.log(np.clip(amplitude, min(KNOTS), max(KNOTS)) / MIDDLE)
        return self._factor(given, "storage", ratio), self._factor(given, "loss", ratio)

    def _factor(self, given: Given, part: str, ratio: Real) -> Real:
        """(3, n), one in the middle."""
        heights = np.array([given[f"{part}_{1e6 * x:g}um"] for x in KNOTS])
        exponent = np.polyval([*(THROUGH_KNOTS @ heights)[::-1], 0.0], ratio)
        return np.asarray(np.exp(exponent * (1 + (given[f"shear_share_of_{part}"] - 1) * SHEAR_ALONE)))


@dataclass(frozen=True)
class AmplitudeTable(Effect):
    """No law at all: factors for each configuration and amplitude of the tester, and for each level of the hammer.

    Under the beam shear and compression have factors of their own, which may lean with frequency.

    Attributes:
        amplitudes: of the tester, m, without the one in the middle that the others are compared with.
        levels: of the hammer.
    """

    id = "amplitude_dependence"
    title = "stiffness and loss that follow amplitude"
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
        found = np.zeros((3, loading.frequency.size))
        if loading.tester:
            for x in self.amplitudes:
                here = np.abs(loading.amplitude - x) < SAME * x
                names = [f"{part}_{way}_{x * 2e3:g}mm" for way in ("straight", "sheared", "angled")]
                straight, sheared, angled = (given[name] for name in names)
                ways = np.array([[sheared], [straight], [straight]])
                found = found + here * np.where(loading.angled, angled, ways)
            return found
        for level in self.levels:
            if abs(loading.level - level) < SAME * level:
                shear, compression = (given[f"{part}_{way}_{100 * level:g}N"] for way in ("shear", "compression"))
                found = found + np.array([[shear], [compression], [compression]])
        leaning = given["lean" if part == "storage" else "lean_of_loss"]
        return found + leaning * np.log(loading.frequency / 200.0)
