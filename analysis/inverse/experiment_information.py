"""Information of an experiment, planned or made: standard deviations and weak directions.

The Fisher information of accelerances needs the bench, the points and the noise, but no data. Sets with different
accelerometers add up; parameters that they share, such as E or the place of a blow, are one unknown for all.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.inverse.joint_parameters import HALF, JointParameters, SymmetricTerms, real_terms, upper_terms
from analysis.inverse.observability import bounded_inverse, term_bound, term_units
from analysis.inverse.response_likelihood import Information, ResponseLikelihood
from analysis.inverse.response_model import ResponseModel
from analysis.inverse.tolerances import EXACT, Tolerances, deviation_labels
from analysis.inverse.undetermined_terms import WeakDirections, common_factor, term_names, weak_directions
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint


@dataclass(frozen=True, eq=False)
class PlannedSet:
    """One roving-hammer set.

    Attributes:
        response: the accelerometer.
        inputs: (rows,) points to strike.
        frequency: (lines,) Hz, above zero.
        noise: standard deviation of the averaged accelerances, per real and imaginary part, (m/s^2)/N; one number or
            (rows, lines).
        decay: of the exponential window on its records, 1/s.
    """

    response: Dof
    inputs: tuple[Dof, ...]
    frequency: Real
    noise: float | Real
    decay: float = 0.0


@dataclass(frozen=True)
class LinearPrior:
    """Prior knowledge of the joints: a combination of terms is zero within a standard deviation.

    Attributes:
        weights: by term, such as {"k11(I)": 1, "k22(I)": -1}.
        deviation: in the terms' unit.
    """

    weights: Mapping[str, float]
    deviation: float


@dataclass(frozen=True, eq=False)
class PlannedExperiment:
    """A bench and the sets to measure on it.

    Attributes:
        free_beam: without joints.
        joints: as expected; information depends little on them.
        sets: one for each accelerometer.
        tolerances: of the bench.
        parameters: of the joints; all terms by default.
        priors: on the joints' terms; with parameters that are all terms only.
    """

    free_beam: FreeBeam
    joints: tuple[Joint, ...]
    sets: tuple[PlannedSet, ...]
    tolerances: Tolerances = EXACT
    parameters: JointParameters | None = None
    priors: tuple[LinearPrior, ...] = ()


@dataclass(frozen=True, eq=False)
class ExpectedAccuracy:
    """Expected result of an experiment.

    Attributes:
        terms_covariance: (12 joints, 12 joints) of the joints' terms.
        stiffness_deviation, damping_deviation: by joint, (6,) standard deviations of [k11, k12, k13, k22, k23, k33] and
            of h.
        weak_directions: of the terms with all priors, the weakest first.
    """

    terms_covariance: Real
    stiffness_deviation: dict[str, Real]
    damping_deviation: dict[str, Real]
    weak_directions: WeakDirections


def expected(experiment: PlannedExperiment) -> ExpectedAccuracy:
    """Standard deviations and weak directions to expect, to first order.

    Raises:
        AnalysisError: nothing is planned, a prior names an unknown term, or joints and parameters do not match.
    """
    joints = experiment.joints
    names = tuple(joint.name for joint in joints)
    parameters = experiment.parameters or SymmetricTerms(names)
    if not experiment.sets or parameters.names != names:
        raise AnalysisError("plan at least one set, and give parameters of the same joints in the same order")
    products, tolerance = _all_sets(experiment, parameters)

    values = parameters.start(joints)
    slope = parameters.slope(values)
    chain = block_diag(slope, np.eye(len(tolerance)))
    prior = np.concatenate([parameters.prior_deviation, np.sqrt(np.diag(tolerance))])
    known = block_diag(np.diag(1 / np.square(parameters.prior_deviation)), np.linalg.inv(tolerance))
    normal = np.real(chain.conj().T @ products @ chain) + known
    terms = real_terms(slope)
    terms_slope = np.hstack([terms, np.zeros((len(terms), len(tolerance)))])
    for each in experiment.priors:
        row = _weights(each, names) @ terms_slope / each.deviation
        normal += np.outer(row, row)
    reach = np.concatenate([parameters.reach(values), np.full(len(tolerance), np.inf)])
    sizes = np.where(np.isfinite(prior), prior, np.where(np.isfinite(reach), reach, 1.0))
    covariance = bounded_inverse(normal, sizes)
    terms_covariance = terms_slope @ covariance @ terms_slope.T

    unit = term_units(experiment.free_beam, len(joints))
    terms = real_terms(upper_terms(joints))
    nothing = np.zeros(len(products), dtype=complex)
    bound = term_bound(Information(products, nothing, 0.0), tolerance, unit)
    weak = weak_directions(terms_covariance, names, experiment.free_beam.beam.stiffness_unit, terms)
    first = experiment.sets[0]
    of_all = experiment.tolerances.covariance(first.response, first.inputs, len(joints))
    scale = common_factor(of_all[:3, :3], bound.as_drawn, terms)
    deviation = np.sqrt(np.diag(terms_covariance)).reshape(len(joints), 2, HALF)
    return ExpectedAccuracy(
        terms_covariance=terms_covariance,
        stiffness_deviation={name: deviation[joint, 0] for joint, name in enumerate(names)},
        damping_deviation={name: deviation[joint, 1] for joint, name in enumerate(names)},
        weak_directions=weak if scale is None else (*weak, scale),
    )


def _all_sets(experiment: PlannedExperiment, parameters: JointParameters) -> tuple[Complex, Real]:
    """Products of derivatives of all sets together, and the covariance of the deviations."""
    upper = HALF * len(experiment.joints)
    nodes = tuple(joint.node for joint in experiment.joints)
    stiffness = np.array([joint.dynamic_stiffness for joint in experiment.joints])
    parts: list[tuple[Complex, Real, list[str]]] = []
    for each in experiment.sets:
        model = ResponseModel(experiment.free_beam, nodes, each.response, each.inputs, each.frequency, each.decay)
        tolerance = experiment.tolerances.covariance(each.response, each.inputs, len(experiment.joints))
        shape = (len(each.inputs), each.frequency.size)
        noise = np.broadcast_to(np.asarray(each.noise, dtype=float), shape)
        likelihood = ResponseLikelihood(model, np.zeros(shape, dtype=complex), noise, parameters, tolerance)
        response = likelihood.as_drawn.evaluate_on(stiffness)
        labels = np.array(deviation_labels(each.response, each.inputs, parameters.names))[likelihood.active].tolist()
        parts.append((likelihood.information(response).products, likelihood.active_tolerance, labels))
    order = {label: place for place, label in enumerate(dict.fromkeys(each for *_, own in parts for each in own))}
    products = np.zeros((upper + len(order), upper + len(order)), dtype=complex)
    covariance = np.zeros((len(order), len(order)))
    for own, own_covariance, labels in parts:
        places = np.array([order[label] for label in labels], dtype=np.intp)
        covariance[np.ix_(places, places)] = own_covariance
        places = np.concatenate([np.arange(upper), upper + places])
        products[np.ix_(places, places)] += own
    return products, covariance


def _weights(prior: LinearPrior, names: Sequence[str]) -> Real:
    labels = term_names(names)
    unknown = set(prior.weights) - set(labels)
    if unknown:
        raise AnalysisError(f"a prior names {', '.join(sorted(unknown))}; the terms are {labels[0]} to {labels[-1]}")
    return np.array([prior.weights.get(label, 0.0) for label in labels])
