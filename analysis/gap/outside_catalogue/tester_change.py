"""Changes of the tester's reading that no effect of the catalogue makes: from one point of the test on, or one force or
amplitude on, or at one setting, it reads otherwise, as after a switch of ranges, a slip or a new setting.

They are rivals of the catalogue, as changes at one place of the beam are.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from scipy.special import expit

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Measurement, TesterPoints
from analysis.gap.outside_catalogue.local_change import LOCAL_CHANGE, PLACES
from analysis.gap.parameter import Parameter

SHARP = 40.0
"""Range of a condition over the width of a step in it; a fit could not find a step of no width."""
LEAST_REACH = 0.05
"""Range below which all points have the same condition."""
GAIN, PHASE = 0.05, 0.03
"""Standard deviations of a step: relative, and in rad."""


@dataclass(frozen=True)
class TesterStep(Effect):
    """A step of gain and phase where one condition of a point of the tester passes a value.

    Attributes:
        at: value of the condition from which the search begins.
        reach: range of the condition in the test; of its natural logarithm where `by_ratio`.
    """

    id = LOCAL_CHANGE
    title = "a step of the tester's reading"
    mechanism = Mechanism.TESTER
    unit: ClassVar[str]
    by_ratio: ClassVar[bool] = True
    """Whether values are compared by their ratio."""
    at: float = 1.0
    reach: float = 1.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """One variant for each value; none where all points have the same."""
        if measurement.points is None:
            return ()
        seen = np.unique(cls._scaled(cls.condition(measurement.points)))
        between, reach = (seen[1:] + seen[:-1]) / 2, float(seen[-1] - seen[0])
        if reach < LEAST_REACH:
            return ()
        if between.size > PLACES:
            between = np.quantile(between, (np.arange(PLACES) + 0.5) / PLACES)
        return tuple(cls(float(np.exp(each) if cls.by_ratio else each), reach) for each in between)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("gain", "1", 0.0, GAIN),
            Parameter("phase", "rad", 0.0, PHASE),
            Parameter("from", self.unit, self.at, self.reach / PLACES / 2, positive=self.by_ratio),
        )

    @staticmethod
    def condition(points: TesterPoints) -> Real:
        """(points,) what the reading depends on."""
        raise NotImplementedError

    @classmethod
    def _scaled(cls, condition: Real) -> Real:
        return np.asarray(np.log(condition) if cls.by_ratio else condition)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        beyond = self._scaled(self.condition(points)) - self._scaled(np.asarray(given["from"]))
        return np.asarray(stiffness * (1 + expit(SHARP * beyond / self.reach) * (given["gain"] + 1j * given["phase"])))


class StepInTime(TesterStep):
    """A step in time: something was changed, or slipped, during the test."""

    law = "a step during the test"
    unit = "1"
    by_ratio = False

    @staticmethod
    def condition(points: TesterPoints) -> Real:
        return points.fraction


class StepWithAmplitude(TesterStep):
    """A step with amplitude: the displacement is read in ranges."""

    law = "a step with the displacement"
    unit = "m"

    @staticmethod
    def condition(points: TesterPoints) -> Real:
        return points.amplitude


class StepWithForce(TesterStep):
    """A step with force: the force is read in ranges."""

    law = "a step with the force"
    unit = "N"

    @staticmethod
    def condition(points: TesterPoints) -> Real:
        return np.asarray(points.amplitude * np.abs(points.stiffness))


@dataclass(frozen=True)
class ReadingAtOneSetting(Effect):
    """Gain and phase of one configuration at one amplitude, with every specimen: a range that was chosen for it alone.

    Attributes:
        configuration: of `Configuration`.
        amplitude: zero to peak, m.
    """

    id = LOCAL_CHANGE
    title = "another reading of the tester at one setting"
    mechanism = Mechanism.TESTER
    law = "one configuration at one amplitude reads otherwise"
    own_parameters = (Parameter("gain", "1", 0.0, GAIN), Parameter("phase", "rad", 0.0, PHASE))
    configuration: int = 0
    amplitude: float = 0.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """One variant for each setting; none where a configuration had one amplitude, as its gain is a tolerance."""
        points = measurement.points
        if points is None:
            return ()
        settings = sorted(set(zip(points.configuration.tolist(), points.amplitude.tolist(), strict=True)))
        several = Counter(configuration for configuration, _ in settings)
        return tuple(cls(*each) for each in settings if several[each[0]] > 1)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        here = (points.configuration == self.configuration) & (points.amplitude == self.amplitude)
        return np.asarray(stiffness * (1 + here * (given["gain"] + 1j * given["phase"])))


KINDS: Sequence[type[TesterStep]] = (StepInTime, StepWithAmplitude, StepWithForce)


def changes_of_tester(measurement: Measurement) -> tuple[Effect, ...]:
    """Every kind from every value, and every setting; none where no tester was used."""
    steps = tuple(each for kind in KINDS for each in kind.variants(measurement))
    return steps + ReadingAtOneSetting.variants(measurement)
