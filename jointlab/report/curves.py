"""Figs. 7 to 9 and 12 to 14 as data; page and report each draw them in their own way."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.direct.cylinder_terms import JointTerms
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.superposition import Superposition, SuperpositionPoint
from analysis.dof import Direction, Dof
from analysis.frequency_response import FrequencyResponses, Real
from analysis.interval import Estimate
from jointlab.identification.direct import Direct
from jointlab.identification.inverse import METHODS, Inverse
from jointlab.identification.save import joint_matrix
from jointlab.report.plots import METHOD_COLOURS, TESTER_COLOURS
from store.results.joint_matrices import JointMatrix

Ends = tuple[float, float]
CurveValue = Callable[[DynamicStiffness], Estimate]
JointsByMethod = Mapping[str, Mapping[str, JointMatrix]]
"""Joints by the method's name in pictures, then by joint."""
ELEMENTS = (("k22", (1, 1)), ("k12", (0, 1)))
"""The elements of the stiffness that a hammer finds: name and place in the matrix."""


@dataclass(frozen=True, eq=False)
class PlottedCurve:
    """One curve of a sweep, each array (points,).

    Attributes:
        frequency: Hz.
        value: of the quantity, in its SI unit.
        half_width: of the 95 % interval of each value; NaN where it is not known.
    """

    frequency: Real
    value: Real
    half_width: Real


@dataclass(frozen=True, eq=False)
class Panel:
    """One panel of Figs. 13 and 14: direct curves by amplitude (mm p-p), inverse 95 % intervals by method."""

    title: str
    curves: Mapping[float, PlottedCurve]
    inverse: Mapping[str, Sequence[float] | Real]


def panel_colours(shown: Sequence[Panel]) -> tuple[dict[str, str], dict[float, str]]:
    """Colour of each method and of each amplitude (mm p-p) of Figs. 13 and 14, the same in all their panels."""
    methods = dict.fromkeys(method for panel in shown for method in panel.inverse)
    amplitudes = sorted({amplitude for panel in shown for amplitude in panel.curves})
    known = sorted(methods, key=[*METHODS.values(), *methods].index)
    return (
        dict(zip(known, METHOD_COLOURS * 9, strict=False)),
        dict(zip(amplitudes, TESTER_COLOURS * 9, strict=False)),
    )


def from_common(intervals: Mapping[str, Ends]) -> dict[str, Ends]:
    """Intervals of one quantity by several ways, in per cent of their common estimate, which is zero.

    The common estimate is the mean of their middles, each weighted by the square of its precision.
    """
    low, high = np.array([sorted(ends) for ends in intervals.values()], dtype=float).T
    half = np.maximum((high - low) / 2, np.finfo(float).eps * np.abs(high + low))
    common = np.average((low + high) / 2, weights=1 / np.maximum(half, np.finfo(float).tiny) ** 2)
    ends = 100 * (np.stack([low, high], axis=1) / common - 1)
    return {name: (float(min(each)), float(max(each))) for name, each in zip(intervals, ends, strict=True)}


def figured_points(measured: FrequencyResponses) -> tuple[tuple[str, Dof], ...]:
    """What Figs. 7 to 9 show: the driving point, the first other point across the beam, the first along it.

    As far as they were struck; on the paper's bench 3y, 1y and 1x.
    """
    response, struck = measured.response, measured.inputs
    across, along = (
        [point for point in struck if point.direction is way and point != response]
        for way in (Direction.Y, Direction.X)
    )
    driving = [point for point in struck if point == response]
    wanted = zip(("Fig. 7", "Fig. 8", "Fig. 9"), (driving, across, along), strict=True)
    return tuple((label, points[0]) for label, points in wanted if points)


def joints_by_method(inverse: Inverse) -> JointsByMethod:
    """The joints of an identification as the store has them."""
    return {
        METHODS[result.method]: {name: joint_matrix(joint) for name, joint in result.joints.items()}
        for result in inverse.results
    }


def curve(points: Sequence[DynamicStiffness], quantity: CurveValue) -> PlottedCurve:
    """One quantity of a series over frequency with the half-width of its 95 % interval."""
    estimates = [quantity(point) for point in points]
    return PlottedCurve(
        frequency=np.array([point.frequency for point in points]),
        value=np.array([estimate.value for estimate in estimates]),
        half_width=np.array([estimate.half_width() for estimate in estimates]),
    )


def curves(series: Mapping[float, Sequence[DynamicStiffness]], quantity: CurveValue) -> dict[float, PlottedCurve]:
    """One quantity of a configuration's points, a curve for each amplitude."""
    return {amplitude: curve(points, quantity) for amplitude, points in series.items()}


def superposition_curves(
    checks: Mapping[float, Superposition],
) -> tuple[dict[float, PlottedCurve], dict[float, PlottedCurve]]:
    """Fig. 12: |k| in N/m of the angled pair as computed from compression and shear, and as measured, by amplitude."""

    def of(which: Callable[[SuperpositionPoint], DynamicStiffness]) -> dict[float, PlottedCurve]:
        return {
            amplitude: curve([which(point) for point in check.points], magnitude) for amplitude, check in checks.items()
        }

    return of(lambda point: point.computed), of(lambda point: point.measured)


def stiffness_panels(joints: JointsByMethod, direct: Mapping[str, Direct]) -> list[Panel]:
    """Fig. 13: k22 and k12 of each joint at the smallest amplitude, N/m, over the intervals of observable elements."""
    return [
        Panel(
            f"joint {name}, {element}",
            {min(terms): curve([getattr(term, element) for term in terms[min(terms)]], stiffness)},
            {method: own[name].stiffness_ci95[at] for method, own in joints.items() if own[name].observable[at]},
        )
        for name, terms in _measured_both_ways(joints, direct).items()
        for element, at in ELEMENTS
    ]


def loss_factor_panels(joints: JointsByMethod, direct: Mapping[str, Direct]) -> list[Panel]:
    """Fig. 14: gamma22 of each joint at the two smallest amplitudes over the intervals that are known."""
    panels = []
    for name, terms in _measured_both_ways(joints, direct).items():
        curves = {
            amplitude: curve([term.k22 for term in terms[amplitude]], loss_factor) for amplitude in sorted(terms)[:2]
        }
        intervals = {method: own[name].loss_factor_ci95[1, 1] for method, own in joints.items()}
        known = {method: interval for method, interval in intervals.items() if not np.isnan(interval).any()}
        panels.append(Panel(f"joint {name}, gamma22", curves, known))
    return panels


def _measured_both_ways(
    joints: JointsByMethod, direct: Mapping[str, Direct]
) -> dict[str, Mapping[float, Sequence[JointTerms]]]:
    """Terms of the tester by amplitude, of the joints that both experiments know."""
    common = set.intersection(*(set(own) for own in joints.values()))
    return {name: found.joint for name, found in direct.items() if name in common and found.joint}


def magnitude(point: DynamicStiffness) -> Estimate:
    """|k|, N/m."""
    return point.magnitude_estimate


def loss_factor(point: DynamicStiffness) -> Estimate:
    """gamma."""
    return point.loss_factor_estimate


def stiffness(point: DynamicStiffness) -> Estimate:
    """k, N/m."""
    return point.stiffness_estimate
