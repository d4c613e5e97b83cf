"""Joints against amplitude: every roving-hammer set by itself, at the amplitude that its blows caused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.blow_amplitude import BlowForce, joint_amplitudes_pp
from analysis.dof import Dof
from analysis.frequency_response import Real
from analysis.inverse.following_joints import modes_on
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.modes import Modes
from api.identification.inverse import HIGHEST_PREDICTED, Inverse, exponents_of
from api.identification.measurement import Measurement

BLOW_WIDTH = 4e-4  # s at half of the peak, of a hammer tip that reaches 1 kHz; its logarithm is what counts


@dataclass(frozen=True, eq=False)
class Level:
    """One set.

    Attributes:
        number: of the set.
        peak_force: mean of its blows, N.
        temperature_c: degrees Celsius.
        fit: joints by maximum likelihood, with their gates.
        amplitude_pp: by joint, peak-to-peak motion in m, the mean logarithm over the modes; empty where a mode does not
            decay on these joints.
    """

    number: int
    peak_force: float
    temperature_c: float
    fit: JointFit
    amplitude_pp: Mapping[str, float]


def levels_of(measurement: Measurement, inverse: Inverse) -> tuple[Level, ...]:
    """Joints by every set, the reference set's as they are in `inverse`; empty for one set alone.

    Raises:
        AnalysisError: a set does not suffice; the message says what is missing.
    """
    if len(measurement.sets) < 2:
        return ()
    highest = HIGHEST_PREDICTED * float(np.max(inverse.modal.modes.frequency))
    start = [found.joint for found in inverse.fit.joints.values()]
    found = []
    for index, measured in enumerate(measurement.sets):
        responses = measurement.responses(index)
        fit = inverse.fit
        if index > 0:
            fit = identify_from_responses(inverse.free_beam, responses, start, tolerances=inverse.tolerances)
        held_by = [joint.joint for joint in fit.joints.values()]
        predicted = modes_on(inverse.free_beam, held_by, exponents_of(fit), highest)
        nodes = {name: joint.node for name, joint in fit.joints.items()}
        amplitudes = blow_amplitudes_pp(predicted, nodes, responses.inputs, measured.peak_force) or {}
        found.append(
            Level(
                number=measured.number,
                peak_force=measured.peak_force,
                temperature_c=measured.temperature_c,
                fit=fit,
                amplitude_pp={name: float(np.exp(np.mean(np.log(each)))) for name, each in amplitudes.items()},
            )
        )
    return tuple(found)


def blow_amplitudes_pp(
    predicted: Modes, joint_nodes: Mapping[str, int], inputs: Sequence[Dof], peak_force: float
) -> dict[str, Real] | None:
    """(modes,) peak-to-peak amplitude in m at which each predicted mode sees each joint, by joint.

    None where a predicted mode does not decay: joints that feed energy fail their gate, and no ring-down of theirs has
    an amplitude.
    """
    if np.any(predicted.poles.real >= 0):
        return None
    blows = [BlowForce.from_peak(point, peak_force, BLOW_WIDTH, predicted) for point in inputs]
    return joint_amplitudes_pp(predicted, joint_nodes, blows)
