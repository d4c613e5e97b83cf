"""The direct method: sine points to cylinders, joints, the superposition check and a law."""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.direct.agreement import (
    CONTRADICTION,
    WrongPoint,
    scatter_factor,
    typical_contradiction,
    with_scatter,
    wrong_points,
)
from analysis.direct.cylinder_terms import (
    CylinderTerms,
    JointLaw,
    JointTerms,
    cylinder_terms,
    fit_cylinder_law,
    joint_terms,
    match_configurations,
)
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.law_fit import FEWEST_POINTS
from analysis.direct.pair_lean import PairLean, Triple, lean_of
from analysis.direct.point_covariance import with_shared_error
from analysis.direct.standards import claims
from analysis.direct.superposition import Equivalence, Superposition, superposition
from analysis.inverse.apparent_stiffness import FEWEST_LINES, RefusedBand, identifiable_bands
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.sine_points import IdentifiedSinePoint
from store.states import CONFIGURATIONS

BELOW_ZERO = 3.0  # standard errors of h
REFUTED_SHARE = 0.1  # of the points; one wrong point refutes superposition at one of them

Series = Mapping[str, Mapping[float, tuple[DynamicStiffness, ...]]]


@dataclass(frozen=True)
class UnphysicalPart:
    """A part of a series that cannot be a specimen's stiffness.

    Attributes:
        configuration: of the specimen.
        amplitude_pp: as commanded, mm.
        band: its lines, and why.
    """

    configuration: str
    amplitude_pp: float
    band: RefusedBand


@dataclass(frozen=True, eq=False)
class Direct:
    """Results of the tester for one joint's cylinders.

    Attributes:
        series: points by configuration and commanded amplitude (mm p-p), by rising frequency.
        cylinders: a and b by commanded amplitude, where all three configurations were measured, without `left_out`.
        joint: the joint's terms from them by commanded amplitude.
        superposition: the check of Fig. 12 by commanded amplitude, of the points of which no stiffness is negative.
        inclinations: of the joint's lower and upper cylinder as drawn, rad.
        lean: of the joint's frame, as the angled pair shows it within the stated tolerance.
        claims: by configuration, which standards its points meet, one sentence each.
        unphysical: parts of series that cannot be a specimen's stiffness.
        left_out: points that are in no term, as k is not positive there or h is below zero; one phrase each.
        scatter: factor by which the points scatter more than their stated errors, 1 where that may be chance; the
            errors of all terms are larger by it.
        contradiction: typical difference of the angled points from those in compression and shear, over the smaller.
        wrong_points: points that contradict the other configurations and their own neighbours.
    """

    series: Series
    cylinders: Mapping[float, tuple[CylinderTerms, ...]]
    joint: Mapping[float, tuple[JointTerms, ...]]
    superposition: Mapping[float, Superposition]
    inclinations: tuple[float, float]
    lean: PairLean
    claims: Mapping[str, tuple[str, ...]]
    unphysical: tuple[UnphysicalPart, ...]
    left_out: tuple[str, ...]
    scatter: float
    contradiction: float
    wrong_points: tuple[WrongPoint, ...]

    @property
    def refuted(self) -> tuple[int, int]:
        """Number of points that refute superposition, and of all that test it."""
        verdicts = [point.verdict for check in self.superposition.values() for point in check.points]
        return verdicts.count(Equivalence.DIFFERENT), len(verdicts)

    @property
    def contradicted(self) -> bool:
        """Whether the three configurations contradict each other so far that no interval can be relied on."""
        refuted, tested = self.refuted
        by_size = self.scatter > 1 and self.contradiction > CONTRADICTION
        return by_size or (refuted > 1 and refuted > REFUTED_SHARE * tested)

    @property
    def compression_is_softer(self) -> bool:
        """Whether most cylinders are softer in compression than in shear, as no rubber cylinder is."""
        terms = [term for series in self.cylinders.values() for term in series]
        return sum(each.compression.stiffness < each.shear.stiffness for each in terms) > len(terms) / 2

    @property
    def insufficient(self) -> tuple[list[DynamicStiffness], int]:
        """Points that their first harmonic does not describe, and the number of all."""
        points = [point for by_amplitude in self.series.values() for own in by_amplitude.values() for point in own]
        return [point for point in points if not point.first_harmonic_sufficient], len(points)

    @cached_property
    def law(self) -> JointLaw | None:
        """The joint at any amplitude and frequency; None where there are too few points. Fitted when asked for."""
        every_term = [term for terms in self.cylinders.values() for term in terms]
        if len(every_term) < FEWEST_POINTS:
            return None
        lower, upper = self.inclinations
        return JointLaw(fit_cylinder_law(every_term), lower, self.lean, upper)


