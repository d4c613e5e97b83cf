"""Scatter between cylinders of one kind: mean, standard deviation, and the range of the next specimen.

All specimens have to be of one kind (one compound, one size).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.direct.cylinder_terms import CylinderLaw, CylinderTerms, nearest_point
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.point_covariance import own_covariance
from analysis.errors import AnalysisError
from analysis.interval import Estimate, combined_degrees_of_freedom

FEWEST_SPECIMENS = 2


@dataclass(frozen=True)
class Scatter:
    """One quantity over specimens, in its own unit.

    Attributes:
        mean: of the specimens, as an estimate for their kind, with the errors that their measurements share.
        deviation: standard deviation between specimens, without the errors of their measurements.
        next_specimen: prediction for another specimen of the kind.
    """

    mean: Estimate
    deviation: float
    next_specimen: Estimate


@dataclass(frozen=True)
class SpecimenScatter:
    """Terms a and b over specimens at one frequency and amplitude.

    Attributes:
        frequency: Hz.
        amplitude_pp: mean of the reached amplitudes, m.
        specimens: their names.
        shear, compression: k of a and of b, N/m.
        shear_damping, compression_damping: h of either, N/m.
        shear_loss_factor, compression_loss_factor: gamma of either.
    """

    frequency: float
    amplitude_pp: float
    specimens: tuple[str, ...]
    shear: Scatter
    shear_damping: Scatter
    shear_loss_factor: Scatter
    compression: Scatter
    compression_damping: Scatter
    compression_loss_factor: Scatter


def specimen_scatter(terms: Mapping[str, Sequence[CylinderTerms]]) -> tuple[SpecimenScatter, ...]:
    """Scatter at every frequency and amplitude at which all specimens were measured, in the order of the first one's.

    Args:
        terms: of each specimen by its name.

    Raises:
        AnalysisError: there are fewer than two specimens, or they have no frequency and amplitude in common.
    """
    if len(terms) < FEWEST_SPECIMENS:
        raise AnalysisError(f"{len(terms)} specimen shows no scatter; measure {FEWEST_SPECIMENS} at least")
    first, *others = terms.values()
    found = []
    for point in first:
        same = [point, *(match for other in others if (match := _at_same_point(point, other)) is not None)]
        if len(same) == len(terms):
            found.append(_scatter(tuple(terms), same))
    if not found:
        raise AnalysisError(f"specimens {', '.join(terms)} have no frequency and amplitude in common")
    return tuple(found)


def scatter_of_laws(laws: Mapping[str, CylinderLaw], amplitude_pp: float, frequency: float) -> SpecimenScatter:
    """Scatter at any `amplitude_pp`, m, and `frequency`, Hz, measured or not.

    Laws of specimens have one form and the same priors. Between and outside the points their errors are alike and do
    not show in the scatter, so the whole error of a law counts as shared. `deviation` then includes it.

    Args:
        laws: of each specimen by its name.
        amplitude_pp: peak to peak, m.
        frequency: Hz.

    Raises:
        AnalysisError: there are fewer than two specimens, or amplitude or frequency is not positive.
    """
    terms = {name: law.at(amplitude_pp, frequency) for name, law in laws.items()}
    alike = {
        name: [
            replace(
                each, shear=_with_own_error_shared(each.shear), compression=_with_own_error_shared(each.compression)
            )
        ]
        for name, each in terms.items()
    }
    (found,) = specimen_scatter(alike)
    return found


def _with_own_error_shared(point: DynamicStiffness) -> DynamicStiffness:
    """The point with its own error as one that it shares with other points."""
    values, ways = np.linalg.eigh(own_covariance(point))
    moves = (ways * np.sqrt(np.maximum(values, 0.0))).T  # one of no size may be negative by rounding
    own = {f"law {number}": complex(*move) for number, move in enumerate(moves, start=1)}
    return replace(point, shared_errors={**point.shared_errors, **own})


def _at_same_point(point: CylinderTerms, series: Sequence[CylinderTerms]) -> CylinderTerms | None:
    nearest = nearest_point(point.shear, [other.shear for other in series])
    return next((other for other in series if other.shear is nearest), None)


QUANTITIES: Mapping[str, Callable[[DynamicStiffness], tuple[Estimate, Sequence[float]]]] = {
    "": lambda point: (point.stiffness_estimate, (1.0, 0.0)),
    "_damping": lambda point: (point.damping_estimate, (0.0, 1.0)),
    "_loss_factor": lambda point: (
        point.loss_factor_estimate,
        (-point.loss_factor / point.stiffness, 1 / point.stiffness),
    ),
}
"""Estimates by the end of their name in `SpecimenScatter`, and their derivatives by k and h."""


def _scatter(names: tuple[str, ...], same: Sequence[CylinderTerms]) -> SpecimenScatter:
    points = {"shear": [each.shear for each in same], "compression": [each.compression for each in same]}
    return SpecimenScatter(
        frequency=same[0].shear.frequency,
        amplitude_pp=float(np.mean([point.amplitude_pp for point in points["shear"]])),
        specimens=names,
        **{
            f"{term}{ending}": _over(points[term], [quantity(point) for point in points[term]])
            for term in points
            for ending, quantity in QUANTITIES.items()
        },
    )


def _over(points: Sequence[DynamicStiffness], found: Sequence[tuple[Estimate, Sequence[float]]]) -> Scatter:
    """Scatter of estimates, given with their (2,) derivatives by k and h."""
    estimates, slopes = zip(*found, strict=True)
    values = np.array([estimate.value for estimate in estimates])
    count, freedom = values.size, values.size - 1
    sources = {source for point in points for source in point.shared_errors}
    moves = {
        source: np.array(
            [
                by_k * point.shared_errors.get(source, 0j).real + by_h * point.shared_errors.get(source, 0j).imag
                for point, (by_k, by_h) in zip(points, slopes, strict=True)
            ]
        )
        for source in sources
    }
    # shared errors move all specimens alike and do not show in their scatter
    common = math.sqrt(sum(float(np.mean(move)) ** 2 for move in moves.values()))
    own = np.square([estimate.standard_error for estimate in estimates])
    own = own - sum((move**2 for move in moves.values()), start=np.zeros(count))
    own = np.maximum(own, 0.0)  # where the whole error is shared, except for rounding
    seen = float(np.var(values, ddof=1))
    mean = float(np.mean(values))

    def estimate(of_specimens: float) -> Estimate:
        error = math.sqrt(of_specimens + common**2)
        return Estimate(mean, error, combined_degrees_of_freedom((of_specimens, common**2), (freedom, math.inf)))

    return Scatter(
        mean=estimate(seen / count),
        deviation=math.sqrt(max(seen - float(np.mean(own)), 0.0)),
        next_specimen=estimate(seen * (1 + 1 / count)),
    )
