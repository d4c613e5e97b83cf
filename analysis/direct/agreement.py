"""How far a joint's points in compression, shear and angled agree with each other, beside their stated errors.

Each triple has three complex numbers for two unknowns, so it has a misfit of its own (`CylinderTerms.misfit`). One
misfit says little: by chance it is above 3 in one of twenty triples. All triples together tell by which factor points
scatter more than is stated. Its square is the median misfit over that of chance, which one wrong point does not move.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.direct.cylinder_terms import FREQUENCY_TOLERANCE, CylinderTerms
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.pair_lean import PairLean, Triple
from analysis.direct.point_covariance import own_covariance, shared_covariance

MEDIAN_BY_CHANCE = math.log(2)  # of chi-square on two degrees of freedom over two
CERTAIN = 3.0  # standard errors of that median, which are 1 / (ln 2 sqrt(triples)) of it
OUTLYING = 25.0  # misfit of a triple that holds a wrong point; by chance one of 1e11
CONTRADICTION = 0.15  # typical difference over the smaller term, from which a and b depend on which points are believed


@dataclass(frozen=True)
class WrongPoint:
    """A triple whose configurations contradict each other far beyond their errors.

    Attributes:
        frequency: Hz.
        amplitude_pp: m.
        configuration: compression, shear or angled: the one whose point fits its neighbours in frequency least.
        misfit: chi-square of the triple over its degrees of freedom.
    """

    frequency: float
    amplitude_pp: float
    configuration: str
    misfit: float


def scatter_factor(misfits: Sequence[float]) -> float:
    """Factor by which points scatter more than their stated errors, 1 where that may be chance.

    Args:
        misfits: of all triples of a joint.
    """
    if not misfits:
        return 1.0
    variance = float(np.median(misfits)) / MEDIAN_BY_CHANCE
    return math.sqrt(variance) if variance > 1 + CERTAIN / MEDIAN_BY_CHANCE / math.sqrt(len(misfits)) else 1.0


def with_scatter(triple: Triple, factor: float) -> Triple:
    """The triple with `factor` times the errors that each of its points has for itself."""

    def widened(point: DynamicStiffness) -> DynamicStiffness:
        own = factor**2 * own_covariance(point)
        return replace(point, covariance=own + shared_covariance(point.shared_errors))

    return Triple(widened(triple.compression), widened(triple.shear), widened(triple.angled))


def typical_contradiction(triples: Sequence[Triple], lean: PairLean) -> float:
    """Median of |angled - (1 - e) shear / 2 - (1 + e) compression| over the smaller of shear / 2 and compression."""
    found = []
    for triple in triples:
        shear, compression = triple.shear.complex_stiffness / 2, triple.compression.complex_stiffness
        left = triple.angled.complex_stiffness - (1 - lean.excess) * shear - (1 + lean.excess) * compression
        found.append(abs(left) / min(abs(shear), abs(compression)))
    return float(np.median(found)) if found else 0.0


def wrong_points(level: Sequence[Triple], terms: Sequence[CylinderTerms]) -> list[WrongPoint]:
    """The triples of one amplitude whose misfit is beyond chance, each with the point that contradicts.

    Args:
        level: triples at one amplitude.
        terms: of each of them.
    """
    if len(level) < 3:
        return []  # no neighbours to either side
    order = sorted(range(len(level)), key=lambda number: level[number].angled.frequency)
    found = []
    for place, number in enumerate(order):
        if terms[number].misfit <= OUTLYING:
            continue
        nearest = sorted(range(len(order)), key=lambda other: (abs(other - place), other))[1:3]
        others = [level[order[other]] for other in sorted(nearest)]
        deviations = {
            name: _deviation(getattr(level[number], name), [getattr(other, name) for other in others])
            for name in ("compression", "shear", "angled")
        }
        angled = level[number].angled
        worst = max(deviations, key=lambda name: deviations[name])
        found.append(WrongPoint(angled.frequency, angled.amplitude_pp, worst, terms[number].misfit))
    return found


def _deviation(point: DynamicStiffness, others: Sequence[DynamicStiffness]) -> float:
    """Of ln k_d from the straight line over ln f through two others."""
    one, other = others
    same = math.isclose(one.frequency, other.frequency, rel_tol=FREQUENCY_TOLERANCE)  # repeats
    share = 0.5 if same else math.log(point.frequency / one.frequency) / math.log(other.frequency / one.frequency)
    logarithms = [np.log(each.complex_stiffness) for each in (point, one, other)]
    return float(abs(logarithms[0] - (1 - share) * logarithms[1] - share * logarithms[2]))
