"""The chain of the paper: accelerances to modes to joint matrices, sine points to cylinders, and both compared."""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from analysis.blow_amplitude import BlowForce, joint_amplitudes_pp
from analysis.comparison import Bounds, ElementComparison, compare
from analysis.direct.cylinder_terms import CylinderTerms, JointTerms, cylinder_terms, joint_terms
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.joint_law import JointLaw, fit_cylinder_law
from analysis.direct.law_fit import FEWEST_POINTS
from analysis.direct.superposition import Superposition, superposition
from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses
from analysis.interval import Estimate
from analysis.inverse.identification import PAPER_DOFS, identify_joints, what_is_weak
from analysis.inverse.joint_estimate import IdentifiedJoint, JointEstimate
from analysis.inverse.joint_fit import JointFit, LikelihoodEstimate
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.tolerances import Tolerances
from analysis.inverse.weak_directions import WeakDirection
from analysis.modal.estimation import ModalEstimate, estimate_modes
from analysis.modes import Modes
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.forward import accelerance, eigensolution
from analysis.structure.mode_agreement import ModeError, mode_errors
from api.errors import ApiError
from api.identification.measurement import Measurement
from store.bundle_setup import Article

CONFIGURATIONS = ("compression", "shear", "angled")
PAPER = "modal (Eqs. 17-44)"
LIKELIHOOD = "maximum likelihood on accelerances"
BLOW_WIDTH = 4e-4  # s at half of the peak, of a hammer tip that reaches 1 kHz; its logarithm is what counts
ELEMENTS_BETWEEN_NODES = 8  # four leave k12 by maximum likelihood 0.2 % low
HIGHEST_PREDICTED = 1.2  # times the highest measured mode
LOWEST_LINE = 20.0  # Hz; below, two seconds of a hammer blow hold more drift than response

JointT = TypeVar("JointT", bound=IdentifiedJoint)


@dataclass(frozen=True, eq=False)
class Route(Generic[JointT]):
    """Joints by one inverse method, and what the beam does on them.

    Attributes:
        method: its name.
        joints: identified joints by name.
        weak_directions: what the data hardly determine; None where nothing can be said, because the joints do not
            give back as many modes as were measured.
        predicted: modes of the beam on these joints.
        errors: measured against predicted modes, for those that have a pair.
        responses: accelerances of the beam on these joints at the measured lines, Eq. (46).
    """

    method: str
    joints: Mapping[str, JointT]
    weak_directions: tuple[WeakDirection, ...] | None
    predicted: Modes
    errors: tuple[ModeError, ...]
    responses: FrequencyResponses


@dataclass(frozen=True, eq=False)
class Inverse:
    """What the hammer experiment gives.

    Attributes:
        measured: the reference set.
        modal: its modes.
        free_beam: the beam without joints.
        components: shape components that the paper's method works on.
        paper: joints by the paper's method, from the modes.
        likelihood: joints by maximum likelihood on the accelerances, started from the paper's.
        fit: all that the maximum-likelihood fit says, its gates among it.
    """

    measured: FrequencyResponses
    modal: ModalEstimate
    free_beam: FreeBeam
    components: tuple[Dof, ...]
    paper: Route[JointEstimate]
    likelihood: Route[LikelihoodEstimate]
    fit: JointFit


@dataclass(frozen=True, eq=False)
class Direct:
    """What the tester gives for one joint's cylinders.

    Attributes:
        series: points by configuration and commanded amplitude (mm p-p), by rising frequency.
        cylinders: a and b by commanded amplitude, where all three configurations were measured.
        joint: the joint's terms from them by commanded amplitude.
        superposition: the check of Fig. 12 by commanded amplitude.
        law: the joint at any amplitude and frequency, where there are points enough.
    """

    series: Mapping[str, Mapping[float, tuple[DynamicStiffness, ...]]]
    cylinders: Mapping[float, tuple[CylinderTerms, ...]]
    joint: Mapping[float, tuple[JointTerms, ...]]
    superposition: Mapping[float, Superposition]
    law: JointLaw | None


