"""The chain of the paper: accelerances to modes to joint matrices, sine points to cylinders, and both compared."""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.beam import Beam, FreeBeam, Mesh, assemble
from analysis.comparison import ElementComparison, compare
from analysis.cylinder_terms import CylinderTerms, JointTerms, cylinder_terms, joint_terms
from analysis.direct import DynamicStiffness
from analysis.dof import Dof
from analysis.forward import accelerance, eigensolution
from analysis.frequency_response import FrequencyResponses
from analysis.identification import PAPER_DOFS, identify_joints, what_is_weak
from analysis.joint_estimate import JointEstimate
from analysis.modal import ModalEstimate, estimate_modes
from analysis.mode_agreement import ModeError, mode_errors
from analysis.modes import Modes
from analysis.superposition import Superposition, superposition
from analysis.weak_directions import WeakDirection
from api.errors import ApiError
from api.identification.measurement import Measurement, responses_of
from store.bundle_setup import Article

CONFIGURATIONS = ("compression", "shear", "angled")
LOWEST_LINE = 20.0  # Hz; below, two seconds of a hammer blow hold more drift than response


@dataclass(frozen=True, eq=False)
class Inverse:
    """What the hammer experiment gives.

    Attributes:
        measured: the reference set.
        modal: its modes.
        free_beam: the beam without joints.
        components: shape components that the joints were identified from.
        joints: identified joints by name.
        weak_directions: what these modes hardly determine; None where the joints do not give back as many modes
            as were measured, and nothing can be said.
        predicted: modes of the beam on the identified joints.
        errors: measured against predicted modes, Table 4, for those that have a pair.
    """

    measured: FrequencyResponses
    modal: ModalEstimate
    free_beam: FreeBeam
    components: tuple[Dof, ...]
    joints: Mapping[str, JointEstimate]
    weak_directions: tuple[WeakDirection, ...] | None
    predicted: Modes
    errors: tuple[ModeError, ...]

    @cached_property
    def predicted_responses(self) -> FrequencyResponses:
        """Accelerances of the beam on the identified joints at the measured lines, Eq. (46)."""
        joints = [found.joint for found in self.joints.values()]
        return accelerance(
            self.free_beam, joints, self.measured.frequency, self.measured.response, self.measured.inputs
        )


@dataclass(frozen=True, eq=False)
class Direct:
    """What the tester gives for one joint's cylinders.

    Attributes:
        series: points by configuration and commanded amplitude (mm p-p), by rising frequency.
        cylinders: a and b by commanded amplitude, where all three configurations were measured.
        joint: the joint's terms from them by commanded amplitude.
        superposition: the check of Fig. 12 by commanded amplitude.
    """

    series: Mapping[str, Mapping[float, tuple[DynamicStiffness, ...]]]
    cylinders: Mapping[float, tuple[CylinderTerms, ...]]
    joint: Mapping[float, tuple[JointTerms, ...]]
    superposition: Mapping[float, Superposition]


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
    comparison: tuple[ElementComparison, ...] = ()
    terms = {name: [term for series in found.joint.values() for term in series] for name, found in direct.items()}
    if inverse is not None and all(terms.get(name) for name in inverse.joints):
        comparison = compare(
            {name: terms[name] for name in inverse.joints},
            inverse.joints,
            mode_frequencies=inverse.modal.modes.frequency.tolist(),
        )
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
        Mesh.through(article.node_positions),
        damping_ratios=given.free_damping_ratios,
        point_masses=masses,
    )


def measured_components(responses: FrequencyResponses) -> tuple[Dof, ...]:
    """The shape components that the paper uses, as far as they were struck."""
    return tuple(point for point in PAPER_DOFS if point in responses.inputs)


def _inverse(measurement: Measurement) -> Inverse:
    article = measurement.article
    measured = responses_of(measurement.sets[0])
    modal = estimate_modes(measured, (LOWEST_LINE, float(measured.frequency[-1])))
    beam = free_beam_of(article)
    nodes = {joint.name: joint.node for joint in article.joints}
    components = measured_components(measured)
    joints = identify_joints(beam, modal.modes, nodes, components)
    highest = 1.2 * float(np.max(modal.modes.frequency))
    predicted = eigensolution(beam, [found.joint for found in joints.values()], highest)
    return Inverse(
        measured=measured,
        modal=modal,
        free_beam=beam,
        components=components,
        joints=joints,
        weak_directions=what_is_weak(beam, modal.modes, joints, components),
        predicted=predicted,
        errors=mode_errors(modal.modes, predicted),
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
    return Direct(
        series=series,
        cylinders=cylinders,
        joint={
            amplitude: tuple(joint_terms(each, inclination) for each in terms) for amplitude, terms in cylinders.items()
        },
        superposition={amplitude: superposition(*triple) for amplitude, triple in triples.items()},
    )
