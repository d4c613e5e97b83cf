"""Keeping an identification: each result a row of its own, beside older ones, with what it was made from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from analysis.comparison import ElementComparison
from analysis.frequency_response import Real
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.modal.estimation import ModalEstimate
from analysis.suspended.beam_update import PARAMETERS
from jointlab.identification.inverse import Inverse, MethodResult
from jointlab.identification.pipeline import Identification
from jointlab.identification.sine_points import stored_point
from store.analyses import Analysis, add_analysis, latest_analysis
from store.comparisons import Comparison, add_comparisons
from store.dof import StoredDof
from store.dynamic_stiffness import add_dynamic_stiffness
from store.frequency_responses import add_frequency_responses
from store.joint_matrices import JointMatrix, add_joint_matrix
from store.modes import ModeSet, add_modes
from store.states import AnalysisKind

SUSPENDED_METHOD = "suspended beam"
NOT_OBSERVABLE = "not_observable"
OPTIONS = "options"


@dataclass(frozen=True)
class SavedAnalyses:
    """Numbers of the analyses that were stored; None for what was not measured."""

    suspended_beam: int | None
    frequency_responses: int | None
    modes: int | None
    paper_joints: int | None
    likelihood_joints: int | None
    dynamic_stiffness: int | None
    comparisons: int | None


def save_identification(session: Session, run_id: int, found: Identification) -> SavedAnalyses:
    """Store every result of an identification in the caller's transaction.

    Raises:
        StoreError: there is no such run, or the database refuses.
    """
    suspended = None if found.suspended is None else _suspended(session, run_id, found)
    responses = modes = paper = likelihood = None
    if found.inverse is not None:
        responses = _responses(session, run_id, found)
        modes = _modes(session, run_id, responses, found.inverse)
        paper = _paper_joints(session, run_id, modes, found.inverse)
        sources = [parent for parent in (responses, paper, suspended) if parent is not None]
        likelihood = _likelihood_joints(session, run_id, sources, found.inverse, _chosen(found))
    points = _points(session, run_id, found) if found.measurement.points else None
    comparisons = None
    if found.comparison:
        parents = [parent for parent in (likelihood, points) if parent is not None]
        comparisons = add_analysis(
            session,
            kind=AnalysisKind.COMPARISONS,
            method="elements at the modes' frequencies",
            settings={},
            runs=[run_id],
            parents=parents,
        )
        add_comparisons(session, comparisons, [_comparison(each) for each in found.comparison])
    return SavedAnalyses(suspended, responses, modes, paper, likelihood, points, comparisons)


def _suspended(session: Session, run_id: int, found: Identification) -> int:
    """Modes of the beam in its cords; what they say of its damping and material is in the settings."""
    assert found.suspended is not None
    assert found.measurement.suspended is not None
    modal, result = found.suspended.modal, found.suspended.result
    analysis = add_analysis(
        session,
        kind=AnalysisKind.MODES,
        method=SUSPENDED_METHOD,
        settings={
            "damping_ratios": list(result.damping_ratios),
            "beam": {
                name: [estimate.value, estimate.standard_error]
                for name, estimate in ((name, result.update.parameter(name)) for name in PARAMETERS)
            },
            "statements": list(result.statements),
            "run": found.measurement.suspended.run,
            "decay": found.measurement.suspended.responses.decay,
        },
        runs=[run_id],
    )
    add_modes(session, analysis, _mode_set(modal, np.full(modal.modes.poles.size, np.nan)))
    return analysis


def _mode_set(modal: ModalEstimate, predicted: Real) -> ModeSet:
    modes = modal.modes
    return ModeSet(
        frequency=modes.frequency,
        loss_factor=modes.loss_factor,
        dofs=tuple(StoredDof(point.node, point.direction.value) for point in modes.dofs),
        shapes=modes.shapes,
        frequency_ci95=modal.frequency_ci95,
        loss_factor_ci95=modal.loss_factor_ci95,
        predicted_frequency=predicted,
        pole_covariance=modes.pole_covariance,
        shape_covariance=modes.shape_covariance,
    )


def _responses(session: Session, run_id: int, found: Identification) -> int:
    if not found.measurement.raw:
        return latest_analysis(session, run_id, AnalysisKind.FREQUENCY_RESPONSES).id
    first = found.measurement.sets[0]
    analysis = add_analysis(
        session,
        kind=AnalysisKind.FREQUENCY_RESPONSES,
        method=first.estimator,
        settings={
            "window": first.window,
            "highest_frequency": float(first.frequency[-1]),
            "left_out": list(found.measurement.left_out),
            "faults": list(found.measurement.faults),
        },
        runs=[run_id],
    )
    for measured in found.measurement.sets:
        add_frequency_responses(session, analysis, run_id, measured)
    return analysis


def _modes(session: Session, run_id: int, parent: int, inverse: Inverse) -> int:
    modal = inverse.modal
    analysis = add_analysis(
        session,
        kind=AnalysisKind.MODES,
        method="least-squares complex frequency domain, refined by maximum likelihood",
        settings={"damping": modal.damping.value, "noise_scale": float(modal.noise_scale)},
        runs=[run_id],
        parents=[parent],
    )
    predicted = np.full(modal.modes.poles.size, np.nan)
    for pair in inverse.likelihood.errors:
        predicted[pair.measured] = pair.predicted_frequency
    add_modes(session, analysis, _mode_set(modal, predicted))
    return analysis


def _paper_joints(session: Session, run_id: int, parent: int, inverse: Inverse) -> int:
    analysis = add_analysis(
        session,
        kind=AnalysisKind.JOINT_MATRICES,
        method=inverse.paper.method,
        settings={
            "points": [str(point) for point in inverse.components],
            "average_longitudinal": True,
            NOT_OBSERVABLE: _reasons(inverse.paper),
        },
        runs=[run_id],
        parents=[parent],
    )
    for joint in inverse.paper.joints.values():
        add_joint_matrix(session, analysis, joint_matrix(joint))
    return analysis


def _likelihood_joints(
    session: Session, run_id: int, parents: Sequence[int], inverse: Inverse, chosen: dict[str, Any]
) -> int:
    fit, beam = inverse.fit, inverse.free_beam
    analysis = add_analysis(
        session,
        kind=AnalysisKind.JOINT_MATRICES,
        method=inverse.likelihood.method,
        settings={
            "noise_scale": float(fit.noise_scale),
            "parameters": dict(zip(fit.labels, fit.values.tolist(), strict=True)),
            "passed": fit.passed,
            "regularised": inverse.regularised,
            "youngs_modulus": beam.beam.youngs_modulus,
            "density": beam.beam.density,
            "elements": beam.mesh.positions.size - 1,
            "tolerances": asdict(inverse.tolerances),
            OPTIONS: chosen,
            NOT_OBSERVABLE: _reasons(inverse.likelihood),
        },
        runs=[run_id],
        parents=parents,
    )
    for joint in inverse.likelihood.joints.values():
        add_joint_matrix(session, analysis, joint_matrix(joint))
    return analysis


def _chosen(found: Identification) -> dict[str, Any]:
    """What was chosen by hand, and the run of whose suspended beam the beam is."""
    suspended = found.measurement.suspended
    return found.options.settings(None if suspended is None else suspended.run)


def _reasons(route: MethodResult[Any]) -> dict[str, dict[str, str]]:
    return {name: joint.not_observable for name, joint in route.joints.items()}


def unobservable_reasons(analysis: Analysis, joint: str) -> dict[str, str]:
    """By term, such as "k11", why it is not observable; empty for analyses that older versions stored."""
    found: dict[str, str] = analysis.settings.get(NOT_OBSERVABLE, {}).get(joint, {})
    return found


def joint_matrix(joint: IdentifiedJoint) -> JointMatrix:
    """A joint as the store has it."""
    return JointMatrix(
        joint=joint.name,
        node=joint.node,
        stiffness=joint.stiffness,
        damping=joint.damping,
        stiffness_ci95=joint.k_ci95,
        damping_ci95=joint.h_ci95,
        loss_factor=joint.loss_factor,
        loss_factor_ci95=joint.loss_factor_ci95,
        observable=joint.observable,
        covariance=joint.best_covariance,
    )


def _points(session: Session, run_id: int, found: Identification) -> int:
    if not found.measurement.raw:
        return latest_analysis(session, run_id, AnalysisKind.DYNAMIC_STIFFNESS).id
    analysis = add_analysis(
        session,
        kind=AnalysisKind.DYNAMIC_STIFFNESS,
        method="first harmonic (Eqs. 47, 48)",
        settings={
            "corrections": [asdict(each) for each in found.corrections.applied],
            "switched_off": list(found.corrections.switched_off),
            OPTIONS: _chosen(found),
        },
        runs=[run_id],
    )
    add_dynamic_stiffness(session, analysis, [stored_point(point) for point in found.measurement.points])
    return analysis


def _comparison(each: ElementComparison) -> Comparison:
    return Comparison(
        joint=each.joint,
        element=each.element,
        inverse=None if each.inverse is None else (each.inverse.low, each.inverse.high),
        direct=(each.direct.low, each.direct.high),
        verdict=each.verdict.value,
        reason=f"{each.reason} ({each.basis})",
        amplitude_pp_mm=1e3 * each.amplitude_pp,
    )