@dataclass(frozen=True, eq=False)
class Identification:
    """Joints by both methods, from one measurement; what was not measured is None or empty.

    Attributes:
        measurement: what it was made from.
        inverse: from the hammer, or None.
        direct: from the tester, by joint.
        comparison: element by element, where both are there.
        seconds: how long it took.
    """

    measurement: Measurement
    inverse: Inverse | None
    direct: Mapping[str, Direct]
    comparison: tuple[ElementComparison, ...]
    seconds: float


def identify(measurement: Measurement) -> Identification:
    """Identify both ways and compare.

    Raises:
        AnalysisError: a method cannot work with these data; the message says what is missing.
        ApiError: the measurement holds neither experiment.
    """
    started = time.perf_counter()
    if not measurement.sets and not measurement.points:
        raise ApiError(f"{measurement.title}: neither accelerances nor sine points to identify from")
    inverse = _inverse(measurement) if measurement.sets else None
    direct = _direct(measurement)
    comparison = _comparison(measurement, inverse, direct) if inverse is not None else ()
    return Identification(measurement, inverse, direct, comparison, time.perf_counter() - started)


def free_beam_of(article: Article) -> FreeBeam:
    """The article's beam without joints, on a mesh finer than its nodes, with what its joints and sensor weigh."""
    given = article.beam
    beam = Beam(
        length=given.length,
        height=given.height,
        width=given.width,
        youngs_modulus=given.youngs_modulus,
        poisson_ratio=given.poisson_ratio,
        density=given.density,
    )
    masses: dict[int, float] = defaultdict(float)
    for joint in article.joints:
        masses[joint.node] += joint.added_mass
    masses[article.accelerometer.node] += article.accelerometer.mass
    return assemble(
        beam,
        Mesh.through(article.node_positions, ELEMENTS_BETWEEN_NODES),
        damping_ratios=given.free_damping_ratios,
        point_masses=masses,
    )


def measured_components(responses: FrequencyResponses) -> tuple[Dof, ...]:
    """The shape components that the paper uses, as far as they were struck."""
    return tuple(point for point in PAPER_DOFS if point in responses.inputs)


def _comparison(
    measurement: Measurement, inverse: Inverse, direct: Mapping[str, Direct]
) -> tuple[ElementComparison, ...]:
    """Element by element, at the modes' frequencies and at the amplitudes that the blows really caused."""
    joints, predicted = inverse.likelihood.joints, inverse.likelihood.predicted
    known: dict[str, Sequence[JointTerms] | JointLaw] = {
        name: direct[name].law or [term for series in direct[name].joint.values() for term in series]
        for name in joints
        if name in direct and direct[name].joint
    }
    if set(known) != set(joints):
        return ()
    return compare(
        known,
        joints,
        mode_frequencies=predicted.frequency.tolist(),
        amplitude_pp=_blow_amplitudes(measurement, inverse) or 1e-3 * min(min(direct[name].joint) for name in joints),
        sums={"k11": _sum_of_k11(inverse.fit)},
        relative_uncertainty=measurement.article.tolerances.tester_gain,
    )


def _blow_amplitudes(measurement: Measurement, inverse: Inverse) -> dict[str, list[float]] | None:
    """Peak-to-peak amplitude in m at which each predicted mode sees each joint, by joint.

    None where a predicted mode does not decay: joints that feed energy fail their gate, and then no ring-down has an
    amplitude; the smallest that the tester measured is the best there is.
    """
    predicted = inverse.likelihood.predicted
    if np.any(predicted.poles.real >= 0):
        return None
    peak_force = measurement.sets[0].peak_force
    blows = [BlowForce.from_peak(point, peak_force, BLOW_WIDTH, predicted) for point in inverse.measured.inputs]
    nodes = {name: joint.node for name, joint in inverse.likelihood.joints.items()}
    return {name: each.tolist() for name, each in joint_amplitudes_pp(predicted, nodes, blows).items()}


def _sum_of_k11(fit: JointFit) -> Bounds:
    total, deviation, _ = fit.sum_of(0, 0)
    return Bounds.of(Estimate(total.real, deviation))


