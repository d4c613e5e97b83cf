"""A fitted elastomer law: stiffness at any amplitude and frequency, with its interval.

`constitutive` gives the form of the law, `discrepancy` the deviation of the specimen from it, and `law_fit` finds both.
A prediction is their sum. Its covariance has the errors of the parameters, of the discrepancy, and those that the
measured points share.
"""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.direct.constitutive import dynamic_stiffness
from analysis.direct.discrepancy import OperatingPoints, covariance, interleaved
from analysis.direct.dynamic_stiffness import AppliedCorrection, DynamicStiffness
from analysis.direct.point_covariance import complex_factor, shared_covariance
from analysis.errors import AnalysisError
from analysis.frequency_response import Real

LOSS_BEYOND = 0.05
"""Standard deviation of the loss angle beyond the measured frequencies, over itself, for each factor of e: relaxations
that no measured frequency shows are there, however well the law fits inside."""
EDGE = 1.01  # a point outside the measured range by less than this factor counts as inside


@dataclass(frozen=True, eq=False)
class MeasuredPoints:
    """The fitted points, as far as predictions need them; rows are [ln |k_d|, loss angle] of each point in turn.

    Attributes:
        conditions: of the points.
        inverse: (2 points, 2 points) of the covariance of points and discrepancy together.
        residual: (2 points,) measured less law.
        slopes: (2 points, 10) of the law by the logarithms of its parameters.
        shared: (2 points,) change by one standard deviation of each source of shared errors.
    """

    conditions: OperatingPoints
    inverse: Real
    residual: Real
    slopes: Real
    shared: Mapping[str, Real]


@dataclass(frozen=True, eq=False)
class ElastomerLaw:
    """A law with its parameters, fitted to one term of one cylinder or to one configuration.

    Attributes:
        logarithms: (10,) of the parameters, in the order of `LawParameter`.
        covariance: (10, 10) of them, without errors that the points share.
        reference: frequency at which the amplitude part holds, Hz.
        discrepancy: (2, 2) standard deviations of ln |k_d| and of the loss angle in rad about the law, over amplitude
            alone and over amplitude and frequency.
        chi_square: weighted sum of squares about the law by the errors of the points alone.
        degrees_of_freedom: of chi-square.
        points: that were fitted.
        corrections: of all of the points.
    """

    logarithms: Real
    covariance: Real
    reference: float
    discrepancy: Real
    chi_square: float
    degrees_of_freedom: int
    points: MeasuredPoints
    corrections: tuple[AppliedCorrection, ...] = ()

    def at(self, amplitude_pp: float, frequency: float) -> DynamicStiffness:
        """Dynamic stiffness at `amplitude_pp` m and `frequency` Hz.

        Raises:
            AnalysisError: amplitude or frequency is not positive.
        """
        for name, given in (("amplitude", amplitude_pp), ("frequency", frequency)):
            if not (math.isfinite(given) and given > 0):
                raise AnalysisError(f"the {name} to predict at is {given}; it has to be positive")
        asked = replace(self.points.conditions, amplitude=np.array([amplitude_pp / 2]), frequency=np.array([frequency]))
        law, slopes = dynamic_stiffness(self.logarithms, asked.amplitude, asked.frequency, self.reference)
        points = self.points
        prior = covariance(asked.correlation(points.conditions), self.discrepancy)
        from_points = prior @ points.inverse
        of_parameters = interleaved(slopes / law[:, None]) - from_points @ points.slopes
        # derivative of the prediction in each measured number, through the discrepancy and through the parameters
        weights = from_points + of_parameters @ self.covariance @ points.slopes.T @ points.inverse
        relative = (
            covariance(np.ones((2, 1, 1)), self.discrepancy)
            - from_points @ prior.T
            + of_parameters @ self.covariance @ of_parameters.T
        )
        value = complex(law[0]) * cmath.exp(complex(*(from_points @ points.residual)))
        relative += self._unseen(abs(cmath.phase(value)), frequency)
        turn = complex_factor(value)  # d k_d = k_d d ln k_d
        shared = {source: value * complex(*(weights @ move)) for source, move in points.shared.items()}
        return DynamicStiffness(
            frequency=frequency,
            amplitude_pp=amplitude_pp,
            complex_stiffness=value,
            covariance=turn @ relative @ turn.T + shared_covariance(shared),
            corrections=self.corrections,
            shared_errors=shared,
        )

    def _unseen(self, loss_angle: float, frequency: float) -> Real:
        """(2, 2) covariance of ln |k_d| and loss angle by what a specimen does beyond the measured frequencies.

        A loss that is wrong by an angle for a factor of e in frequency moves ln |k_d| by 2 / pi of it (H. C. Booij and
        G. P. J. M. Thoone, Rheologica Acta 21, 1982, 15-24). The angle is taken as that large from the edge on.
        """
        low, high = self.frequencies
        beyond = max(0.0, math.log(frequency / high), math.log(low / frequency))
        angle = LOSS_BEYOND * loss_angle * beyond
        return np.diag(np.square([2 / math.pi * angle * beyond, angle]))

    @property
    def amplitudes_pp(self) -> tuple[float, float]:
        """Smallest and largest measured one, m."""
        measured = 2 * self.points.conditions.amplitude
        return float(np.min(measured)), float(np.max(measured))

    @property
    def frequencies(self) -> tuple[float, float]:
        """Lowest and highest measured one, Hz."""
        measured = self.points.conditions.frequency
        return float(np.min(measured)), float(np.max(measured))

    def beyond(self, amplitude_pp: float, frequency: float) -> tuple[str, ...]:
        """How amplitude and frequency lie outside the measured range, one phrase each; empty inside."""
        found = []
        for value, (low, high), unit, scale in (
            (amplitude_pp, self.amplitudes_pp, "mm", 1e3),
            (frequency, self.frequencies, "Hz", 1.0),
        ):
            if value * EDGE < low:
                found.append(f"{scale * value:.3g} {unit} is below the measured {scale * low:.3g} {unit}")
            if value > high * EDGE:
                found.append(f"{scale * value:.3g} {unit} is above the measured {scale * high:.3g} {unit}")
        return tuple(found)
