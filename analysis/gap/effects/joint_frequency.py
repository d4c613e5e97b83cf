"""Effects of frequency on the stiffness and loss of joints."""

from typing import ClassVar

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given, LawOver, Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.smooth_curve import SmoothCurve

REFERENCE = 50.0
"""Hz, at which stiffness keeps the value that the baseline gives it."""
RELAXATIONS = (2.0, 8.0, 30.0, 100.0, 350.0, 1200.0, 4500.0)
"""Hz, relaxations of the series, for any smooth law between 5 and 1000 Hz, which the rigs cover."""
FEW = (10.0, 80.0, 600.0)
"""Hz, relaxations from which a search for three free ones starts."""


class FrequencyDependence(Effect):
    """A series of relaxations (Prony): any causal law that is smooth over a factor of four in frequency.

    Causality ties stiffness and loss to each other (Kramers-Kronig).
    """

    id = "frequency_dependence"
    title = "stiffness and loss that follow frequency"
    mechanism = Mechanism.JOINT_FREQUENCY
    law_over = LawOver.FREQUENCY
    law = "relaxations"

    own_parameters = tuple(
        Parameter(f"g_{number}", "1", 0.03, 1.2, positive=True) for number in range(1, len(RELAXATIONS) + 1)
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        storage, loss = self._modulus(given, loading.frequency)
        unit, _ = self._modulus(given, np.array([REFERENCE]))
        storage, loss = storage / unit, loss / unit
        return Cylinders(
            np.asarray(cylinders.storage * storage - cylinders.loss * loss),
            np.asarray(cylinders.loss * storage + cylinders.storage * loss),
        )

    def _modulus(self, given: Given, frequency: Real) -> tuple[Real, Real]:
        """(n,) storage and loss over the stiffness at rest."""
        places, strength = self._relaxations(given)
        ratio = frequency / places[:, None]
        return 1 + strength @ (ratio**2 / (1 + ratio**2)), strength @ (ratio / (1 + ratio**2))

    def _relaxations(self, given: Given) -> tuple[Real, Real]:
        """(n,) Hz, and their strengths over the stiffness at rest."""
        return np.array(RELAXATIONS), np.array([given[parameter.name] for parameter in self.parameters])


class FewRelaxations(FrequencyDependence):
    """Three relaxations at any frequencies, far apart or close: sharper than a series at fixed frequencies."""

    law = "three relaxations"

    own_parameters = tuple(
        parameter
        for number, frequency in enumerate(FEW, start=1)
        for parameter in (
            Parameter(f"g_{number}", "1", 0.1, 1.0, positive=True),
            Parameter(f"f_{number}", "Hz", frequency, 0.8, positive=True),
        )
    )

    def _relaxations(self, given: Given) -> tuple[Real, Real]:
        places = range(1, len(FEW) + 1)
        return np.array([given[f"f_{n}"] for n in places]), np.array([given[f"g_{n}"] for n in places])


class FractionalZener(FrequencyDependence):
    """(1 + B (i w tau)^alpha) / (1 + C (i w tau)^alpha) (R. L. Bagley, P. J. Torvik, J. Rheology 27, 1983)."""

    law = "fractional Zener"
    own_parameters = (
        Parameter("ratio", "1", 1.6, 0.5, positive=True),
        Parameter("f", "Hz", 150.0, 1.5, positive=True, starts=(-1.0, 0.5)),
        Parameter("alpha", "1", 0.45, 0.35, positive=True),
    )

    def _modulus(self, given: Given, frequency: Real) -> tuple[Real, Real]:
        alpha, ratio = given["alpha"], given["ratio"]
        size = np.exp(alpha * np.log(frequency / given["f"]))
        turn = alpha * np.pi / 2
        real, imaginary = size * np.cos(turn), size * np.sin(turn)
        below = (1 + real) ** 2 + imaginary**2
        storage = ((1 + ratio * real) * (1 + real) + ratio * imaginary**2) / below
        return storage, (ratio - 1) * imaginary / below


class SpringPot(FrequencyDependence):
    """A spring beside a spring-pot: 1 + g (i f / 100 Hz)^alpha."""

    law = "spring-pot"
    own_parameters = (Parameter("g", "1", 0.0, 0.3), Parameter("alpha", "1", 0.35, 0.4, positive=True))

    def _modulus(self, given: Given, frequency: Real) -> tuple[Real, Real]:
        alpha = given["alpha"]
        size = given["g"] * np.exp(alpha * np.log(frequency / 100.0))
        return 1 + size * np.cos(alpha * np.pi / 2), size * np.sin(alpha * np.pi / 2)


LOSS_REFERENCE = 100.0
"""Hz, at which loss keeps the value that the baseline gives it: about the middle of the tester's band."""
SHEAR, COMPRESSION = (((1.0,),), ((0.0,),), ((0.0,),)), (((0.0,),), ((1.0,),), ((1.0,),))


class LossLaw(Effect):
    """Loss follows frequency while stiffness does not: h proportional to w^p, viscous at p = 1."""

    id = "loss_law"
    title = "loss that follows frequency"
    mechanism = Mechanism.JOINT_FREQUENCY
    law_over = LawOver.FREQUENCY
    law = "power"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("p", "1", 0.0, 0.6),)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        return cylinders.scaled(1.0, np.exp(given["p"] * np.log(loading.frequency / LOSS_REFERENCE)))


