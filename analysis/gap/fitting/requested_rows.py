"""Predictions of a model at rows that are asked for, measured or not, and the matrices that make up accelerances."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.measurement import Indices
from analysis.gap.simulation.beam_rig import JOINT_DIRECTIONS, BeamResponse


def at_rows(likelihood: Likelihood, scores: Real, inputs: tuple[Dof, ...], frequency: Real) -> tuple[Likelihood, Real]:
    """The likelihood for one set, the reference set with further `inputs`, and its (unknowns,) scores.

    Args:
        likelihood: of the model.
        scores: (unknowns,) of the model.
        inputs: further points struck; they become the last rows.
        frequency: (lines,) Hz.
    """
    simulation, measurement = likelihood.simulation, likelihood.measurement
    struck = (*measurement.sets[0].inputs, *inputs)  # amplitudes depend on all blows that were measured in a set
    asked = replace(measurement.sets[0].struck_at(struck, frequency), asked=len(inputs))
    whole = Likelihood(simulation.of(replace(measurement, sets=(asked,))))
    known, found = [*range(len(simulation.shared)), *likelihood.setups[0]], np.zeros(whole.unknowns)
    found[: len(known)] = scores[known]
    for point in likelihood.points:
        found[whole.amplitudes_of_point(point)] = scores[likelihood.amplitudes_of_point(point)]
    return whole, found


@dataclass(frozen=True, eq=False)
class Matrices:
    """The matrices that make up accelerances: modes of the free beam, attached parts, blows and the sensor.

    With s the pole, V the modes at the attached parts, v at the sensor and w at a blow, g = 1 / (mass s^2 +
    damping s + stiffness (1 + i loss)) and D the dynamic stiffness of the attached parts, the accelerance is
    s^2 reading (v g w - v g V^T D (1 + V g V^T D)^-1 V g w + added).

    Attributes:
        inputs: (rows,) points struck.
        response: node and direction of the accelerometer.
        frequency, pole: (lines,) Hz, and s in 1/s.
        mass, damping, stiffness: (N,) modal, 1, 1/s and 1/s^2; the modes have the unit kg^-1/2.
        loss: (lines,) structural loss factor of the beam.
        attached: (n,) name, such as "joint I, y", and place in m of each attached part.
        attached_modes: (n, N) modes there; for a joint that holds a length of the beam, the mean over the length.
        attached_stiffness: (states, lines, n, n) dynamic stiffness of the attached parts; N/m, N or N m.
        sensor_modes: (N,) modes at the sensor.
        reading: (rows, lines) factor of gain and measuring chain.
        blow_modes: (rows, N) modes at the blows.
        state: (rows,) index of the state of the joints.
        added: (rows, lines) receptance that the plane beam does not have, m/N.
        accelerance: (rows, lines) the result, (m/s^2)/N.
    """

    inputs: tuple[Dof, ...]
    response: Dof
    frequency: Real
    pole: Complex
    mass: Real
    damping: Real
    stiffness: Real
    loss: Real
    attached: tuple[tuple[str, float], ...]
    attached_modes: Real
    attached_stiffness: Complex
    sensor_modes: Real
    reading: Complex
    blow_modes: Real
    state: Indices
    added: Complex
    accelerance: Complex


def matrices_at(likelihood: Likelihood, scores: Real, inputs: tuple[Dof, ...], frequency: Real) -> Matrices:
    """The matrices of a model at rows that are asked for, each row once; arguments as of `at_rows`."""
    whole, found = at_rows(likelihood, scores, inputs, frequency)
    state = whole.state(found)
    simulated, gain = state.groups[0].response, 1 + float(state.gains[0])
    bench, first = simulated.bench, len(simulated.rig.inputs) - len(inputs)
    rows = [first + inputs.index(dof) for dof in dict.fromkeys(inputs)]
    shape = len(simulated.rig.inputs), frequency.size
    states, own = np.unique(simulated.rig.state[rows], return_inverse=True)
    mass, damping, stiffness = simulated.modal_parts
    return Matrices(
        inputs=tuple(simulated.rig.inputs[row] for row in rows),
        response=whole.measurement.drawing.accelerometer,
        frequency=frequency,
        pole=bench.pole,
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        loss=np.broadcast_to(bench.loss, frequency.shape),
        attached=_attached(simulated, [joint.name for joint in whole.measurement.drawing.joints]),
        attached_modes=simulated.attached_modes[0],
        attached_stiffness=simulated.attached_stiffness[states],
        sensor_modes=simulated.sensor_modes[0],
        reading=gain * np.broadcast_to(bench.chain, shape)[rows],
        blow_modes=simulated.blow_modes[0][rows],
        state=own,
        added=np.broadcast_to(bench.added, shape)[rows],
        accelerance=gain * simulated.accelerance[rows],
    )


def _attached(simulated: BeamResponse, joints: list[str]) -> tuple[tuple[str, float], ...]:
    bench, places = simulated.bench, simulated.bench.joint_position.tolist()
    found = [(f"joint {name}, {way}", x) for name, x in zip(joints, places, strict=True) for way in JOINT_DIRECTIONS]
    if bench.local is not None:
        found.append((f"local change, {bench.local.direction}", bench.local_position))
    sensor = float(bench.sensor_position)
    return (*found, *((f"accelerometer, {way}", sensor) for way in (Direction.X, Direction.Y)))
