"""The inverse method: accelerances to modes, to joints by both methods, and to the prediction of the beam on them.

Maximum likelihood takes any layout. It starts from the paper's method where the points for that were struck, else from
the tester's stiffnesses where both experiments were made, else from a coarse search over the bench as drawn.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses, Real
from analysis.inverse.coarse_search import coarse_joints, drawn_as_cylinders
from analysis.inverse.cylinder_parameters import CylinderPair, CylinderParameters
from analysis.inverse.experiment_remedies import Remedy, experiment_of_fit, remedies
from analysis.inverse.frequency_dependent_joints import accelerance_on, modes_on
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.identification import components_of, identify_joints, weakest_directions
from analysis.inverse.joint_estimate import IdentifiedJoint, JointEstimate, square
from analysis.inverse.joint_fit import JointFit, LikelihoodEstimate
from analysis.inverse.joint_likelihood import BAND, identify_from_responses, with_small_rotation_terms
from analysis.inverse.joint_parameters import HALF, HeldTerms, held_terms, matrices
from analysis.inverse.tolerances import FREEHAND_LEAN, Deviations, Tolerances
from analysis.inverse.undetermined_terms import WeakDirections
from analysis.inverse.validity_checks import coupling_as_drawn
from analysis.modal.estimation import ModalEstimate, estimate_modes
from analysis.modal.lscf import lscf_poles
from analysis.modal.stabilisation import Stabilisation, read_chart
from analysis.modes import Modes
from analysis.structure.agreement import ModeError, frac, mode_errors
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders
from analysis.suspended.beam_update import Material
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import AS_MEASURED, Options
from jointlab.identification.structure import free_beam_of
from jointlab.identification.suspended import SuspendedBeam
from store.exchange.bundle_setup import Article

PAPER = "modal (Eqs. 17-44)"
LIKELIHOOD = "maximum likelihood on accelerances"
METHODS = {LIKELIHOOD: "maximum likelihood", PAPER: "paper's method"}
"""The inverse methods by the names that pictures have for them."""
HIGHEST_PREDICTED = 1.2  # times the highest measured mode
HIGHEST_ORDER = 60  # of the stabilisation chart
LOWEST_LINE = 20.0  # Hz; below, two seconds of a hammer blow hold more drift than response

JointT = TypeVar("JointT", bound=IdentifiedJoint)


@dataclass(frozen=True, eq=False)
class MethodResult(Generic[JointT]):
    """Joints by one inverse method, and the prediction of the beam on them.

    Attributes:
        joints: identified joints by name.
        weak_directions: combinations of terms that the data hardly determine; None where the joints do not give back
            as many modes as were measured.
        predicted: modes of the beam on these joints; by maximum likelihood of the fitted beam, otherwise of the drawn.
        errors: measured against predicted modes, for those that have a pair.
        responses: accelerances of the same bench at the measured lines and through their window, Eq. (46); by maximum
            likelihood with blows, sensor and joints at their most likely places, and the most likely gain.
    """

    method: str
    joints: Mapping[str, JointT]
    weak_directions: WeakDirections | None
    predicted: Modes
    errors: tuple[ModeError, ...]
    responses: FrequencyResponses


@dataclass(frozen=True, eq=False)
class Inverse:
    """Results of the hammer experiment.

    Attributes:
        measured: the reference set.
        modal: its modes.
        free_beam: the beam without joints.
        tolerances: of the bench, in which the fits look for it, with the law of the joints that was found.
        components: shape components that the paper's method works on, or would.
        paper: joints by the paper's method, from the modes; None where it is left out.
        paper_left_out: why it is, a sentence; empty where it is not.
        likelihood: joints by maximum likelihood on the accelerances.
        fit: all that the maximum-likelihood fit says, its checks among it.
        regularised: share of its size within which every term was held in that fit; None where it was free.
        cylinders: the same fit over the cylinders that the joints are built of, Eqs. (8)-(11), started from `fit`;
            None where that fails a check.
        remedies: of the weakest direction of this experiment, the best first; empty where nothing is weak, or where
            `fit` fails a check.
    """

    measured: FrequencyResponses
    modal: ModalEstimate
    free_beam: FreeBeam
    tolerances: Tolerances
    components: tuple[Dof, ...]
    paper: MethodResult[JointEstimate] | None
    paper_left_out: str
    likelihood: MethodResult[LikelihoodEstimate]
    fit: JointFit
    regularised: float | None
    cylinders: JointFit | None
    remedies: tuple[Remedy, ...]

    @property
    def fitted_beam(self) -> FreeBeam:
        """The beam without joints, of the most likely modulus and density."""
        return _fitted_beam(self.free_beam, self.fit)

    @property
    def joints_at_drawn_nodes(self) -> list[Joint]:
        """The most likely joints as they act at the drawing's nodes; `likelihood` has them at their own places."""
        return _joints_at_drawn_nodes(self.fit)

    @property
    def results(self) -> tuple[MethodResult[Any], ...]:
        """The results of all methods that were possible, maximum likelihood first."""
        return (self.likelihood,) if self.paper is None else (self.likelihood, self.paper)

    @property
    def agreement(self) -> dict[str, Real]:
        """Frequency response assurance criterion of each measured row with that predicted, by method."""
        keep = self.measured.frequency >= LOWEST_LINE
        return {
            METHODS[result.method]: frac(self.measured.accelerance[:, keep], result.responses.accelerance[:, keep])
            for result in self.results
        }


