"""What cylinders of one kind differ by: mean, scatter between specimens, and what the next one may be.

Give specimens of one kind (one compound, one size); those of different joints that were made different belong apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.direct.cylinder_terms import AMPLITUDE_TOLERANCE, FREQUENCY_TOLERANCE, CylinderTerms
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate

FEWEST_SPECIMENS = 2


@dataclass(frozen=True)
class Scatter:
    """One quantity over specimens, in its own unit.

    Attributes:
        mean: of the specimens, as an estimate of all of their kind; with what their measurements share.
        deviation: standard deviation between specimens, their measurements' own errors taken out.
        next_specimen: what another one of the kind would measure.
    """

    mean: Estimate
    deviation: float
    next_specimen: Estimate


@dataclass(frozen=True)
class SpecimenScatter:
    """Terms a and b over specimens at one frequency and amplitude.

    Attributes:
        frequency: Hz.
        amplitude_pp: mean of what was reached, m.
        specimens: their names.
        shear, compression: k of a and of b, N/m.
        shear_loss_factor, compression_loss_factor: gamma of either.
    """

    frequency: float
    amplitude_pp: float
    specimens: tuple[str, ...]
    shear: Scatter
    shear_loss_factor: Scatter
    compression: Scatter
    compression_loss_factor: Scatter


def specimen_scatter(terms: Mapping[str, Sequence[CylinderTerms]]) -> tuple[SpecimenScatter, ...]:
    """Scatter at every frequency and amplitude at which all specimens were measured, in the order of the first one's.

    Args:
        terms: of each specimen by its name.

    Raises:
        AnalysisError: there are fewer than two specimens, or nothing at which all were measured.
    """
    if len(terms) < FEWEST_SPECIMENS:
        raise AnalysisError(f"{len(terms)} specimen shows no scatter; measure {FEWEST_SPECIMENS} at least")
    first, *others = terms.values()
    found = []
    for point in first:
        same = [point, *(match for other in others if (match := _nearest(point, other)) is not None)]
        if len(same) == len(terms):
            found.append(_scatter(tuple(terms), same))
    if not found:
        raise AnalysisError(f"specimens {', '.join(terms)} have no frequency and amplitude in common")
    return tuple(found)


def _nearest(point: CylinderTerms, series: Sequence[CylinderTerms]) -> CylinderTerms | None:
    near = [
        other
        for other in series
        if abs(other.shear.frequency / point.shear.frequency - 1) < FREQUENCY_TOLERANCE
        and abs(other.shear.amplitude_pp / point.shear.amplitude_pp - 1) < AMPLITUDE_TOLERANCE
    ]
    return min(near, key=lambda other: abs(math.log(other.shear.amplitude_pp / point.shear.amplitude_pp)), default=None)


def _scatter(names: tuple[str, ...], same: Sequence[CylinderTerms]) -> SpecimenScatter:
    shear, compression = ([getattr(each, term) for each in same] for term in ("shear", "compression"))
    return SpecimenScatter(
        frequency=shear[0].frequency,
        amplitude_pp=float(np.mean([point.amplitude_pp for point in shear])),
        specimens=names,
        shear=_of_stiffness(shear),
        shear_loss_factor=_of_loss_factor(shear),
        compression=_of_stiffness(compression),
        compression_loss_factor=_of_loss_factor(compression),
    )


def _of_stiffness(points: Sequence[DynamicStiffness]) -> Scatter:
    return _over(points, [point.stiffness_estimate for point in points], [np.array([1.0, 0.0]) for _ in points])


def _of_loss_factor(points: Sequence[DynamicStiffness]) -> Scatter:
    slopes = [np.array([-point.loss_factor, 1.0]) / point.stiffness for point in points]
    return _over(points, [point.loss_factor_estimate for point in points], slopes)


def _over(points: Sequence[DynamicStiffness], estimates: Sequence[Estimate], slopes: Sequence[Real]) -> Scatter:
    """Scatter of `estimates`, whose (2,) derivatives by k and h are `slopes`."""
    values = np.array([estimate.value for estimate in estimates])
    count, freedom = values.size, values.size - 1
    sources = {source for point in points for source in point.shared_errors}
    moves = {
        source: np.array(
            [
                slope @ [point.shared_errors.get(source, 0j).real, point.shared_errors.get(source, 0j).imag]
                for point, slope in zip(points, slopes, strict=True)
            ]
        )
        for source in sources
    }
    # what is shared moves all specimens alike: it does not show in their scatter
    common = math.sqrt(sum(float(np.mean(move)) ** 2 for move in moves.values()))
    own = np.square([estimate.standard_error for estimate in estimates])
    own = own - sum((move**2 for move in moves.values()), start=np.zeros(count))
    seen = float(np.var(values, ddof=1))
    mean = float(np.mean(values))
    return Scatter(
        mean=Estimate(mean, math.hypot(math.sqrt(seen / count), common), freedom),
        deviation=math.sqrt(max(seen - float(np.mean(own)), 0.0)),
        next_specimen=Estimate(mean, math.hypot(math.sqrt(seen * (1 + 1 / count)), common), freedom),
    )
