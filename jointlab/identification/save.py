"""Saving an identification: each result is a row of its own, beside older ones, with what it was made from."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from analysis.comparison import ElementComparison
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.modal.estimation import ModalEstimate
from analysis.structure.agreement import ModeError
from analysis.suspended.beam_update import PARAMETERS
from jointlab.identification.document import plain
from jointlab.identification.inverse import LIKELIHOOD, PAPER, Inverse, MethodResult
from jointlab.identification.over_frequency import over_frequency
from jointlab.identification.pipeline import Identification
from jointlab.identification.sine_points import stored_point
from jointlab.identification.undetermined_text import not_observable_text
from store.dof import StoredDof
from store.measurements.amendments import AS_MEASURED
from store.measurements.frequency_responses import add_frequency_responses
from store.results.analyses import NO_RESULT, Analysis, add_analysis, latest_analysis
from store.results.comparisons import Comparison, add_comparisons
from store.results.dynamic_stiffness import add_dynamic_stiffness
from store.results.joint_matrices import NOT_OBSERVABLE, JointMatrix, add_joint_matrix
from store.results.modes import ModeSet, add_modes
from store.states import AnalysisKind

SUSPENDED_METHOD = "suspended beam"
SUPPORTED_METHOD = "least-squares complex frequency domain, refined by maximum likelihood"

OPTIONS = "options"
PAPER_LEFT_OUT = "paper_left_out"
NOT_COMPARED = "not_compared"
OVER_FREQUENCY = "over_frequency"
SETUP_VERSION = "setup_version"
"""Version of the run's setup that an analysis is of; not there where that is the one it was measured with."""


@dataclass(frozen=True)
class SavedAnalyses:
    """Numbers of the analyses that were stored; None for what was not measured or left out."""

    suspended_beam: int | None = None
    frequency_responses: int | None = None
    modes: int | None = None
    paper_joints: int | None = None
    likelihood_joints: int | None = None
    dynamic_stiffness: int | None = None
    comparisons: int | None = None


def save_identification(session: Session, run_id: int, found: Identification) -> SavedAnalyses:
    """Store every result of an identification in the caller's transaction.

    Raises:
        StoreError: there is no such run, or the database refuses.
    """
    saving = _Saving(session, run_id, found)
    suspended = None if found.suspended is None else saving.suspended_beam()
    responses = modes = paper = likelihood = None
    if found.inverse is not None:
        responses = saving.responses()
        modes = saving.modes(found.inverse, responses)
        if found.inverse.paper is None:
            saving.paper_left_out(found.inverse.paper_left_out, modes)
        else:
            paper = saving.paper_joints(found.inverse.paper, modes)
        sources = [parent for parent in (responses, paper, suspended) if parent is not None]
        likelihood = saving.likelihood_joints(found.inverse, sources)
    elif found.inverse_left_out:
        responses = saving.responses()
        saving.inverse_left_out([parent for parent in (responses, suspended) if parent is not None])
    points = saving.points() if found.measurement.points else None
    compared = [parent for parent in (likelihood, points) if parent is not None]
    comparisons = saving.comparisons(compared) if found.comparison else None
    return SavedAnalyses(suspended, responses, modes, paper, likelihood, points, comparisons)