def inverse_of(
    measurement: MeasuredArticle,
    suspended: SuspendedBeam | None = None,
    options: Options = AS_MEASURED,
    in_tester: Sequence[Joint] = (),
) -> Inverse:
    """Modes, joints and prediction from the reference set.

    Args:
        measurement: with a hammer set on the supported beam.
        suspended: results of the beam without its joints: damping, and E and rho with their remaining errors. Without
            it they are as the article states.
        options: the mesh, the law of the joints, and regularisation.
        in_tester: all joints by the other experiment, to start from where the paper's method is left out; or none.

    Raises:
        AnalysisError: the data do not suffice; the message says what is missing.
    """
    article = measurement.article
    measured = measurement.responses()
    modal = estimate_modes(measured, (LOWEST_LINE, float(measured.frequency[-1])))
    tested = None if suspended is None else suspended.result
    beam = free_beam_of(article, tested, options.elements)
    tolerances = replace(
        tolerances_of(article, None if tested is None else tested.material, by_hand=measured.scatter is not None),
        joint_law=options.joint_law,
    )
    nodes = {joint.name: joint.node for joint in article.joints}
    highest = HIGHEST_PREDICTED * float(np.max(modal.modes.frequency))
    components = components_of(list(nodes.values()), len(article.node_positions), measured.inputs)
    paper, left_out = None, ""
    try:
        by_modes = identify_joints(beam, modal.modes, nodes, components)
        weak = weakest_directions(beam, modal.modes, by_modes, components)
        found = [each.joint for each in by_modes.values()]
        as_drawn = Deviations.none(len(nodes), len(measured.inputs))
        paper = _result(PAPER, by_modes, weak, modes_on(beam, found, highest), (beam, as_drawn), measured, modal)
    except AnalysisError as error:
        left_out = f"The paper's method is left out: {error}"
    starts = _starts(article, beam, measured, paper, in_tester)
    held = None if options.regularise is None else _held(paper, left_out, beam, options.regularise)
    fit = identify_from_responses(
        beam, measured, next(starts), other_starts=starts, parameters=held, tolerances=tolerances
    )
    drawn = _as_drawn(article)
    coupling = coupling_as_drawn([fit.joints[each.name] for each in drawn], drawn)
    fit = replace(fit, checks=(*fit.checks, coupling))
    tolerances = replace(tolerances, joint_law=fit.law)
    predicted = modes_on(_fitted_beam(beam, fit), _joints_at_drawn_nodes(fit), highest, laws_of(fit))
    return Inverse(
        measured=measured,
        modal=modal,
        free_beam=beam,
        tolerances=tolerances,
        components=components,
        paper=paper,
        paper_left_out=left_out,
        likelihood=_result(
            LIKELIHOOD, fit.joints, fit.weak_directions, predicted, (beam, fit.deviations), measured, modal
        ),
        fit=fit,
        regularised=options.regularise,
        cylinders=_by_cylinders(article, beam, measured, fit, tolerances),
        remedies=_remedies(article, fit, tolerances),
    )


def _as_drawn(article: Article) -> list[Joint]:
    """The joints with the drawn inclinations, of cylinders that are twice as stiff in compression as in shear."""
    cylinder = Cylinder(shear=1.0, compression=2.0)
    return [
        joint_from_cylinders(
            each.name, each.node, (cylinder, cylinder), np.radians(each.inclinations_deg), each.eccentricity
        )
        for each in article.joints
    ]


def _starts(
    article: Article,
    beam: FreeBeam,
    measured: FrequencyResponses,
    paper: MethodResult[JointEstimate] | None,
    in_tester: Sequence[Joint],
) -> Iterator[Sequence[Joint]]:
    """Joints to start a fit from, the nearest first as far as one can tell beforehand."""
    if paper is not None:
        yield [found.joint for found in paper.joints.values()]
    if in_tester:
        yield with_small_rotation_terms(in_tester, beam)
    pairs = cylinder_parameters_of(article).pairs
    drawn = [drawn_as_cylinders(joint.node, pair, beam) for joint, pair in zip(article.joints, pairs, strict=True)]
    yield from coarse_joints(beam, measured, drawn, BAND)


def _held(paper: MethodResult[JointEstimate] | None, left_out: str, beam: FreeBeam, share: float) -> HeldTerms:
    """Terms held within a `share` about the joints of the paper's method.

    Modes hardly determine how joints turn, so coupling and rotation are held about those of a joint that is half as
    deep as the beam.

    Raises:
        AnalysisError: the paper's method is left out.
    """
    if paper is None:
        raise AnalysisError(
            f"no terms can be held about those of the paper's method. {left_out}; or identify without regularisation"
        )
    return held_terms(with_small_rotation_terms([found.joint for found in paper.joints.values()], beam), share)