def series_of(points: Iterable[IdentifiedSinePoint]) -> dict[str, Series]:
    """By joint, its points by configuration and falling amplitude asked for (mm p-p), of rising frequency."""
    found: dict[str, dict[str, dict[float, list[DynamicStiffness]]]] = defaultdict(
        lambda: defaultdict(lambda: defaultdict(list))
    )
    for point in points:
        found[point.specimen][point.configuration][point.amplitude_pp_mm].append(point.result)
    return {
        name: {
            configuration: {
                amplitude: tuple(sorted(own, key=lambda point: point.frequency))
                for amplitude, own in sorted(by_configuration[configuration].items(), reverse=True)
            }
            for configuration in CONFIGURATIONS
            if configuration in by_configuration
        }
        for name, by_configuration in sorted(found.items())
    }


def direct_of(measurement: MeasuredArticle) -> dict[str, Direct]:
    """Results of the sine points for each joint's cylinders, by joint; empty without points.

    Raises:
        AnalysisError: points of different configurations do not belong together.
    """
    drawn = {joint.name: joint.inclinations_deg for joint in measurement.article.joints}
    inclinations = {name: (math.radians(lower), math.radians(upper)) for name, (lower, upper) in drawn.items()}
    stated = measurement.article.tolerances
    points = [_with_gain(point, stated.configuration_gain or 0.0) for point in measurement.points]
    return {
        name: _direct_of_joint(name, series, inclinations[name], math.radians(stated.inclination_deg))
        for name, series in series_of(points).items()
    }


def _with_gain(point: IdentifiedSinePoint, gain: float) -> IdentifiedSinePoint:
    """The point with a `gain` (standard deviation) of the tester in its configuration among its shared errors."""
    if gain == 0:
        return point
    error = gain * point.result.complex_stiffness
    return replace(point, result=with_shared_error(point.result, f"tester gain, {point.configuration}", error))


def _direct_of_joint(name: str, series: Series, inclinations: tuple[float, float], tolerance: float) -> Direct:
    lower, upper = inclinations
    complete = [
        amplitude
        for amplitude in series.get("angled", {})
        if all(amplitude in series.get(configuration, {}) for configuration in CONFIGURATIONS)
    ]
    triples = {
        amplitude: (series["compression"][amplitude], series["shear"][amplitude], series["angled"][amplitude])
        for amplitude in complete
    }
    stated, left_out = _of_specimens(triples)
    source = f"lean of joint {name}"
    lean = _lean(stated, tolerance, source)
    scatter = scatter_factor([term.misfit for terms in _terms(stated, lean).values() for term in terms])
    levels = {amplitude: [with_scatter(each, scatter) for each in level] for amplitude, level in stated.items()}
    lean = _lean(levels, tolerance, source)
    terms = _terms(levels, lean)
    cylinders, no_terms = _cylinders(terms)
    return Direct(
        series=series,
        cylinders=cylinders,
        joint={
            amplitude: tuple(joint_terms(each, lower, lean, upper) for each in terms)
            for amplitude, terms in cylinders.items()
        },
        superposition={amplitude: superposition(*_by_configuration(level)) for amplitude, level in stated.items()},
        inclinations=inclinations,
        lean=lean,
        claims={
            configuration: claims([point for points in by_amplitude.values() for point in points])
            for configuration, by_amplitude in series.items()
        },
        unphysical=tuple(
            UnphysicalPart(configuration, amplitude, band)
            for configuration, by_amplitude in series.items()
            for amplitude, points in by_amplitude.items()
            for band in _refused(points)
        ),
        left_out=(*left_out, *no_terms),
        scatter=scatter,
        contradiction=typical_contradiction([each for level in levels.values() for each in level], lean),
        wrong_points=tuple(
            point for amplitude, level in levels.items() for point in wrong_points(level, terms[amplitude])
        ),
    )


def _lean(levels: Mapping[float, Sequence[Triple]], tolerance: float, source: str) -> PairLean:
    return lean_of(list(levels.values()), tolerance, source) if levels else PairLean()


def _of_specimens(
    by_amplitude: Mapping[float, tuple[tuple[DynamicStiffness, ...], ...]],
) -> tuple[dict[float, list[Triple]], list[str]]:
    """By amplitude the points that belong together, and which of them are left out.

    A swapped sign in one configuration would turn the lean that all points share, and no law has a stiffness that is
    not positive, nor a loss below zero.
    """
    levels, left_out = defaultdict[float, list[Triple]](list), list[str]()
    feeding = defaultdict[tuple[float, tuple[str, ...]], list[float]](list)
    matched = {amplitude: match_configurations(*series) for amplitude, series in by_amplitude.items()}
    turned = _turned([triple for triples in matched.values() for triple in triples])
    for amplitude, triples in matched.items():
        for triple in triples:
            points = {"compression": triple.compression, "shear": triple.shear, "angled": triple.angled}
            below = tuple(name for name, point in points.items() if name in turned or _feeds_energy(point))
            if wrong := _not_positive(amplitude, points):
                left_out.append(wrong)
            elif below:
                feeding[amplitude, below].append(triple.angled.frequency)
            else:
                levels[amplitude].append(triple)
    return dict(levels), [*left_out, *(_below_zero(*where, frequencies) for where, frequencies in feeding.items())]


