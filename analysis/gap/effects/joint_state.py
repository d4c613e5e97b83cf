"""Effects of temperature, preset and history on joints."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from scipy.stats import norm

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import BentLaw, Effect, Given, LawOver, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter
from analysis.gap.smooth_curve import SmoothCurve

SOFTENING = Parameter("softening", "1/K", 0.008, 0.5, positive=True)
"""Share by which stiffness falls per K: 0.5 to 1 % for filled natural rubber about room temperature (ISO 18437-4)."""


THERMOMETER = 1.0
"""Standard deviation, K, of a specimen's temperature about that of the thermometer beside it."""
NOTICED = 2.0
"""Difference of temperature, K, that makes joints differ by more than new set-ups and other configurations do."""
MOST_EXPECTED = 0.95
"""Largest probability that thermometers alone give; one may be read wrongly, or hang in the wrong place."""


SLOPE = SmoothCurve((15.0, 200.0), zero=60.0)
"""Softening per K over that at 60 Hz, less one. Temperature acts on rubber as a shift in frequency (M. L. Williams,
R. F. Landel, J. D. Ferry, J. Am. Chem. Soc. 77, 1955), so softening differs with frequency."""
MORE_SLOPE = SmoothCurve((8.0, 25.0, 150.0, 500.0), zero=60.0)
"""What is added to `SLOPE` where softening bends over frequency by more than two heights describe."""


class TemperatureShift(Effect):
    """The beam is warmer than the tester by delta_t, within 10 K: stiffness falls by a share per K, loss by a multiple.

    The softening of a rubber is uncertain by a factor, so delta_t is as uncertain. Softening differs with frequency.
    """

    id = "temperature_shift"
    title = "another temperature in each rig"
    mechanism = Mechanism.JOINT_STATE
    law_over = LawOver.TEMPERATURE
    law = "whatever thermometers show"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (self.difference, Parameter("loss_ratio", "1", 2.0, 1.0), SOFTENING, *SLOPE.parameters("slope", 0.2))

    @property
    def difference(self) -> Parameter:
        """The parameter of the temperature difference."""
        return Parameter("delta_t", "K", 0.0, 6.7)

    def bent(self, measurement: Measurement) -> Effect | None:
        return BentTemperatureShift()

    def slope(self, given: Given, frequency: Real) -> Real:
        """Softening at a frequency over that at 60 Hz, less one."""
        return SLOPE.at(given, "slope", frequency)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        if not loading.tester:
            return cylinders
        stiffer = given["softening"] * given["delta_t"] * (1 + self.slope(given, loading.frequency))
        return cylinders.scaled(np.exp(stiffer), np.exp(stiffer * given["loss_ratio"]))


@dataclass(frozen=True)
class ShownTemperatureShift(TemperatureShift):
    """The thermometers of the two rigs show different temperatures, and the specimens have these temperatures.

    Attributes:
        shown: temperature of the beam less that of the tester, K.
    """

    law = "as the thermometers show"
    shown: float = 0.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """No variant where a temperature is unknown, or all are equal."""
        if measurement.points is None or not measurement.sets:
            return ()
        beam = np.mean([each.temperature for each in measurement.sets])
        shown = float(beam - np.mean(measurement.points.temperature))
        return (cls(shown),) if abs(shown) > THERMOMETER else ()

    def bent(self, measurement: Measurement) -> Effect | None:
        return BentShownTemperatureShift(self.shown)

    @property
    def difference(self) -> Parameter:
        return Parameter("delta_t", "K", self.shown, THERMOMETER)

    @property
    def expected(self) -> float:
        """Probability that the specimens differ by more than `NOTICED`; every rubber softens with temperature."""
        colder, not_warmer = norm.cdf([-NOTICED, NOTICED], loc=self.shown, scale=THERMOMETER)
        return float(min(1 - (not_warmer - colder), MOST_EXPECTED))