def _by_cylinders(
    article: Article, beam: FreeBeam, measured: FrequencyResponses, fit: JointFit, tolerances: Tolerances
) -> JointFit | None:
    """The fit over the cylinders, from where `fit` is; None where that is no place to start from."""
    if not fit.passed:
        return None
    return identify_from_responses(
        beam,
        measured,
        [found.joint for found in fit.joints.values()],
        parameters=cylinder_parameters_of(article),
        tolerances=tolerances,
    )


def _remedies(article: Article, fit: JointFit, tolerances: Tolerances) -> tuple[Remedy, ...]:
    """Changes of the experiment that would determine the weakest direction of this fit."""
    if not (fit.passed and fit.weak_directions):
        return ()
    return remedies(experiment_of_fit(fit, tolerances), cylinder_parameters_of(article).pairs)


def cylinder_parameters_of(article: Article) -> CylinderParameters:
    """How the joints are built: inclinations within the article's tolerance, stiffnesses free."""
    pairs = []
    for drawn in article.joints:
        lower, upper = drawn.inclinations_deg
        pairs.append(CylinderPair(drawn.name, (math.radians(lower), math.radians(upper)), drawn.eccentricity))
    return CylinderParameters(tuple(pairs), math.radians(article.tolerances.inclination_deg))


def stabilisation_of(measured: FrequencyResponses) -> Stabilisation:
    """The stabilisation chart of a hammer set: poles of every model order from the lines that modes are found from."""
    lines = measured.band(LOWEST_LINE, float(measured.frequency[-1]))
    return read_chart(
        lscf_poles(lines.frequency, lines.accelerance, HIGHEST_ORDER),
        lowest=float(lines.frequency[0]),
        highest=float(lines.frequency[-1]),
        line_spacing=float(lines.frequency[1] - lines.frequency[0]),
        decay=lines.decay,
    )


def prior_effect_by_joint(fit: JointFit) -> dict[str, dict[str, list[list[float]]]]:
    """By joint, (3, 3) shares of the prior in the variance of k and of h, and the bias (SI) that it causes."""
    found: dict[str, dict[str, list[list[float]]]] = {}
    for place, name in enumerate(fit.joints):
        found[name] = {}
        for half, letter in enumerate("kh"):
            at = slice(HALF * (2 * place + half), HALF * (2 * place + half + 1))
            found[name][f"{letter}_prior_share"] = square(fit.prior_effect.share[at]).tolist()
            found[name][f"{letter}_bias"] = square(fit.prior_effect.bias[at]).tolist()
    return found


def laws_of(fit: JointFit) -> Real | None:
    """(4, joints) parameters of the laws of frequency that the joints follow; None where they are constant."""
    return None if fit.law is FrequencyLaw.CONSTANT else fit.deviations.joint_laws


def tolerances_of(article: Article, material: Material | None = None, *, by_hand: bool) -> Tolerances:
    """Stated uncertainties of the beam test, as analysis has them.

    Args:
        article: with its tolerances.
        material: E and rho of a suspended test, where there is one.
        by_hand: whether blows may lean. Averages without their blows include that in their stated variance.
    """
    stated = article.tolerances
    modulus, density, correlation = stated.youngs_modulus, stated.density, 0.0
    if material is not None:
        modulus, density = (each.standard_error / each.value for each in (material.youngs_modulus, material.density))
        correlation = material.correlation
    return Tolerances(
        sensor_gain=stated.sensor_gain,
        youngs_modulus=modulus,
        density=density,
        material_correlation=correlation,
        sensor_position=stated.node_position,
        joint_position=stated.node_position,
        blow_position=stated.impact_position,
        blow_lean=FREEHAND_LEAN if by_hand else 0.0,
        inclination=math.radians(stated.inclination_deg),
    )


def _fitted_beam(drawn: FreeBeam, fit: JointFit) -> FreeBeam:
    return drawn.with_material(1 + fit.deviations.youngs_modulus, 1 + fit.deviations.density)


def _joints_at_drawn_nodes(fit: JointFit) -> list[Joint]:
    parameters = fit.likelihood.parameters
    terms = parameters.upper(fit.values[: len(parameters.labels)])
    nodes = fit.likelihood.model.joint_nodes
    return [Joint(name, node, z) for name, node, z in zip(parameters.names, nodes, matrices(terms), strict=True)]


def _result(
    method: str,
    joints: Mapping[str, JointT],
    weak_directions: WeakDirections | None,
    predicted: Modes,
    bench: tuple[FreeBeam, Deviations],
    measured: FrequencyResponses,
    modal: ModalEstimate,
) -> MethodResult[JointT]:
    """A result with what the beam as drawn does on these joints, where `bench` differs from the drawing so far."""
    beam, deviations = bench
    held_by = [found.joint for found in joints.values()]
    return MethodResult(
        method=method,
        joints=joints,
        weak_directions=weak_directions,
        predicted=predicted,
        errors=mode_errors(modal.modes, predicted),
        responses=accelerance_on(
            beam, held_by, deviations, measured.frequency, measured.response, measured.inputs, measured.decay
        ),
    )