class LossLawOfEach(LossLaw):
    """`LossLaw` with one power for shear, and another for compression and rotation."""

    law = "powers of shear and compression"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("p_shear", "1", 0.0, 0.6),
        Parameter("p_compression", "1", 0.0, 0.6),
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        powers = given["p_shear"] * np.array(SHEAR) + given["p_compression"] * np.array(COMPRESSION)
        return cylinders.scaled(1.0, np.exp(powers * np.log(loading.frequency / LOSS_REFERENCE)))


class PartViscous(LossLaw):
    """A part of the loss is viscous, in shear and in compression: 1 + q (f / 100 Hz - 1)."""

    law = "viscous part"
    own_parameters = (Parameter("q_shear", "1", 0.0, 0.5), Parameter("q_compression", "1", 0.0, 0.5))

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        share = given["q_shear"] * np.array(SHEAR) + given["q_compression"] * np.array(COMPRESSION)
        return cylinders.scaled(1.0, 1 + share * (loading.frequency / LOSS_REFERENCE - 1))


BESIDE_POWER = SmoothCurve((8.0, 30.0, 300.0, 800.0), zero=LOSS_REFERENCE)


class LossCurve(LossLawOfEach):
    """`LossLawOfEach` times a smooth curve for shear, and another for compression and rotation."""

    law = "smooth curves of shear and compression"
    own_parameters = (
        *LossLawOfEach.own_parameters,
        *BESIDE_POWER.parameters("shear", 0.3),
        *BESIDE_POWER.parameters("compression", 0.3),
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        shear, compression = (BESIDE_POWER.at(given, name, loading.frequency) for name in ("shear", "compression"))
        curves = np.exp(shear * np.array(SHEAR) + compression * np.array(COMPRESSION))
        return super().cylinders(given, cylinders.scaled(1.0, curves), loading)


OVER_FREQUENCY = SmoothCurve((8.0, 25.0, 140.0, 500.0), zero=REFERENCE)


class JointsOverFrequency(Effect):
    """Any smooth stiffness and any smooth loss over frequency, independent of each other; shear has a share of both."""

    id = "joint_frequency"
    title = "joints that follow frequency"
    mechanism = Mechanism.JOINT_FREQUENCY
    law_over = LawOver.FREQUENCY
    law = "smooth curve"
    law_free = True
    own_parameters = (
        *OVER_FREQUENCY.parameters("storage", 0.2),
        *OVER_FREQUENCY.parameters("loss", 0.5),
        Parameter("shear_share", "1", 1.0, 0.3),
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        share = np.array(COMPRESSION) + given["shear_share"] * np.array(SHEAR)
        storage, loss = (OVER_FREQUENCY.at(given, name, loading.frequency) for name in ("storage", "loss"))
        return cylinders.scaled(np.exp(share * storage), np.exp(share * loss))