@dataclass(frozen=True)
class _Saving:
    """Adds analyses of one identification of a run; every method returns the number of its analysis."""

    session: Session
    run_id: int
    found: Identification

    def _add(self, kind: AnalysisKind, method: str, settings: Mapping[str, Any], parents: Sequence[int] = ()) -> int:
        version = self.found.measurement.setup_version
        amended = {} if version == AS_MEASURED else {SETUP_VERSION: version}
        return add_analysis(
            self.session, kind=kind, method=method, settings={**settings, **amended}, runs=[self.run_id],
            parents=parents,
        )  # fmt: skip

    def suspended_beam(self) -> int:
        """Modes of the beam in its cords; damping and material that follow from them are in the settings."""
        suspended, test = self.found.suspended, self.found.measurement.suspended
        assert suspended is not None
        assert test is not None
        parameters = {name: suspended.result.update.parameter(name) for name in PARAMETERS}
        settings = {
            "damping_ratios": list(suspended.result.damping_ratios),
            "beam": {name: [estimate.value, estimate.standard_error] for name, estimate in parameters.items()},
            "statements": list(suspended.result.statements),
            "fit": suspended.modal.quality,
            "run": test.run,
            "decay": test.responses.decay,
        }
        analysis = self._add(AnalysisKind.MODES, SUSPENDED_METHOD, settings)
        add_modes(self.session, analysis, mode_set(suspended.modal))
        return analysis

    def responses(self) -> int:
        """Accelerances from raw blows, or those that were imported."""
        measurement = self.found.measurement
        if not measurement.raw:
            return latest_analysis(self.session, self.run_id, AnalysisKind.FREQUENCY_RESPONSES).id
        first = measurement.sets[0]
        settings = {
            "window": first.window,
            "highest_frequency": float(first.frequency[-1]),
            "left_out": list(measurement.left_out),
            "faults": list(measurement.faults),
        }
        analysis = self._add(AnalysisKind.FREQUENCY_RESPONSES, first.estimator, settings)
        for measured in measurement.sets:
            add_frequency_responses(self.session, analysis, self.run_id, measured)
        return analysis

    def modes(self, inverse: Inverse, parent: int) -> int:
        """Modes of the supported beam."""
        modal = inverse.modal
        settings = {"damping": modal.damping.value, "noise_scale": float(modal.noise_scale), "fit": modal.quality}
        analysis = self._add(AnalysisKind.MODES, SUPPORTED_METHOD, settings, [parent])
        add_modes(self.session, analysis, mode_set(modal, inverse.likelihood.errors))
        return analysis

    def paper_joints(self, paper: MethodResult[Any], parent: int) -> int:
        """Joints by the paper's method."""
        inverse = self.found.inverse
        assert inverse is not None
        settings = {"points": [str(point) for point in inverse.components], "average_longitudinal": True}
        return self._joints(paper, settings, [parent])

    def paper_left_out(self, reason: str, parent: int) -> None:
        """An analysis without results by the paper's method, so that no older one is the newest."""
        self._add(AnalysisKind.JOINT_MATRICES, PAPER, {NO_RESULT: reason}, [parent])

    def likelihood_joints(self, inverse: Inverse, parents: Sequence[int]) -> int:
        """Joints by maximum likelihood, with everything that is needed to compute them again."""
        fit, beam = inverse.fit, inverse.free_beam
        settings = {
            "noise_scale": float(fit.noise_scale),
            "parameters": dict(zip(fit.labels, fit.values.tolist(), strict=True)),
            "passed": fit.passed,
            PAPER_LEFT_OUT: inverse.paper_left_out,
            NOT_COMPARED: self.found.not_compared,
            "regularised": inverse.regularised,
            "youngs_modulus": beam.beam.youngs_modulus,
            "density": beam.beam.density,
            "elements": beam.mesh.positions.size - 1,
            "tolerances": asdict(inverse.tolerances),
            OVER_FREQUENCY: plain(over_frequency(inverse)),
            OPTIONS: self._options(),
        }
        return self._joints(inverse.likelihood, settings, parents)

    def inverse_left_out(self, parents: Sequence[int]) -> None:
        """An analysis without results by each method of the supported beam, so that no older one is the newest."""
        reason = {NO_RESULT: self.found.inverse_left_out}
        self._add(AnalysisKind.MODES, SUPPORTED_METHOD, reason, parents)
        self._add(AnalysisKind.JOINT_MATRICES, PAPER, reason, parents)
        self._add(AnalysisKind.JOINT_MATRICES, LIKELIHOOD, {**reason, OPTIONS: self._options()}, parents)

    def _joints(self, result: MethodResult[Any], settings: Mapping[str, Any], parents: Sequence[int]) -> int:
        reasons = {NOT_OBSERVABLE: {name: not_observable_text(joint) for name, joint in result.joints.items()}}
        analysis = self._add(AnalysisKind.JOINT_MATRICES, result.method, {**settings, **reasons}, parents)
        for joint in result.joints.values():
            add_joint_matrix(self.session, analysis, joint_matrix(joint))
        return analysis

    def points(self) -> int:
        """Sine points from raw records, or those that were imported."""
        if not self.found.measurement.raw:
            return latest_analysis(self.session, self.run_id, AnalysisKind.DYNAMIC_STIFFNESS).id
        corrections = self.found.corrections
        settings = {
            "corrections": [asdict(each) for each in corrections.applied],
            "switched_off": list(corrections.switched_off),
            OPTIONS: self._options(),
        }
        analysis = self._add(AnalysisKind.DYNAMIC_STIFFNESS, "first harmonic (Eqs. 47, 48)", settings)
        add_dynamic_stiffness(self.session, analysis, [stored_point(each) for each in self.found.measurement.points])
        return analysis

    def comparisons(self, parents: Sequence[int]) -> int:
        """Both experiments, element by element."""
        analysis = self._add(AnalysisKind.COMPARISONS, "elements at the modes' frequencies", {}, parents)
        add_comparisons(self.session, analysis, [stored_comparison(each) for each in self.found.comparison])
        return analysis

    def _options(self) -> dict[str, Any]:
        suspended = self.found.measurement.suspended
        return self.found.options.settings(None if suspended is None else suspended.run)


def setup_version_of(analysis: Analysis) -> int:
    """The version of the run's setup that an analysis is of."""
    return int(analysis.settings.get(SETUP_VERSION, AS_MEASURED))


def unobservable_reasons(analysis: Analysis, joint: str) -> dict[str, str]:
    """By term, such as "k11", why it is not observable; empty for analyses that older versions stored."""
    found: dict[str, str] = analysis.settings.get(NOT_OBSERVABLE, {}).get(joint, {})
    return found


def mode_set(modal: ModalEstimate, predicted: Sequence[ModeError] = ()) -> ModeSet:
    """Modes as the store has them, with the frequencies that a model predicts for them."""
    modes = modal.modes
    frequencies = np.full(modes.poles.size, np.nan)
    for pair in predicted:
        frequencies[pair.measured] = pair.predicted_frequency
    return ModeSet(
        frequency=modes.frequency,
        loss_factor=modes.loss_factor,
        dofs=tuple(StoredDof(point.node, point.direction.value) for point in modes.dofs),
        shapes=modes.shapes,
        frequency_ci95=modal.frequency_ci95,
        loss_factor_ci95=modal.loss_factor_ci95,
        predicted_frequency=frequencies,
        pole_covariance=modes.pole_covariance,
        shape_covariance=modes.shape_covariance,
    )


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


def stored_comparison(each: ElementComparison) -> Comparison:
    """The comparison of one element as the store has it."""
    return Comparison(
        joint=each.joint,
        element=each.element,
        inverse=None if each.inverse is None else (each.inverse.low, each.inverse.high),
        direct=(each.direct.low, each.direct.high),
        verdict=each.verdict.value,
        reason=f"{each.reason} ({each.basis})",
        amplitude_pp_mm=1e3 * each.amplitude_pp,
    )
