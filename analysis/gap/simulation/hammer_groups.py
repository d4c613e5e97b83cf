"""Hammer sets that share one bench, so that it is computed once for all their rows."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from analysis.gap.bench import Setting
from analysis.gap.measurement import Indices, Measurement
from analysis.gap.simulation.beam_rig import BeamRig
from analysis.gap.simulation.blow_motion import MOTION_DECAY, MOTION_LINES
from analysis.gap.simulation.free_beam_modes import BeamModes


@dataclass(frozen=True, eq=False)
class Group:
    """Hammer sets that share one bench, treated as one set with all their rows.

    Attributes:
        rig: with the rows of all of them.
        setting: of all of them.
        numbers: indices of the sets.
        rows: of each set among those of the rig.
        set_of_state: (states,) index of the set in which each state of the joints was measured.
        measured: (rows,) whether each row was measured, and is not only asked for.
        of_sets: the rig with one state of the joints for each set.
        in_motion: the setting in which the motion of the joints is computed, with one state for each set.
    """

    rig: BeamRig
    setting: Setting
    numbers: tuple[int, ...]
    rows: tuple[slice, ...]
    set_of_state: Indices
    measured: NDArray[np.bool_]
    of_sets: BeamRig
    in_motion: Setting


def groups_of(measurement: Measurement, modes: BeamModes, by_row: bool) -> tuple[Group, ...]:
    """The groups of a measurement: sets of one group have the same lines and window.

    Args:
        measurement: with the sets.
        modes: of the drawing.
        by_row: whether joints differ from row to row; else from set to set.
    """
    found = dict[tuple[object, ...], list[int]]()
    for number, each in enumerate(measurement.sets):
        found.setdefault((each.frequency.tobytes(), each.decay), []).append(number)
    return tuple(_group(measurement, modes, numbers, by_row) for numbers in found.values())


def _group(measurement: Measurement, modes: BeamModes, numbers: list[int], by_row: bool) -> Group:
    drawing, sets = measurement.drawing, [measurement.sets[number] for number in numbers]
    inputs = tuple(dof for each in sets for dof in each.inputs)
    ends = np.cumsum([0, *(len(each.inputs) for each in sets)]).tolist()
    set_of_row = np.repeat(np.arange(len(sets)), np.diff(ends))
    state = np.arange(len(inputs)) if by_row else set_of_row
    set_of_state = set_of_row if by_row else np.arange(len(sets))
    rig = BeamRig(
        modes=modes,
        inputs=inputs,
        node_positions=drawing.node_positions,
        sensor=drawing.accelerometer.direction,
        sensor_mass=drawing.accelerometer_mass,
        joint_mass=np.array([joint.added_mass for joint in drawing.joints]),
        state=state,
    )
    first, force = sets[0], np.array([each.peak_force for each in sets])
    number_of_row = np.array(numbers)[set_of_row]
    return Group(
        rig=rig,
        setting=Setting(inputs, first.frequency, force[set_of_state], state, number_of_row, first.decay),
        numbers=tuple(numbers),
        rows=tuple(slice(*pair) for pair in pairwise(ends)),
        set_of_state=np.array(numbers)[set_of_state],
        measured=np.concatenate([np.arange(len(each.inputs)) < len(each.inputs) - each.asked for each in sets]),
        of_sets=replace(rig, state=set_of_row),
        in_motion=Setting(inputs, MOTION_LINES, force, set_of_row, number_of_row, MOTION_DECAY),
    )