class BentSlope(BentLaw):
    """Mixin before a law: its softening bends further over frequency."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*super().parameters, *MORE_SLOPE.parameters("more_slope", 0.2))

    def slope(self, given: Given, frequency: Real) -> Real:
        return SLOPE.at(given, "slope", frequency) + MORE_SLOPE.at(given, "more_slope", frequency)


@dataclass(frozen=True)
class BentTemperatureShift(BentSlope, TemperatureShift):
    """`TemperatureShift` with a softening that bends further."""

    law = "whatever thermometers show, bent"


@dataclass(frozen=True)
class BentShownTemperatureShift(BentSlope, ShownTemperatureShift):
    """`ShownTemperatureShift` with a softening that bends further."""

    law = "as the thermometers show, bent"


@dataclass(frozen=True)
class PreloadStiffening(Effect):
    """Cylinders are stiffer under the tester's preset than under the beam, by 0.2 to 1 per mm; loss stays.

    Attributes:
        preset_mm: mean displacement in the tester.
    """

    id = "preload_stiffening"
    title = "stiffening under the tester's preset"
    mechanism = Mechanism.JOINT_STATE
    law_over = LawOver.PRELOAD
    law = "stiffness alone"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("s", "1/mm", 0.0, 0.67),)
    preset_mm: float = 0.5

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(measurement.preset * 1e3 or 0.5),)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        more = given["s"] * self.preset_mm
        return cylinders.scaled(1 + more, 1 + self.loss_share(given) * more) if loading.tester else cylinders

    def loss_share(self, given: Given) -> float:
        """Growth of loss over growth of stiffness."""
        return 0.0


class PreloadWithLoss(PreloadStiffening):
    """`PreloadStiffening` in which loss grows as much as stiffness."""

    law = "stiffness and loss alike"

    def loss_share(self, given: Given) -> float:
        return 1.0


class PreloadWithSomeLoss(PreloadStiffening):
    """`PreloadStiffening` in which loss grows by a share of the growth of stiffness."""

    law = "loss by a share"
    own_parameters = (*PreloadStiffening.own_parameters, Parameter("loss_share", "1", 0.5, 0.25))

    def loss_share(self, given: Given) -> float:
        return given["loss_share"]


class ConditioningDrift(Effect):
    """Specimens soften while they are cycled (slow part of Mullins' effect), up to 10 %.

    Stiffness and loss fall in proportion to the share of the test that is done; the fall in shear is a share of that
    in compression. The beam may have been struck before the test or after it.
    """

    id = "conditioning_drift"
    title = "drift in the order of measuring"
    mechanism = Mechanism.JOINT_STATE
    law_over = LawOver.ORDER
    law = "straight"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("d", "1", 0.0, 0.067),
        Parameter("under_beam", "1", 0.5, 0.5),
        Parameter("shear_share", "1", 1.0, 0.2),
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        if not loading.tester:  # unchanged: the drift counts from the state under the beam
            return cylinders
        fall = given["d"] * np.array([given["shear_share"], 1.0, 1.0])[:, None, None]
        factor = (1 - fall * self._done(given, loading.fraction)) / (1 - fall * given["under_beam"])
        return cylinders.scaled(factor, factor)

    def _done(self, _given: Given, fraction: Real) -> Real:
        return fraction


class SaturatingDrift(ConditioningDrift):
    """The drift saturates: most of it is over after a share `knee` of the test."""

    law = "saturating"
    own_parameters = (*ConditioningDrift.own_parameters, Parameter("knee", "1", 0.3, 0.8, positive=True))

    def _done(self, given: Given, fraction: Real) -> Real:
        rate = 1 / given["knee"]
        return np.asarray((1 - np.exp(-rate * fraction)) / (1 - np.exp(-rate)))


class LogarithmicDrift(ConditioningDrift):
    """The drift follows the logarithm of the number of cycles."""

    law = "logarithmic"

    def _done(self, _given: Given, fraction: Real) -> Real:
        return np.asarray(np.log1p(100 * fraction) / np.log(101))


DRIFT_KNOTS = (0.0, 0.04, 0.12, 0.25, 0.4, 0.6, 0.8, 1.0)
"""Shares of the test between which the logarithm of the rate of a drift is straight."""
DRIFT_STEPS = np.linspace(0.0, 1.0, 201)
"""Shares of the test between which the rate is integrated."""


class DriftAlongCurve(ConditioningDrift):
    """The rate of the drift is any positive function of the share of the test that is done.

    Its logarithm is a random walk from each share of `DRIFT_KNOTS` to the next.
    """

    law = "any rising curve"
    own_parameters = (
        *ConditioningDrift.own_parameters,
        *(Parameter(f"faster_to_{share:g}", "1", 0.0, 1.0, height=True) for share in DRIFT_KNOTS[1:]),
    )

    def _done(self, given: Given, fraction: Real) -> Real:
        logarithm = np.cumsum([0.0, *(given[f"faster_to_{share:g}"] for share in DRIFT_KNOTS[1:])])
        rate = np.exp(np.interp(DRIFT_STEPS, DRIFT_KNOTS, logarithm))
        done = np.concatenate([[0.0], np.cumsum(rate[1:] + rate[:-1])])
        return np.asarray(np.interp(fraction, DRIFT_STEPS, done / done[-1]))


OVER_TEST = SmoothCurve((0.3, 1.0), zero=0.03)
WAYS = ("shear", "compression", "angled")
"""Ways of loading in the tester; each of them may differ from the loading under the beam in its own way."""


def _by_way(given: Given, part: str, loading: Loading, shear_when_angled: float = 1.0) -> Real:
    """(3, 1, n) differences of shear, compression and rotation at each point of the tester.

    `shear_when_angled` is that of shear over that of compression in the angled configuration.
    """
    shear, compression, angled = (given[f"{part}_{way}"] for way in WAYS)
    straight = np.array([shear, compression, compression])[:, None, None]
    return np.where(loading.angled, angled * np.array([shear_when_angled, 1.0, 1.0])[:, None, None], straight)


@dataclass(frozen=True)
class PreloadOfEachConfiguration(PreloadStiffening):
    """The preset loads cylinders differently in each configuration: s is for compression, others have a share of it.

    At 45 degrees it may stiffen shear less or more than compression.
    """

    law = "each configuration by its share"
    own_parameters = (
        *PreloadStiffening.own_parameters,
        *(Parameter(name, "1", 0.7, 0.5) for name in ("share_shear", "share_angled", "shear_when_angled")),
        Parameter("loss_share", "1", 0.5, 0.35),
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        if not loading.tester:
            return cylinders
        shares = _by_way({"share_compression": 1.0, **given}, "share", loading, given["shear_when_angled"])
        more = given["s"] * self.preset_mm * shares
        return cylinders.scaled(1 + more, 1 + given["loss_share"] * more)


class JointsOfEachState(Effect):
    """Cylinders in the tester have a factor for each way of loading, and drift smoothly in the order of measuring."""

    id = "joint_state"
    title = "joints that differ from one state to another"
    mechanism = Mechanism.JOINT_STATE
    law_over = LawOver.ORDER
    law = "smooth curve"
    law_free = True
    own_parameters = (
        *(Parameter(f"{part}_{way}", "1", 0.0, 0.15) for part in ("storage", "loss") for way in WAYS),
        *OVER_TEST.parameters("drift", 0.05),
    )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        if not loading.tester:
            return cylinders
        drift = OVER_TEST.at(given, "drift", np.maximum(loading.fraction, 1e-3))
        storage, loss = (np.exp(_by_way(given, part, loading) + drift) for part in ("storage", "loss"))
        return cylinders.scaled(storage, loss)
