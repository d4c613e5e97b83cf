"""Effects of amplitude on the stiffness and loss of joints."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import BentLaw, Effect, Given, LawOver, Mechanism
from analysis.gap.jenkins_element import jenkins_element
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter
from analysis.gap.smooth_curve import SmoothCurve

MIDDLE = 25e-6
"""m, zero to peak, at which stiffness and loss keep the values that the baseline gives them."""
MOTION = (
    Parameter("motion", "1", 1.0, 0.7, positive=True),
    Parameter("by_force", "1", 1.0, 0.2),
    Parameter("by_row", "1", 0.5, 0.5),
    Parameter("by_joint", "1", 0.5, 0.5),
    Parameter("fall", "1", 0.5, 0.8),
)
"""How the amplitude under blows is defined. `motion`: ratio to that of `analysis.gap.simulation.blow_motion`, known to
a factor of two. `by_force`: power with which it follows a set's motion from one set to another. `by_row`, `by_joint`:
powers of 0 give one value to all blows, or joints and axes, of a set; powers of 1 their own values. `fall`: power of
frequency with which it falls, as each mode follows its own motion."""
SHEAR_ALONE = np.array([1.0, 0.0, 0.0])[:, None, None]


def deformation(loading: Loading, given: Given, component: bool) -> Real:
    """Amplitude of the cylinders, m, as `Loading.deformation` gives it for the parameters `MOTION`."""
    return loading.deformation(component, *(given[each.name] for each in MOTION))


@dataclass(frozen=True)
class AmplitudeDependence(Effect):
    """Stiffness falls and loss peaks with amplitude, as in filled rubber (Payne's effect).

    Kraus' law (G. Kraus, J. Appl. Polym. Sci. 39, 1984, 75-92); the size in shear is a share of that in compression.
    That law gives k'' one value at small and at large amplitude. Filled rubber has more of it at small amplitude
    (J. D. Ulmer, Rubber Chem. Technol. 69, 1996, 15-47): `loss_follows` is 1 where k'' falls as k' does.

    Attributes:
        component: whether a cylinder at 45 degrees follows the components of its deformation, or the whole.
    """

    id = "amplitude_dependence"
    title = "stiffness and loss that follow amplitude"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law_over = LawOver.AMPLITUDE
    follows_motion = True
    law = "Kraus"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("k0_over_kinf", "1", 2.0, 0.35, positive=True),
        Parameter("xc", "m", 25e-6, 0.9, positive=True, starts=(-0.5, 0.7), form=True),
        Parameter("m", "1", 0.55, 0.2, positive=True, form=True),
        Parameter("loss_peak", "1", 0.8, 0.6),
        Parameter("loss_follows", "1", 0.5, 0.5),
        Parameter("shear_share", "1", 0.9, 0.2),
        *MOTION,
    )
    component: bool = False

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return cls(component=False), cls(component=True)

    def bent(self, measurement: Measurement) -> Effect | None:
        return BentDependence(self.component)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = deformation(loading, given, self.component)
        storage, loss = self._law(given, amplitude)
        unit, unit_loss = self._law(given, np.array([MIDDLE]))
        return cylinders.scaled(storage / unit, loss / unit_loss)

    def _law(self, given: Given, amplitude: Real) -> tuple[Real, Real]:
        """(3, n) k' and k'', up to a factor."""
        size = (amplitude / given["xc"]) ** given["m"]
        ratio = (given["k0_over_kinf"] - 1) * (1 + (given["shear_share"] - 1) * SHEAR_ALONE)
        loss = 2 * given["loss_peak"] * size + given["loss_follows"] * ratio
        return 1 + ratio / (1 + size**2), 1 + loss / (1 + size**2)


BEND = SmoothCurve((2.0, 8.0, 25.0, 60.0))
"""Smooth deviation from a law, over amplitude in um."""
BENT = tuple(
    parameter
    for part in ("storage", "loss")
    for parameter in (*BEND.parameters(f"more_{part}_at_um", 0.15), Parameter(f"more_{part}_in_shear", "1", 0.0, 0.15))
)
"""Parameters of a law whose change of k' and of k'', in logarithms, is larger or smaller by a smooth share."""
LEAST = 1e-3
"""Least ratio of k' or k'' for a deviation from a law; the law does not hold where the ratio is smaller."""


def _ratio(after: Real, before: Real) -> Real:
    """`after` over `before`, which broadcast; 1 where `before` is zero, such as rotation without a beam."""
    upper, lower = np.broadcast_arrays(after, before)
    return np.asarray(np.divide(upper, lower, out=np.ones(upper.shape), where=lower != 0.0), dtype=np.float64)


class Bent(BentLaw):
    """Mixin before a law: the law may deviate by the parameters `BENT`, as no joint follows a law exactly."""

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        place = BEND.logarithm(1e6 * deformation(loading, given, getattr(self, "component", True)))
        found = super().cylinders(given, cylinders, loading)

        def power(part: str, after: Real, before: Real) -> Real:
            share = (
                BEND.along(given, f"more_{part}_at_um", place) + given.get(f"more_{part}_in_shear", 0.0) * SHEAR_ALONE
            )
            return np.asarray(np.maximum(_ratio(after, before), LEAST) ** share)

        storage = power("storage", found.storage, cylinders.storage)
        return found.scaled(storage, power("loss", found.loss, cylinders.loss))


@dataclass(frozen=True)
class BentDependence(Bent, AmplitudeDependence):
    """Kraus' law with a smooth deviation."""

    law = "Kraus, bent"
    own_parameters = (
        *AmplitudeDependence.own_parameters,
        *(each for each in BENT if each.name != "more_storage_in_shear"),  # the law has a share in shear of its own
    )


class CubicStiffness(Effect):
    """Stiffness changes with the square of amplitude, without loss: k (1 + beta x^2).

    At 0.05 mm zero to peak, a beta of 1e8 makes 25 %.
    """

    id = "cubic_stiffness"
    title = "cubic stiffness"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law_over = LawOver.AMPLITUDE
    follows_motion = True
    law = "square of amplitude"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("beta", "1/m^2", 0.0, 1e8), *MOTION)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = deformation(loading, given, True)
        return cylinders.scaled(1 + given["beta"] * amplitude**2, 1.0)


