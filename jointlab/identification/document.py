"""An identification as the JSON document `jointlab-identification/1`, which other programs read."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from analysis.comparison import Bounds, ElementComparison
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.interval import Estimate
from analysis.inverse.frequency_laws import REFERENCE_FREQUENCY
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.joint_amplitude import JointAmplitude
from analysis.modal.estimation import ModalEstimate
from analysis.modal.spectra import Windows
from analysis.suspended.beam_update import PARAMETERS
from jointlab.identification.direct import Direct
from jointlab.identification.direct_notices import direct_notices, unphysical_text
from jointlab.identification.inverse import Inverse, MethodResult, prior_effect_by_joint
from jointlab.identification.levels import Level
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.over_frequency import over_frequency
from jointlab.identification.pipeline import Identification
from jointlab.identification.statements import regularisation_statements
from jointlab.identification.suspended import SuspendedBeam
from jointlab.identification.tester_corrections import TesterCorrections
from jointlab.identification.undetermined_text import not_observable_text, remedy_text, weak_direction_text
from jointlab.identification.validity_text import check_text

FORMAT = "jointlab-identification/1"


def identification_document(found: Identification) -> dict[str, Any]:
    """The whole document; numbers that are not known are null."""
    document: dict[str, Any] = plain(
        {
            "format": FORMAT,
            "title": found.measurement.title,
            "blows_left_out": found.measurement.left_out,
            "faults": found.measurement.faults,
            "averaging": _averaging(found.inverse, found.measurement) if found.inverse else None,
            "suspended_beam": _suspended(found.suspended) if found.suspended else None,
            "modes": _modes(found.inverse) if found.inverse else None,
            "inverse": _inverse(found.inverse.likelihood) if found.inverse else None,
            "inverse_left_out": found.inverse_left_out or None,
            "inverse_model": _model(found.inverse) if found.inverse else None,
            "inverse_over_frequency": over_frequency(found.inverse) if found.inverse else None,
            "inverse_gates": _validity_checks(found.inverse) if found.inverse else None,
            "inverse_prediction": _prediction(found.inverse) if found.inverse else None,
            "inverse_remedies": [remedy_text(remedy) for remedy in found.inverse.remedies] if found.inverse else None,
            "inverse_regularisation": _regularisation(found.inverse),
            "inverse_cylinders": _cylinders(found.inverse),
            "levels": [_level(level) for level in found.levels.found],
            "levels_left_out": found.levels.left_out,
            "inverse_paper": _inverse(found.inverse.paper) if found.inverse and found.inverse.paper else None,
            "inverse_paper_left_out": found.inverse.paper_left_out if found.inverse else None,
            "direct": {name: _direct(direct) for name, direct in found.direct.items()},
            "direct_claims": {name: direct.claims for name, direct in found.direct.items()},
            "direct_unphysical": {
                name: [unphysical_text(part) for part in direct.unphysical] for name, direct in found.direct.items()
            },
            "direct_left_out": {name: direct.left_out for name, direct in found.direct.items()},
            "corrections": _corrections(found.corrections) if found.direct else None,
            "direct_notices": {name: direct_notices(name, direct) for name, direct in found.direct.items()},
            "comparison": [_comparison(each) for each in found.comparison],
            "not_compared": found.not_compared or None,
            "seconds": round(found.seconds, 3),
        }
    )
    return document


def modes_document(modal: ModalEstimate) -> dict[str, Any]:
    """Frequencies, loss factors and shapes with their intervals."""
    modes = modal.modes
    return {
        "frequency_hz": modes.frequency,
        "loss_factor": modes.loss_factor,
        "frequency_ci95": modal.frequency_ci95,
        "loss_factor_ci95": modal.loss_factor_ci95,
        "fit": modal.quality,
        "points": [str(point) for point in modes.dofs],
        "shapes": {"real": modes.shapes.real, "imaginary": modes.shapes.imag},
    }


def _suspended(suspended: SuspendedBeam) -> dict[str, Any]:
    result, update = suspended.result, suspended.result.update
    return {
        "modes": [
            {
                "mode": row.mode,
                "frequency_hz": row.experiment and row.experiment.value,
                "frequency_ci95": row.experiment and row.experiment.interval(),
                "damping_ratio": row.damping_ratio and row.damping_ratio.value,
                "damping_ratio_ci95": row.damping_ratio and row.damping_ratio.interval(),
                "timoshenko_hz": row.timoshenko,
                "euler_bernoulli_hz": row.euler_bernoulli,
                "updated_hz": row.updated,
            }
            for row in result.table
        ],
        "beam": {
            name: {"value": update.parameter(name).value, "ci95": update.parameter(name).interval()}
            for name in PARAMETERS
        },
        "consistent": update.consistent,
        "statements": result.statements,
    }


def _modes(inverse: Inverse) -> dict[str, Any]:
    found = modes_document(inverse.modal) | _predicted(inverse.modal, inverse.likelihood)
    if inverse.paper is None:
        return found
    return found | {f"{name}_paper": column for name, column in _predicted(inverse.modal, inverse.paper).items()}


def _predicted(modal: ModalEstimate, route: MethodResult[Any]) -> dict[str, Any]:
    """Prediction of the beam on the identified joints for every measured mode."""
    pairs = {pair.measured: pair for pair in route.errors}
    modes = range(modal.modes.poles.size)

    def column(name: str) -> list[float | None]:
        return [getattr(pairs[mode], name) if mode in pairs else None for mode in modes]

    return {
        "predicted_hz": column("predicted_frequency"),
        "predicted_loss_factor": column("predicted_loss_factor"),
        "mac": column("mac"),
    }


def _inverse(route: MethodResult[Any]) -> dict[str, Any]:
    joints = {name: _joint(joint) for name, joint in route.joints.items()}
    return joints | {"weak_directions": _weak_directions(route)}


def _averaging(inverse: Inverse, measurement: MeasuredArticle) -> dict[str, Any]:
    """How blows of the reference set became accelerances, and the damping that was taken out of each mode for it."""
    first, windows = measurement.sets[0], Windows(decay=inverse.measured.decay)
    return {
        "estimator": first.estimator,
        "window": first.window,
        "loss_factor_taken_out": windows.added_loss_factor(inverse.modal.modes.frequency),
    }


def _model(inverse: Inverse) -> dict[str, Any]:
    """Beam of the fit, law of the joints, and leans of the blows.

    Constant joints have no parameters of their law, averages without their blows no lean.
    """
    beam, fit = inverse.free_beam, inverse.fit
    return {
        "youngs_modulus": beam.beam.youngs_modulus,
        "density": beam.beam.density,
        "elements": beam.mesh.positions.size - 1,
        "reference_hz": REFERENCE_FREQUENCY,
        "law": fit.law.value,
        "law_parameters": {
            name: {parameter: {"value": found.value, "ci95": found.interval()} for parameter, found in law.items()}
            for name, law in fit.law_parameters.items()
        },
        "lean_deg": {
            point: {"value": math.degrees(found.value), "ci95": list(map(math.degrees, found.interval()))}
            for point, found in fit.leans.items()
        },
    }


def _prediction(inverse: Inverse) -> dict[str, Any]:
    """Agreement of measured and predicted rows, and the rms over lines of the prediction's standard error."""
    deviation = inverse.fit.predicted.magnitude_deviation
    return {
        "points": [str(point) for point in inverse.measured.inputs],
        "frac": inverse.agreement,
        "magnitude_se_rms": np.sqrt(np.mean(deviation**2, axis=1)),
    }


