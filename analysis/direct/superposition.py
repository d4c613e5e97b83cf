"""Whether superposition holds between the tester's configurations (Fig. 12).

Angled cylinders should have a + b = (compression) + (shear) / 2. That no difference is seen would prove nothing, so
this is an equivalence test: two one-sided tests (D. J. Schuirmann, J. of
Pharmacokinetics and Biopharmaceutics 15, 1987, 657-680) of the relative difference of |k_d| against a stated margin.
Errors that configurations share, such as those of a calibration, are in its error as far as they do not cancel.

Points have the same displacement of the actuator, as in the paper. An angled cylinder then moves by only 1/sqrt(2) of
it along each of its axes. So a specimen whose shear and compression soften independently reads too high when angled.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from analysis.direct.cylinder_terms import match_configurations
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.point_covariance import own_covariance, shared_covariance
from analysis.errors import AnalysisError
from analysis.interval import Estimate, combined_degrees_of_freedom

MARGIN = 0.05
SIGNIFICANCE = 0.05  # of each one-sided test


class Equivalence(StrEnum):
    """Outcome of two one-sided tests."""

    EQUIVALENT = "equivalent"
    DIFFERENT = "different"
    INCONCLUSIVE = "inconclusive"


@dataclass(frozen=True)
class SuperpositionPoint:
    """The angled measurement against a + b from compression and shear, at one frequency and amplitude.

    Attributes:
        measured: the angled pair.
        computed: compression + shear / 2.
        margin: relative difference of |k_d| that still counts as equal.
    """

    measured: DynamicStiffness
    computed: DynamicStiffness
    margin: float

    @property
    def difference(self) -> Estimate:
        """Relative difference of |k_d|, measured over computed less one.

        Errors that both share, such as that of a calibration, count as they move the difference, which may be not at
        all; they are known in advance.
        """
        ratio = self.measured.magnitude / self.computed.magnitude
        parts = ((self.measured, ratio), (self.computed, -ratio))
        # (2,) derivatives of the ratio by k and h of either: d |k_d| / |k_d| is the real part of d k_d / k_d
        slopes = [factor * np.array([1, 1j]) / point.complex_stiffness for point, factor in parts]
        variances = [
            max(float(slope.real @ own_covariance(point) @ slope.real), 0.0)
            for (point, _), slope in zip(parts, slopes, strict=True)
        ]
        common = sum(
            sum(
                (factor * point.shared_errors.get(source, 0j) / point.complex_stiffness).real for point, factor in parts
            )
            ** 2
            for source in {*self.measured.shared_errors, *self.computed.shared_errors}
        )
        freedom = [point.degrees_of_freedom for point, _ in parts]
        return Estimate(
            ratio - 1,
            math.sqrt(sum(variances) + common),
            combined_degrees_of_freedom([*variances, common], [*freedom, math.inf]),
        )

    @property
    def p_value(self) -> float:
        """P-value of a difference at or beyond the margin; a small value supports superposition."""
        return max(self.difference.probability_below(-self.margin), 1 - self.difference.probability_below(self.margin))

    @property
    def verdict(self) -> Equivalence:
        """Equivalent, different (the interval lies beyond the margin) or inconclusive."""
        if self.p_value < SIGNIFICANCE:
            return Equivalence.EQUIVALENT
        low, high = self.difference.interval(1 - 2 * SIGNIFICANCE)
        return Equivalence.DIFFERENT if low > self.margin or high < -self.margin else Equivalence.INCONCLUSIVE


@dataclass(frozen=True)
class Superposition:
    """The test of Fig. 12.

    Attributes:
        points: measured in all three configurations, in the order of the angled ones.
    """

    points: tuple[SuperpositionPoint, ...]

    @property
    def text(self) -> str:
        """One sentence over all points."""
        counts = {verdict: sum(point.verdict is verdict for point in self.points) for verdict in Equivalence}
        worst = max(self.points, key=lambda point: abs(point.difference.value))
        return (
            f"superposition within {100 * worst.margin:g} % shown at {counts[Equivalence.EQUIVALENT]} of "
            f"{len(self.points)} points, refuted at {counts[Equivalence.DIFFERENT]}, open at "
            f"{counts[Equivalence.INCONCLUSIVE]}; largest difference {100 * worst.difference.value:+.2f} % at "
            f"{worst.measured.frequency:.4g} Hz, {1e3 * worst.measured.amplitude_pp:.3g} mm"
        )


def superposition(
    compression: Sequence[DynamicStiffness],
    shear: Sequence[DynamicStiffness],
    angled: Sequence[DynamicStiffness],
    margin: float = MARGIN,
) -> Superposition:
    """Test at every frequency and amplitude whether angled = compression + shear / 2.

    Args:
        compression: points of one cylinder, b.
        shear: points of a pair, 2a.
        angled: points of a pair, a + b.
        margin: relative difference of |k_d| that still counts as equal; to be stated before the test.

    Raises:
        AnalysisError: the margin is not positive, or no point has a partner in both other configurations.
    """
    if not margin > 0:
        raise AnalysisError(f"the margin of an equivalence test is {margin}; it has to be positive")
    triples = match_configurations(compression, shear, angled)
    points = (SuperpositionPoint(t.angled, _side_by_side(t.compression, t.shear), margin) for t in triples)
    return Superposition(tuple(points))


def _side_by_side(compression: DynamicStiffness, shear: DynamicStiffness) -> DynamicStiffness:
    """The sum a + b of one cylinder in compression and half of a pair in shear, with the errors that these share."""
    parts = ((compression, 1.0), (shear, 0.5))
    own = [factor**2 * own_covariance(point) for point, factor in parts]
    shared = {
        source: sum(factor * point.shared_errors.get(source, 0j) for point, factor in parts)
        for source in {*compression.shared_errors, *shear.shared_errors}
    }
    return DynamicStiffness(
        frequency=compression.frequency,
        amplitude_pp=compression.amplitude_pp,
        complex_stiffness=compression.complex_stiffness + shear.complex_stiffness / 2,
        covariance=sum(own) + shared_covariance(shared),
        degrees_of_freedom=combined_degrees_of_freedom(
            [float(np.trace(each)) for each in own], [point.degrees_of_freedom for point, _ in parts]
        ),
        shared_errors=shared,
    )