class SaturatingStiffness(CubicStiffness):
    """k (1 + beta x^2 / (1 + (x / x_s)^2)): the change levels off beyond an amplitude x_s."""

    law = "levelling off"
    own_parameters = (*CubicStiffness.own_parameters, Parameter("x_s", "m", 60e-6, 0.7, positive=True, form=True))

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        square = deformation(loading, given, True) ** 2
        return cylinders.scaled(1 + given["beta"] * square / (1 + square / given["x_s"] ** 2), 1.0)

    def bent(self, measurement: Measurement) -> Effect | None:
        return BentStiffness()


class BentStiffness(Bent, SaturatingStiffness):
    """`SaturatingStiffness` with a smooth deviation."""

    law = "levelling off, bent"
    own_parameters = (*SaturatingStiffness.own_parameters, *BENT)


TRANSLATION = np.array([1.0, 1.0, 0.0])[:, None, None]


FRICTION_FORCE = Parameter("F_c", "N", 0.7, 1.0, positive=True, starts=(-1.2, 0.8))
"""Friction force of each slider: 0.1 to 5 N."""


class CoulombFriction(Effect):
    """Dry friction beside each cylinder, in shear and in compression: 4 F_c / (pi x) on the loss."""

    id = "coulomb_friction"
    title = "dry friction"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law_over = LawOver.AMPLITUDE
    follows_motion = True
    law = "sliding"
    own_parameters = (FRICTION_FORCE, *MOTION)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        rubbing = 4 * given["F_c"] / (np.pi * deformation(loading, given, True))
        return Cylinders(cylinders.storage, np.asarray(cylinders.loss + TRANSLATION * rubbing))


class StickingFriction(Effect):
    """A slider behind a spring, which sticks up to a displacement (Jenkins' element by harmonic balance).

    Faces in contact slip as a whole after about a micrometre (J. S. Courtney-Pratt, E. Eisner, Proc. R. Soc. A 238,
    1957, 529-550).
    """

    id = "coulomb_friction"
    title = "dry friction"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law_over = LawOver.AMPLITUDE
    follows_motion = True
    law = "sticking and sliding"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        FRICTION_FORCE,
        Parameter("slip", "m", 1e-6, 1.2, positive=True, starts=(-1.0, 1.0), form=True),
        *MOTION,
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        stick = TRANSLATION * given["F_c"] / given["slip"]
        storage, loss = jenkins_element(given["slip"] / deformation(loading, given, True))
        return Cylinders(np.asarray(cylinders.storage + stick * storage), np.asarray(cylinders.loss + stick * loss))

    def bent(self, measurement: Measurement) -> Effect | None:
        return BentFriction()


class BentFriction(Bent, StickingFriction):
    """`StickingFriction` with a smooth deviation."""

    law = "sticking and sliding, bent"
    own_parameters = (*StickingFriction.own_parameters, *BENT)


RATIOS = np.linspace(-14.0, 14.0, 1121)
"""Logarithms of typical slip over amplitude between which a sum over sliders is interpolated."""
SPECTRA = np.fft.rfft([np.concatenate([part, part[::-1]]) for part in jenkins_element(np.exp(RATIOS))])
"""Spectra of k' and of k'' of one slider over `RATIOS`, which are mirrored at their end."""
RADIANS = 2 * np.pi * np.fft.rfftfreq(2 * RATIOS.size, RATIOS[1] - RATIOS[0])
"""Angular frequencies of `SPECTRA`, over the logarithm."""


class ManySliders(Effect):
    """Many sliders behind springs, such as the filler of a rubber: a share of each cylinder's stiffness sticks.

    The displacements at which they slip have a log-normal distribution (W. D. Iwan, J. Appl. Mech. 33, 1966, 893-900).
    F_c is the force of all together when all slide.
    """

    id = "coulomb_friction"
    title = "dry friction"
    mechanism = Mechanism.JOINT_AMPLITUDE
    law_over = LawOver.AMPLITUDE
    follows_motion = True
    law = "many sliders stick and slide"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        FRICTION_FORCE,
        Parameter("share", "1", 0.25, 0.7, positive=True),
        Parameter("spread", "1", 0.8, 0.5, positive=True, form=True),
        *MOTION,
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        stick = TRANSLATION * given["share"] * cylinders.storage
        mean_slip = _ratio(np.full(stick.shape, given["F_c"]), stick)
        typical = np.log(mean_slip / deformation(loading, given, True)) - given["spread"] ** 2 / 2
        # a sum over sliders with a normal distribution of logarithms is a convolution
        summed = np.fft.irfft(SPECTRA * np.exp(-((given["spread"] * RADIANS) ** 2) / 2))
        storage, loss = (np.interp(typical, RATIOS, part[: RATIOS.size]) for part in summed)
        return Cylinders(np.asarray(cylinders.storage + stick * storage), np.asarray(cylinders.loss + stick * loss))

    def bent(self, measurement: Measurement) -> Effect | None:
        return BentSliders()


class BentSliders(Bent, ManySliders):
    """`ManySliders` with a smooth deviation from their distribution."""

    law = "many sliders stick and slide, bent"
    own_parameters = (*ManySliders.own_parameters, *BENT)
