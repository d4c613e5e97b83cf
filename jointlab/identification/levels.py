"""Joints against amplitude: every set by itself, at the amplitude that its blows or its sine caused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from analysis.inverse.frequency_dependent_joints import modes_on
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.joint_amplitude import JointAmplitude
from jointlab.identification.inverse import HIGHEST_PREDICTED, Inverse, exponents_of
from jointlab.identification.joint_amplitudes import amplitudes_of_set
from jointlab.identification.measurement import Measurement
from store.excitation import Excitation


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
        amplitudes = amplitudes_of_set(measurement, index, predicted, nodes) or {}
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
    return tuple(found)