def tolerances_of(article: Article) -> Tolerances:
    """What the laboratory admits not to know of the beam test, as analysis has it."""
    stated = article.tolerances
    return Tolerances(
        sensor_gain=stated.sensor_gain,
        youngs_modulus=stated.youngs_modulus,
        density=stated.density,
        sensor_position=stated.node_position,
        joint_position=stated.node_position,
        blow_position=stated.impact_position,
        inclination=math.radians(stated.inclination_deg),
    )


def _inverse(measurement: Measurement) -> Inverse:
    article = measurement.article
    measured = measurement.responses()
    modal = estimate_modes(measured, (LOWEST_LINE, float(measured.frequency[-1])))
    beam = free_beam_of(article)
    nodes = {joint.name: joint.node for joint in article.joints}
    components = measured_components(measured)
    by_modes = identify_joints(beam, modal.modes, nodes, components)
    start = [found.joint for found in by_modes.values()]
    fit = identify_from_responses(beam, measured, start, tolerances=tolerances_of(article))
    weak = what_is_weak(beam, modal.modes, by_modes, components)
    return Inverse(
        measured=measured,
        modal=modal,
        free_beam=beam,
        components=components,
        paper=_route(PAPER, by_modes, weak, beam, measured, modal.modes),
        likelihood=_route(LIKELIHOOD, fit.joints, fit.weak_directions, beam, measured, modal.modes),
        fit=fit,
    )


def _route(
    method: str,
    joints: Mapping[str, JointT],
    weak_directions: tuple[WeakDirection, ...] | None,
    beam: FreeBeam,
    measured: FrequencyResponses,
    modes: Modes,
) -> Route[JointT]:
    held_by = [found.joint for found in joints.values()]
    predicted = eigensolution(beam, held_by, HIGHEST_PREDICTED * float(np.max(modes.frequency)))
    return Route(
        method=method,
        joints=joints,
        weak_directions=weak_directions,
        predicted=predicted,
        errors=mode_errors(modes, predicted),
        responses=accelerance(beam, held_by, measured.frequency, measured.response, measured.inputs),
    )


def _direct(measurement: Measurement) -> dict[str, Direct]:
    sorted_points: dict[str, dict[str, dict[float, list[DynamicStiffness]]]] = defaultdict(
        lambda: defaultdict(lambda: defaultdict(list))
    )
    for point in measurement.points:
        sorted_points[point.specimen][point.configuration][point.amplitude_pp_mm].append(point.result)
    inclination = {joint.name: math.radians(joint.inclinations_deg[0]) for joint in measurement.article.joints}
    return {name: _direct_of_joint(found, inclination[name]) for name, found in sorted(sorted_points.items())}


def _direct_of_joint(found: Mapping[str, Mapping[float, list[DynamicStiffness]]], inclination: float) -> Direct:
    series = {
        configuration: {
            amplitude: tuple(sorted(points, key=lambda point: point.frequency))
            for amplitude, points in sorted(found[configuration].items(), reverse=True)
        }
        for configuration in CONFIGURATIONS
        if configuration in found
    }
    complete = [
        amplitude
        for amplitude in series.get("angled", {})
        if all(amplitude in series.get(configuration, {}) for configuration in CONFIGURATIONS)
    ]
    triples = {
        amplitude: (series["compression"][amplitude], series["shear"][amplitude], series["angled"][amplitude])
        for amplitude in complete
    }
    cylinders = {amplitude: cylinder_terms(*triple) for amplitude, triple in triples.items()}
    every_term = [term for terms in cylinders.values() for term in terms]
    law = JointLaw(fit_cylinder_law(every_term), inclination) if len(every_term) >= FEWEST_POINTS else None
    return Direct(
        series=series,
        cylinders=cylinders,
        joint={
            amplitude: tuple(joint_terms(each, inclination) for each in terms) for amplitude, terms in cylinders.items()
        },
        superposition={amplitude: superposition(*triple) for amplitude, triple in triples.items()},
        law=law,
    )