def _turned(triples: Sequence[Triple]) -> set[str]:
    """Configurations whose points mostly feed energy: those that noise hides have the same wrong sign."""
    return {
        name
        for name in CONFIGURATIONS
        if 2 * sum(_feeds_energy(getattr(triple, name)) for triple in triples) > len(triples)
    }


def _feeds_energy(point: DynamicStiffness) -> bool:
    """Whether h alone is below zero, by more than its error; a swapped sign of the force turns k as well."""
    return point.stiffness > 0 and point.damping < -BELOW_ZERO * point.damping_estimate.standard_error


def _below_zero(amplitude: float, names: Iterable[str], frequencies: Sequence[float]) -> str:
    where = f"{frequencies[0]:g} Hz" if len(frequencies) == 1 else f"{len(frequencies)} frequencies"
    if len(frequencies) > 1:
        where += f" from {min(frequencies):g} to {max(frequencies):g} Hz"
    return (
        f"{amplitude:g} mm, {where}: h is below zero ({', '.join(names)}), and no specimen feeds energy; check the "
        "sign of the phase: force leads displacement"
    )


def _terms(levels: Mapping[float, Sequence[Triple]], lean: PairLean) -> dict[float, tuple[CylinderTerms, ...]]:
    return {amplitude: cylinder_terms(*_by_configuration(level), lean=lean) for amplitude, level in levels.items()}


def _cylinders(
    by_amplitude: Mapping[float, Sequence[CylinderTerms]],
) -> tuple[dict[float, tuple[CylinderTerms, ...]], list[str]]:
    """a and b by amplitude, and which are left out, as points that contradict each other make them negative."""
    found, left_out = defaultdict[float, tuple[CylinderTerms, ...]](tuple), list[str]()
    for amplitude, terms in by_amplitude.items():
        for term in terms:
            wrong = _not_positive(amplitude, {"a": term.shear, "b": term.compression})
            if wrong:
                left_out.append(wrong)
            else:
                found[amplitude] += (term,)
    return dict(found), left_out


def _by_configuration(
    level: Sequence[Triple],
) -> tuple[list[DynamicStiffness], list[DynamicStiffness], list[DynamicStiffness]]:
    """The points of a level in compression, in shear and angled."""
    return [each.compression for each in level], [each.shear for each in level], [each.angled for each in level]


def _not_positive(amplitude: float, points: Mapping[str, DynamicStiffness]) -> str:
    """Where and of which points, by their names, k is not positive; empty where it is of all."""
    wrong = [f"k is {point.stiffness:.3g} N/m ({name})" for name, point in points.items() if not point.stiffness > 0]
    frequency = next(iter(points.values())).frequency
    return f"{amplitude:g} mm, {frequency:g} Hz: {' and '.join(wrong)}" if wrong else ""


def _refused(points: Sequence[DynamicStiffness]) -> tuple[RefusedBand, ...]:
    """Bands of a series that are no stiffness of a specimen; none where it is too short to be judged."""
    found = dict[RefusedBand, None]()  # in order, each once
    for each in _without_repeats(points):
        found |= dict.fromkeys(_refused_once(each))
    return tuple(found)


def _without_repeats(points: Sequence[DynamicStiffness]) -> list[list[DynamicStiffness]]:
    """Series with one point per frequency: the n-th has the n-th point at each frequency, or the last one there."""
    by_frequency = defaultdict[float, list[DynamicStiffness]](list)
    for point in points:
        by_frequency[point.frequency].append(point)
    most = max(map(len, by_frequency.values()), default=0)
    return [[own[min(turn, len(own) - 1)] for own in by_frequency.values()] for turn in range(most)]


def _refused_once(points: Sequence[DynamicStiffness]) -> tuple[RefusedBand, ...]:
    if len(points) < FEWEST_LINES:
        return ()
    error = [max(p.stiffness_estimate.standard_error, p.damping_estimate.standard_error) / p.magnitude for p in points]
    return identifiable_bands(
        np.array([point.frequency for point in points]),
        np.array([point.complex_stiffness for point in points]),
        np.array(error),
    ).refused
