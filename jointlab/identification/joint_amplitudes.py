"""At which amplitude a set worked the joints: by the force records of its blows, or their peak, or that of its sine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from analysis.joint_amplitude import BlowForce, JointAmplitude, joint_amplitudes, sine_amplitudes
from analysis.modes import Modes
from jointlab.identification.measurement import Measurement, dof
from store.excitation import SINE
from store.frequency_responses import FrequencyResponseSet

BLOW_WIDTH = 4e-4  # s at half of the peak, of a hammer tip that reaches 1 kHz; its logarithm is what counts


def amplitudes_of_set(
    measurement: Measurement, index: int, predicted: Modes, joint_nodes: Mapping[str, int]
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