def _validity_checks(inverse: Inverse) -> list[dict[str, Any]]:
    return [{"name": check.name, "passed": check.passed, "text": check_text(check)} for check in inverse.fit.all_checks]


def _regularisation(inverse: Inverse | None) -> dict[str, Any] | None:
    """The prior of the terms and its effect on each; None where the terms were free."""
    if inverse is None or inverse.regularised is None:
        return None
    return {
        "within": inverse.regularised,
        "statements": regularisation_statements(inverse.fit, inverse.regularised),
        "joints": prior_effect_by_joint(inverse.fit),
    }


def _cylinders(inverse: Inverse | None) -> dict[str, Any] | None:
    """Joints from the cylinders they are built of: the parameters by name, and the matrices that follow."""
    fit = None if inverse is None else inverse.cylinders
    if fit is None:
        return None
    errors, freedom = np.sqrt(np.diag(fit.covariance)), fit.degrees_of_freedom
    columns = (each.tolist() for each in (fit.values, errors, freedom))
    estimates = dict(zip(fit.labels, map(Estimate, *columns), strict=True))
    return {name: _joint(joint) for name, joint in fit.joints.items()} | {
        "parameters": {label: {"value": found.value, "ci95": found.interval()} for label, found in estimates.items()},
        "passed": fit.passed,
        "chi_square": float(np.mean(fit.chi_square_per_row)),
    }


