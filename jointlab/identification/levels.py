"""Joints against amplitude: every set by itself, at the amplitude that its blows or its sine caused.

The amplitude follows from the force records of a set's blows, from their mean peak, or from the force of its sine.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.errors import AnalysisError
from analysis.inverse.frequency_dependent_joints import modes_on
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.joint_amplitude import BlowForce, JointAmplitude, joint_amplitudes, sine_amplitudes
from analysis.modes import Modes
from jointlab.identification.inverse import HIGHEST_PREDICTED, Inverse, laws_of
from jointlab.identification.measurement import MeasuredArticle, dof
from store.measurements.frequency_responses import FrequencyResponseSet
from store.states import SINE, Excitation

BLOW_WIDTH = 4e-4  # s at half of the peak, of a hammer tip that reaches 1 kHz; its logarithm is what counts


@dataclass(frozen=True, eq=False)
class Level:
    """One set.

    Attributes:
        number: of the set.
        excitation: hammer or sine.
        peak_force: mean of its blows, or amplitude of its sine, N.
        temperature_c: degrees Celsius.
        fit: joints by maximum likelihood, with their checks.
        amplitudes: by joint, one for all modes; empty where a mode does not decay on these joints.
    """

    number: int
    excitation: Excitation
    peak_force: float
    temperature_c: float
    fit: JointFit
    amplitudes: Mapping[str, JointAmplitude]


@dataclass(frozen=True, eq=False)
class Levels:
    """All sets.

    Attributes:
        found: those that tell joints.
        left_out: the others with the reason, one phrase each.
    """

    found: tuple[Level, ...] = ()
    left_out: tuple[str, ...] = ()


def levels_of(measurement: MeasuredArticle, inverse: Inverse) -> Levels:
    """Joints from each set; those of the reference set are taken from `inverse`. Empty for a single set.

    Terms that are held in the reference set are held in every set, about the same values.

    A further set whose data do not suffice is left out; the others are not affected.
    """
    if len(measurement.sets) < 2:
        return Levels()
    highest = HIGHEST_PREDICTED * float(np.max(inverse.modal.modes.frequency))
    start = [found.joint for found in inverse.fit.joints.values()]
    found, left_out = list[Level](), list[str]()
    for index, measured in enumerate(measurement.sets):
        try:
            fit = inverse.fit
            if index > 0:
                fit = identify_from_responses(
                    inverse.free_beam,
                    measurement.responses(index),
                    start,
                    parameters=inverse.fit.likelihood.parameters,  # held in every set, where in the reference set
                    tolerances=inverse.tolerances,
                )
            held_by = [joint.joint for joint in fit.joints.values()]
            predicted = modes_on(inverse.free_beam, held_by, highest, laws_of(fit))
            nodes = {name: joint.node for name, joint in fit.joints.items()}
            amplitudes = amplitudes_of_set(measurement, index, predicted, nodes) or {}
        except AnalysisError as error:
            if index == 0:
                raise
            left_out.append(f"set {measured.number}: {error}")
            continue
        found.append(
            Level(
                number=measured.number,
                excitation=measured.excitation,
                peak_force=measured.peak_force,
                temperature_c=measured.temperature_c,
                fit=fit,
                amplitudes={name: each.over_modes for name, each in amplitudes.items()},
            )
        )
    return Levels(tuple(found), tuple(left_out))


def amplitudes_of_set(
    measurement: MeasuredArticle, index: int, predicted: Modes, joint_nodes: Mapping[str, int]
) -> dict[str, JointAmplitude] | None:
    """The amplitude at which each predicted mode saw each joint in set `index`, by joint.

    From the force that was recorded of every blow that counts, with an interval from their scatter. Without records at
    every point it is that of the set's mean peak and a usual width, and has none; nor has that of a sine. Which it was
    is in `source`.

    Returns:
        None where a predicted mode does not decay: joints that feed energy fail their check, and no ring-down of theirs
        has an amplitude.
    """
    if (predicted.poles.real >= 0).any():
        return None
    struck = measurement.sets[index]
    if struck.excitation == SINE:
        shaken = sine_amplitudes(predicted, joint_nodes, dof(struck.response), struck.peak_force)
        return {name: replace(each, source=_of_sine(struck, each)) for name, each in shaken.items()}
    records = measurement.forces.get(struck.number, ())
    if records:
        blows = [
            blow
            for each in records
            for blow in BlowForce.from_records(each.point, each.force, each.sample_rate, predicted)
        ]
        return joint_amplitudes(predicted, joint_nodes, blows, f"from the force records of {len(blows)} blows")
    peaks = [BlowForce.from_peak(dof(point), struck.peak_force, BLOW_WIDTH, predicted) for point in struck.inputs]
    source = f"from the mean peak force of {struck.peak_force:.3g} N, as there are no force records of every point"
    found = joint_amplitudes(predicted, joint_nodes, peaks, source)
    return {name: replace(each, log_error=None) for name, each in found.items()}


def _of_sine(struck: FrequencyResponseSet, found: JointAmplitude) -> str:
    least, most = 1e6 * np.min(found.amplitude_pp), 1e6 * np.max(found.amplitude_pp)
    return (
        f"those of a sine of {struck.peak_force:.3g} N at {struck.response}, at each mode's own frequency: "
        f"{least:.2g} to {most:.2g} um peak to peak"
    )
