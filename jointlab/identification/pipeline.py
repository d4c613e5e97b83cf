"""The whole identification: joints by the hammer, cylinders in the tester, and their comparison."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.comparison import Bounds, ElementComparison, compare
from analysis.direct.cylinder_terms import JointLaw, JointTerms
from analysis.errors import AnalysisError, NoModeError
from analysis.interval import Estimate
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.frequency_laws import REFERENCE_FREQUENCY
from analysis.inverse.joint_fit import JointFit
from analysis.joint_amplitude import JointAmplitude
from analysis.structure.joints import Joint
from jointlab.errors import JointlabError
from jointlab.identification.direct import Direct, direct_of
from jointlab.identification.fault_correction import correct_faults
from jointlab.identification.inverse import Inverse, inverse_of
from jointlab.identification.levels import Levels, amplitudes_of_set, levels_of
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import AS_MEASURED, Options
from jointlab.identification.suspended import SuspendedBeam, suspended_beam_of
from jointlab.identification.tester_corrections import TesterCorrections, corrected


@dataclass(frozen=True, eq=False)
class Identification:
    """Joints by both methods from one measurement; results of an experiment that was not made are None or empty.

    Attributes:
        measurement: the input.
        options: as chosen.
        suspended: the beam without its joints, or None; its damping, E and rho are then those of the inverse method.
        inverse: from the hammer, or None.
        inverse_left_out: why there is none although the hammer struck, a phrase; else empty.
        levels: joints against amplitude, where there are several hammer sets.
        direct: from the tester, by joint.
        comparison: element by element, where both are there and the fit to the hammer's accelerances passed its checks.
        not_compared: why there is no comparison although both experiments were made, a phrase; else empty.
        corrections: of the sine points.
        seconds: time that it took.
    """

    measurement: MeasuredArticle
    options: Options
    suspended: SuspendedBeam | None
    inverse: Inverse | None
    inverse_left_out: str
    levels: Levels
    direct: Mapping[str, Direct]
    comparison: tuple[ElementComparison, ...]
    not_compared: str
    corrections: TesterCorrections
    seconds: float


def identify(measurement: MeasuredArticle, options: Options = AS_MEASURED) -> Identification:
    """Identify by both methods and compare. If the supported beam shows no mode, only its joints are left out.

    Args:
        measurement: both experiments, or one of them.
        options: mesh, priors and corrections; those of averaging act where the measurement is loaded.

    Raises:
        AnalysisError: a method cannot work with these data; the message says what is missing.
        JointlabError: the measurement holds neither experiment, or there is no such correction.
    """
    started = time.perf_counter()
    if not (measurement.sets or measurement.points or measurement.suspended):
        raise JointlabError(f"{measurement.title}: neither accelerances nor sine points to identify from")
    points, corrections = corrected(measurement.points, measurement.calibration, measurement.reference, options.without)
    measurement = replace(correct_faults(measurement) if measurement.sets else measurement, points=points)
    suspended = suspended_beam_of(measurement, options.elements)
    direct = direct_of(measurement)
    inverse, left_out = None, ""
    try:
        if measurement.sets:
            inverse = inverse_of(measurement, suspended, options, _in_tester(measurement, direct))
    except NoModeError as error:
        if not direct and suspended is None:
            raise
        left_out = str(error)
    levels = levels_of(measurement, inverse) if inverse is not None else Levels()
    comparison, not_compared = tuple[ElementComparison, ...](), ""
    if inverse is not None and direct:
        comparison, not_compared = _comparison(measurement, inverse, direct)
    seconds = time.perf_counter() - started
    return Identification(
        measurement=measurement,
        options=options,
        suspended=suspended,
        inverse=inverse,
        inverse_left_out=left_out,
        levels=levels,
        direct=direct,
        comparison=comparison,
        not_compared=not_compared,
        corrections=corrections,
        seconds=seconds,
    )


def _in_tester(measurement: MeasuredArticle, direct: Mapping[str, Direct]) -> tuple[Joint, ...]:
    """Joints as the tester has them at its smallest amplitude, in the middle of its frequencies; none if one lacks."""
    found = []
    for drawn in measurement.article.joints:
        if drawn.name not in direct or not direct[drawn.name].joint:
            return ()
        by_amplitude = direct[drawn.name].joint
        rows = [
            [each.complex_stiffness for each in (terms.k11, terms.k12, terms.k22)]
            for terms in by_amplitude[min(by_amplitude)]
        ]
        k11, k12, k22 = np.median(np.real(rows), axis=0) + 1j * np.median(np.imag(rows), axis=0)
        found.append(Joint(drawn.name, drawn.node, np.array([[k11, k12, 0], [k12, k22, 0], [0, 0, 0]])))
    return tuple(found)


def _comparison(
    measurement: MeasuredArticle, inverse: Inverse, direct: Mapping[str, Direct]
) -> tuple[tuple[ElementComparison, ...], str]:
    """Element by element, at the amplitudes that the blows really caused; and why, where there is none.

    Constant joints are compared at the modes' frequencies, those that follow frequency where they are stated. Joints of
    a fit that fails a check are not those of the bench, and a verdict on them would say nothing of the two methods.
    """
    if not inverse.fit.passed:
        failed = ", ".join(check.name for check in inverse.fit.all_checks if not check.passed)
        return (), f"the fit to the accelerances failed its checks ({failed})"
    joints, predicted = inverse.likelihood.joints, inverse.likelihood.predicted
    lacking = [name for name in joints if name not in direct or not direct[name].joint]
    if lacking:
        refused = any(direct[name].left_out for name in lacking if name in direct)
        why = (
            "a configuration has no point that can be a specimen's"
            if refused
            else "not all configurations were measured"
        )
        return (), f"the tester has no terms of joint {', '.join(lacking)}, as {why}"
    known: dict[str, Sequence[JointTerms] | JointLaw] = {
        name: direct[name].law or [term for series in direct[name].joint.values() for term in series] for name in joints
    }
    follow = inverse.fit.law is not FrequencyLaw.CONSTANT
    try:
        found = compare(
            known,
            joints,
            mode_frequencies=[REFERENCE_FREQUENCY] * predicted.poles.size if follow else predicted.frequency.tolist(),
            amplitude_pp=_amplitudes(measurement, inverse, 1e-3 * min(min(direct[name].joint) for name in joints)),
            sums=_sums_of_11(inverse.fit),
            relative_uncertainty=measurement.article.tolerances.tester_gain,
            setup_scatter=measurement.article.tolerances.setup_scatter or 0.0,
        )
    except AnalysisError as error:  # such as points that lie nowhere near the modes
        return (), str(error)
    return found, ""


def _amplitudes(measurement: MeasuredArticle, inverse: Inverse, smallest: float) -> dict[str, JointAmplitude]:
    """Amplitudes in the reference set; if the joints give none, the `smallest` of the tester, m, stands for all."""
    predicted = inverse.likelihood.predicted
    nodes = {name: joint.node for name, joint in inverse.likelihood.joints.items()}
    source = "the smallest of the tester, as a mode on these joints does not decay"
    instead = JointAmplitude(np.full(predicted.poles.size, smallest), source=source)
    return amplitudes_of_set(measurement, 0, predicted, nodes) or dict.fromkeys(nodes, instead)


def _sums_of_11(fit: JointFit) -> dict[str, Bounds]:
    """The sum of k11 over the joints, and the loss factor of that sum."""
    total, covariance, freedom = fit.sum_of(0, 0)
    loss_factor = total.imag / total.real
    by_parts = np.array([-loss_factor, 1.0]) / total.real
    return {
        "k11": Bounds.of(Estimate(total.real, float(np.sqrt(covariance[0, 0])), freedom)),
        "gamma11": Bounds.of(Estimate(loss_factor, float(np.sqrt(by_parts @ covariance @ by_parts)), freedom)),
    }