def _level(level: Level) -> dict[str, Any]:
    """One set by itself: joints at the amplitude that its blows or its sine caused."""
    joints = {
        name: _level_amplitude(level.amplitudes.get(name)) | _joint(joint) for name, joint in level.fit.joints.items()
    }
    return {
        "set": level.number,
        "excitation": level.excitation,
        "peak_force": level.peak_force,
        "temperature_c": level.temperature_c,
        "passed": level.fit.passed,
        "joints": joints,
    }


def _level_amplitude(found: JointAmplitude | None) -> dict[str, Any]:
    if found is None:
        return {"amplitude_pp_mm": None, "amplitude_pp_mm_ci95": None, "amplitude_source": None}
    return {
        "amplitude_pp_mm": 1e3 * float(found.amplitude_pp[0]),
        "amplitude_pp_mm_ci95": None if found.ci95 is None else 1e3 * found.ci95[0],
        "amplitude_source": found.source,
    }


def _weak_directions(route: MethodResult[Any]) -> list[str]:
    if route.weak_directions is None:
        return ["not known: the identified joints do not give back as many modes as were measured"]
    return [weak_direction_text(weak) for weak in route.weak_directions]


def _joint(joint: IdentifiedJoint) -> dict[str, Any]:
    return {
        "k": joint.stiffness,
        "h": joint.damping,
        "gamma": joint.loss_factor,
        "k_ci95": joint.k_ci95,
        "h_ci95": joint.h_ci95,
        "gamma_ci95": joint.loss_factor_ci95,
        "observable": joint.observable,
        "not_observable": not_observable_text(joint),
    }


def _corrections(corrections: TesterCorrections) -> dict[str, Any]:
    calibration = corrections.calibration
    return {
        "applied": [asdict(each) for each in corrections.applied],
        "switched_off": corrections.switched_off,
        "calibration": calibration
        and {
            "chi_square": calibration.chi_square,
            "degrees_of_freedom": calibration.degrees_of_freedom,
            "warnings": calibration.warnings,
        },
    }


def _direct(direct: Direct) -> dict[str, Any]:
    return {
        configuration: {f"{amplitude:g}": _series(points) for amplitude, points in by_amplitude.items()}
        for configuration, by_amplitude in direct.series.items()
    }


def _series(points: tuple[DynamicStiffness, ...]) -> dict[str, Any]:
    return {
        "frequency_hz": [point.frequency for point in points],
        "amplitude_pp_mm": [1e3 * point.amplitude_pp for point in points],
        "k": [point.stiffness for point in points],
        "h": [point.damping for point in points],
        "gamma": [point.loss_factor for point in points],
        "k_ci95": [point.stiffness_estimate.interval() for point in points],
        "h_ci95": [point.damping_estimate.interval() for point in points],
        "gamma_ci95": [point.loss_factor_estimate.interval() for point in points],
        "thd_force": [point.thd_force for point in points],
        "thd_force_se": [point.thd_force_standard_error for point in points],
        "thd_displacement": [point.thd_displacement for point in points],
        "thd_displacement_se": [point.thd_displacement_standard_error for point in points],
        "loop_energy": [point.loop_energy for point in points],
        "loop_energy_ci95": [_interval(point.loop_energy_estimate) for point in points],
        "first_harmonic_energy": [point.first_harmonic_energy for point in points],
        "loop_energy_excess_ci95": [_interval(point.loop_energy_excess) for point in points],
        "first_harmonic_sufficient": [point.first_harmonic_sufficient for point in points],
    }


def _interval(estimate: Estimate | None) -> tuple[float, float] | None:
    return None if estimate is None else estimate.interval()


def _comparison(each: ElementComparison) -> dict[str, Any]:
    return {
        "joint": each.joint,
        "element": each.element,
        "inverse": _ends(each.inverse),
        "direct": _ends(each.direct),
        "amplitude_pp_mm": 1e3 * each.amplitude_pp,
        "amplitude_pp_mm_ci95": None if each.amplitude_ci95 is None else [1e3 * end for end in each.amplitude_ci95],
        "basis": each.basis,
        "verdict": each.verdict.value,
        "reason": each.reason,
    }


def _ends(bounds: Bounds | None) -> list[float] | None:
    return None if bounds is None else [bounds.low, bounds.high]


def plain(value: Any) -> Any:
    """Plain values for JSON: arrays become lists, and numbers that are not finite become null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
