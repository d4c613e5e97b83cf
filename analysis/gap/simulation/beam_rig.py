"""The accelerometer's reading for a blow at each point of the beam.

The beam itself is not solved for: joints and accelerometer are attached to its free modes through their receptance, a
small system for each line.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BeamBench
from analysis.gap.measurement import Indices
from analysis.gap.simulation.free_beam_modes import BeamModes
from analysis.gap.simulation.modal_sum import ModalSum

JOINT_DIRECTIONS = (Direction.X, Direction.Y, Direction.ROTATION)


@dataclass(frozen=True, eq=False)
class BeamRig:
    """A hammer set's points on a beam.

    Attributes:
        modes: of the beam without joints.
        inputs: (rows,) the points struck.
        node_positions: (nodes,) m.
        sensor: direction of the accelerometer.
        sensor_mass: known, kg.
        joint_mass: (joints,) known, kg.
        state: (rows,) index of the state of the joints in which each row was measured.
    """

    modes: BeamModes
    inputs: tuple[Dof, ...]
    node_positions: Real
    sensor: Direction
    sensor_mass: float
    joint_mass: Real
    state: Indices

    @cached_property
    def rows_of(self) -> Indices:
        """(states, n) rows of each state; a state with fewer than n rows repeats its first one."""
        members = [np.flatnonzero(self.state == state) for state in range(int(np.max(self.state)) + 1)]
        most = max(each.size for each in members)
        return np.array([np.concatenate([each, np.repeat(each[:1], most - each.size)]) for each in members])

    @cached_property
    def place(self) -> Indices:
        """(rows,) index of each row in the flattened `rows_of`."""
        rank = np.array([np.count_nonzero(self.state[:row] == own) for row, own in enumerate(self.state)])
        return np.asarray(self.state * self.rows_of.shape[1] + rank)

    def response(self, bench: BeamBench, blows: Real) -> BeamResponse:
        """The response of `bench` to `blows` (2, rows): further off their points, m, and off the normal, rad."""
        offset, lean = blows
        return BeamResponse(self, bench, bench.blow_offset + offset, bench.lean + lean)


@dataclass(frozen=True, eq=False)
class BeamResponse:
    """The beam rig's response at one state of the bench.

    Attributes:
        rig: points, sensor and known masses.
        bench: state of the rig.
        blow_offset: (rows,) distance of the blows from their nodes, m: along the beam, on an end face above the axis.
        blow_lean: (rows,) lean of the blows, rad.
    """

    rig: BeamRig
    bench: BeamBench
    blow_offset: Real
    blow_lean: Real

    @cached_property
    def sensor_modes(self) -> tuple[Real, Real, Real]:
        """(N,) modes at the accelerometer, and their derivatives in its position and in its cross-axis share."""
        modes, way, share = self.rig.modes, self.rig.sensor, self.bench.cross_axis
        across = Direction.X if way is Direction.Y else Direction.Y
        motion, slope = self._of_sensor(modes.motion), self._of_sensor(modes.slope)
        return motion[way] + share * motion[across], slope[way] + share * slope[across], motion[across]

    def _of_sensor(self, modes: Callable[[Direction, float | Real], Real]) -> dict[Direction, Real]:
        """(N,) motion, or its slope, of the sensor's element along and across the beam; it may sit above the axis."""
        along, up, turn = (modes(way, self.bench.sensor_position) for way in JOINT_DIRECTIONS)
        return {Direction.X: along - self.bench.sensor_height * turn, Direction.Y: up}

    @cached_property
    def blow_modes(self) -> tuple[Real, Real, Real]:
        """(rows, N) modes at the blows, and their derivatives in the position and in the lean of each blow.

        A leaning blow that strikes above the axis turns the section as well, and so does a blow on an end face that is
        not on the axis.
        """
        rig, modes, half = self.rig, self.rig.modes, self.bench.strike_height
        transverse = np.array([dof.direction is Direction.Y for dof in rig.inputs])
        marks = rig.node_positions[[dof.node - 1 for dof in rig.inputs]]
        x = marks + np.where(transverse, self.blow_offset, 0.0)
        along, up, turn = (modes.motion(way, x) for way in JOINT_DIRECTIONS)
        lean, transverse = self.blow_lean[:, None], transverse[:, None]
        cosine, sine = np.cos(lean), np.sin(lean)
        straight = np.where(transverse, up, along - self.blow_offset[:, None] * turn)
        across = np.where(transverse, along - half * turn, up)
        slope = np.where(transverse, modes.slope(Direction.Y, x), -turn)
        return cosine * straight + sine * across, cosine * slope, cosine * across - sine * straight

    @cached_property
    def attached_modes(self) -> tuple[Real, Real]:
        """(attached, N) modes at joints (x, y, rotation; means over their reach), local change and accelerometer
        (x, y); and their slopes."""
        modes, local = self.rig.modes, self.bench.local

        def at_local(modes: Callable[[Direction, float | Real], Real]) -> list[Real]:
            if local is None:
                return []
            if not local.half_length:
                return [modes(local.direction, self.bench.local_position)]
            ends = self.bench.local_position + local.half_length * np.array([-1.0, 1.0])
            return [np.diff(modes(local.direction, ends), axis=0)[0]]

        def at_all(modes: Callable[[Direction, float | Real], Real]) -> Real:
            at_joints = np.stack([self._over_reach(partial(modes, way)) for way in JOINT_DIRECTIONS], axis=1)
            others = [*at_local(modes), *self._of_sensor(modes).values()]
            return np.concatenate([at_joints.reshape(-1, at_joints.shape[-1]), np.array(others)])

        return at_all(modes.motion), at_all(modes.slope)

    def _over_reach(self, modes: Callable[[Real], Real]) -> Real:
        """(joints, N) mean of the modes over the length of beam that each joint holds, by Simpson's rule."""
        place, half = self.bench.joint_position, self.bench.joint_reach / 2
        if not half.any():
            return modes(place)
        return np.asarray((modes(place - half) + 4 * modes(place) + modes(place + half)) / 6)

    @cached_property
    def attached_stiffness(self) -> Complex:
        """(states, lines, attached, attached) dynamic stiffness of all parts that are attached to the beam."""
        bench, rig = self.bench, self.rig
        states, _, joints = bench.joints.shape[:3]
        size = 3 * joints + (bench.local is not None) + 2
        found = np.zeros((states, bench.pole.size, size, size), dtype=complex)
        own = self._joint_stiffness
        found[:, :, : 3 * joints, : 3 * joints] = own @ self._beyond_base if bench.on_base else own
        for joint in range(joints):
            for way in range(2):
                found[:, :, 3 * joint + way, 3 * joint + way] += bench.pole**2 * rig.joint_mass[joint]
        if bench.local is not None:
            found[:, :, 3 * joints, 3 * joints] = bench.local_stiffness
        for way in (size - 2, size - 1):
            found[:, :, way, way] = bench.pole**2 * (rig.sensor_mass + bench.sensor_mass)
        found[:, :, -1, -1] += bench.pole * bench.sensor_damping
        return found

    @cached_property
    def _joint_stiffness(self) -> Complex:
        """(states, lines, 3 joints, 3 joints) dynamic stiffness of all joints, between the beam and what carries it."""
        states, _, joints = self.bench.joints.shape[:3]
        found = np.zeros((states, self.bench.pole.size, 3 * joints, 3 * joints), dtype=complex)
        for joint in range(joints):
            at = slice(3 * joint, 3 * joint + 3)
            found[:, :, at, at] = self.bench.joints[:, :, joint]
        return found

    @cached_property
    def base_motion(self) -> Complex:
        """(states, lines, 3 joints) motion of the base that carries the joints, per motion of the beam at each."""
        across = self._joint_stiffness[:, :, 1::3].sum(axis=2)
        return np.asarray(across / (across[:, :, 1::3].sum(axis=2) + self.bench.base)[..., None])

    @cached_property
    def _beyond_base(self) -> Complex:
        """(states, lines, 3 joints, 3 joints) deformation of the joints on their base, per motion of the beam."""
        found = np.broadcast_to(np.eye(self.base_motion.shape[-1]), self._joint_stiffness.shape).astype(complex)
        found[:, :, 1::3] -= self.base_motion[:, :, None]
        return found

    @cached_property
    def modal_parts(self) -> tuple[Real, Real, Real]:
        """(N,) modal mass, damping and stiffness of the free modes."""
        bench, modes = self.bench, self.rig.modes
        rate = bench.damping * modes.damping_rate + 2 * bench.ratio * modes.angular_frequency
        return modes.modal_parts(bench.modulus, bench.density, bench.mesh, rate)

    @cached_property
    def beam(self) -> ModalSum:
        """The beam without joints."""
        return ModalSum(self.modal_parts, self.rig.modes.angular_frequency, self.bench.pole, self.bench.loss)

    @cached_property
    def ends(self) -> Real:
        """(3 + rows, N) modes at the accelerometer, their two derivatives, and modes at the blows."""
        return np.concatenate([np.array(self.sensor_modes), self.blow_modes[0]])

    def by_state(self, values: Complex, shared: int) -> Complex:
        """(states, lines, x, shared + n) of (lines, x, shared + rows): columns for all, then of a state's rows."""
        columns = np.arange(shared), shared + self.rig.rows_of
        chosen = np.concatenate([np.tile(columns[0], (len(columns[1]), 1)), columns[1]], axis=1)
        return np.moveaxis(values[..., chosen], -2, 0)

    def by_row(self, values: Complex) -> Complex:
        """(..., rows, lines) of (..., states, lines, n)."""
        swapped = np.swapaxes(values, -1, -2)
        return np.asarray(swapped.reshape(*swapped.shape[:-3], -1, swapped.shape[-1])[..., self.rig.place, :])

    @cached_property
    def _free(self) -> Complex:
        """(lines, attached + 3, attached + 3 + rows) receptance of the beam without joints, between attached parts,
        sensor with its derivatives, and blows."""
        attached, _ = self.attached_modes
        every = np.concatenate([attached, self.ends])
        return self.beam.receptance(every[: len(attached) + 3], every)

    @cached_property
    def _system(self) -> Complex:
        """(states, lines, attached, attached) matrix of the linear system for the motion of the attached parts."""
        attached = self.attached_stiffness.shape[-1]
        return np.asarray(np.eye(attached) + self._free[:, :attached, :attached] @ self.attached_stiffness)

    @cached_property
    def motion(self) -> Complex:
        """(states, lines, attached, 3 + n) motion of attached parts under unit forces at sensor and a state's blows."""
        attached = self.attached_stiffness.shape[-1]
        return np.asarray(np.linalg.solve(self._system, self.by_state(self._free[:, :attached, attached:], 3)))

    @cached_property
    def deformation(self) -> Complex:
        """(states, lines, 3 joints, 3 + n) deformation of the joints under the forces of `motion`."""
        of_beam = self.motion[:, :, : 3 * self.bench.joints.shape[2]]
        return np.asarray(self._beyond_base @ of_beam) if self.bench.on_base else of_beam

    @cached_property
    def joint_motion(self) -> Complex:
        """(rows, lines, joints, 3) deformation of the joints under a unit force of each row's blows."""
        of_rows = self.by_row(np.moveaxis(self.deformation[..., 3:], 2, 0))  # (3 joints, rows, lines)
        return np.asarray(np.moveaxis(of_rows, 0, -1).reshape(*of_rows.shape[1:], -1, 3))

    @cached_property
    def joint_receptance(self) -> Complex:
        """(states, lines, 3 joints, 3 joints) deformation of the joints under unit forces between their two sides."""
        joints = 3 * self.bench.joints.shape[2]
        attached = self.attached_stiffness.shape[-1]
        found = np.linalg.solve(self._system, self._free[:, :attached, :joints])[:, :, :joints]
        if not self.bench.on_base:
            return np.asarray(found)
        compliance = 1 / (self._joint_stiffness[:, :, 1::3, 1::3].sum(axis=(2, 3)) + self.bench.base)
        found = self._beyond_base @ found @ np.swapaxes(self._beyond_base, 2, 3)
        found[:, :, 1::3, 1::3] += compliance[..., None, None]
        return np.asarray(found)

    @cached_property
    def force(self) -> Complex:
        """(states, lines, attached, 3 + n) forces of the attached parts on the beam, negative."""
        return self.attached_stiffness @ self.motion

    @cached_property
    def receptances(self) -> Complex:
        """(states, lines, 3, n) receptance at the accelerometer under the blows, and its two derivatives."""
        attached = self.attached_stiffness.shape[-1]
        free = self.by_state(self._free[:, attached:, attached + 3 :], 0)
        return free - self._free[:, attached:, :attached] @ self.force[..., 3:]

    @cached_property
    def receptance(self) -> Complex:
        """(rows, lines) receptance of the plane model, m/N."""
        return np.ascontiguousarray(self.by_row(self.receptances[:, :, 0]))

    @cached_property
    def accelerance(self) -> Complex:
        """(rows, lines) accelerance as the accelerometer reads it, (m/s^2)/N."""
        return self.to_read * (self.receptance + self.bench.added)

    @cached_property
    def to_read(self) -> Complex:
        """(lines,) factor from a receptance to what the accelerometer reads."""
        return self.bench.chain * self.bench.pole**2
