"""The accelerometer's reading for a blow at each point, and its derivatives in all quantities of the bench.

The beam itself is not solved for: joints and accelerometer are attached to its free modes through their receptance, a
small system for each line. With y_q the beam's motion under a unit force at the accelerometer and y_r that under a
blow, a change dD of dynamic stiffness anywhere changes the receptance by -y_q^T dD y_r: exact, and cheap for any number
of changes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BeamBench
from analysis.gap.measurement import Indices
from analysis.gap.simulation.free_beam_modes import BeamModes
from analysis.gap.simulation.modal_sum import ModalSum

JOINT_DIRECTIONS = (Direction.X, Direction.Y, Direction.ROTATION)
MODE_FIELDS = ("modulus", "density", "loss", "damping", "ratio", "mesh", "pole")
"""Fields of `BeamBench` that change the dynamic stiffness of the free modes."""
HEIGHT_STEP = 1e-4
"""m, step of the finite differences that give the derivative in the sensor's height."""
Changes = Mapping[str, Complex | Real]
"""Derivatives of the fields of `BeamBench` in one parameter, by name of the field."""


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

    def answer(self, bench: BeamBench, blow_offset: Real) -> Answer:
        """The response of `bench` to blows that fall a further `blow_offset` (rows,), m, beside their points."""
        return Answer(self, bench, bench.blow_offset + blow_offset)


@dataclass(frozen=True, eq=False)
class Answer:
    """The beam rig's response at one state of the bench.

    Attributes:
        rig: points, sensor and known masses.
        bench: state of the rig.
        blow_offset: (rows,) distance of the blows from their nodes, m.
    """

    rig: BeamRig
    bench: BeamBench
    blow_offset: Real

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

        A leaning blow that strikes above the axis turns the section as well.
        """
        rig, modes, half = self.rig, self.rig.modes, self.bench.strike_height
        transverse = np.array([dof.direction is Direction.Y for dof in rig.inputs])
        marks = rig.node_positions[[dof.node - 1 for dof in rig.inputs]]
        x = marks + np.where(transverse, self.blow_offset, 0.0)
        along, up, turn = (modes.motion(way, x) for way in JOINT_DIRECTIONS)
        lean, transverse = self.bench.lean[:, None], transverse[:, None]
        cosine, sine = np.cos(lean), np.sin(lean)
        straight = np.where(transverse, up, along)
        across = np.where(transverse, along - half * turn, up)
        slope = np.where(transverse, modes.slope(Direction.Y, x), 0.0)
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
    def _base_motion(self) -> Complex:
        """(states, lines, 3 joints) motion of the base that carries the joints, per motion of the beam at each."""
        across = self._joint_stiffness[:, :, 1::3].sum(axis=2)
        return np.asarray(across / (across[:, :, 1::3].sum(axis=2) + self.bench.base)[..., None])

    @cached_property
    def _beyond_base(self) -> Complex:
        """(states, lines, 3 joints, 3 joints) deformation of the joints on their base, per motion of the beam."""
        found = np.broadcast_to(np.eye(self._base_motion.shape[-1]), self._joint_stiffness.shape).astype(complex)
        found[:, :, 1::3] -= self._base_motion[:, :, None]
        return found

    @cached_property
    def modal_parts(self) -> tuple[Real, Real, Real]:
        """(N,) modal mass, damping and stiffness of the free modes."""
        bench, modes = self.bench, self.rig.modes
        rate = bench.damping * modes.damping_rate + 2 * bench.ratio * modes.angular_frequency
        return modes.modal_parts(bench.modulus, bench.density, bench.mesh, rate)

    @cached_property
    def _beam(self) -> ModalSum:
        """The beam without joints."""
        return ModalSum(self.modal_parts, self.rig.modes.angular_frequency, self.bench.pole, self.bench.loss)

    @cached_property
    def _ends(self) -> Real:
        """(3 + rows, N) modes at the accelerometer, their two derivatives, and modes at the blows."""
        return np.concatenate([np.array(self.sensor_modes), self.blow_modes[0]])

    def _by_state(self, values: Complex, shared: int) -> Complex:
        """(states, lines, x, shared + n) of (lines, x, shared + rows): columns for all, then of a state's rows."""
        columns = np.arange(shared), shared + self.rig.rows_of
        chosen = np.concatenate([np.tile(columns[0], (len(columns[1]), 1)), columns[1]], axis=1)
        return np.moveaxis(values[..., chosen], -2, 0)

    def _by_row(self, values: Complex) -> Complex:
        """(..., rows, lines) of (..., states, lines, n)."""
        swapped = np.swapaxes(values, -1, -2)
        return np.asarray(swapped.reshape(*swapped.shape[:-3], -1, swapped.shape[-1])[..., self.rig.place, :])

    @cached_property
    def _system(self) -> Complex:
        """(states, lines, attached, attached) matrix of the linear system for the motion of the attached parts."""
        attached, _ = self.attached_modes
        return np.asarray(np.eye(len(attached)) + self._beam.receptance(attached, attached) @ self.attached_stiffness)

    @cached_property
    def _motion(self) -> Complex:
        """(states, lines, attached, 3 + n) motion of attached parts under unit forces at sensor and a state's blows."""
        attached, _ = self.attached_modes
        return np.asarray(np.linalg.solve(self._system, self._by_state(self._beam.receptance(attached, self._ends), 3)))

    @cached_property
    def _deformation(self) -> Complex:
        """(states, lines, 3 joints, 3 + n) deformation of the joints under the forces of `_motion`."""
        of_beam = self._motion[:, :, : 3 * self.bench.joints.shape[2]]
        return np.asarray(self._beyond_base @ of_beam) if self.bench.on_base else of_beam

    @cached_property
    def joint_motion(self) -> Complex:
        """(rows, lines, joints, 3) deformation of the joints under a unit force of each row's blows."""
        of_rows = self._by_row(np.moveaxis(self._deformation[..., 3:], 2, 0))  # (3 joints, rows, lines)
        return np.asarray(np.moveaxis(of_rows, 0, -1).reshape(*of_rows.shape[1:], -1, 3))

    @cached_property
    def joint_receptance(self) -> Complex:
        """(states, lines, 3 joints, 3 joints) deformation of the joints under unit forces between their two sides."""
        joints = 3 * self.bench.joints.shape[2]
        attached, _ = self.attached_modes
        found = np.linalg.solve(self._system, self._beam.receptance(attached, attached[:joints]))[:, :, :joints]
        if not self.bench.on_base:
            return np.asarray(found)
        compliance = 1 / (self._joint_stiffness[:, :, 1::3, 1::3].sum(axis=(2, 3)) + self.bench.base)
        found = self._beyond_base @ found @ np.swapaxes(self._beyond_base, 2, 3)
        found[:, :, 1::3, 1::3] += compliance[..., None, None]
        return np.asarray(found)

    @cached_property
    def _force(self) -> Complex:
        """(states, lines, attached, 3 + n) forces of the attached parts on the beam, negative."""
        return self.attached_stiffness @ self._motion

    @cached_property
    def _receptances(self) -> Complex:
        """(states, lines, 3, n) receptance at the accelerometer under the blows, and its two derivatives."""
        attached, _ = self.attached_modes
        free = self._by_state(self._beam.receptance(self._ends[:3], self._ends[3:]), 0)
        at_ends = np.swapaxes(self._beam.receptance(attached, self._ends[:3]), 1, 2)
        return free - at_ends @ self._force[..., 3:]

    @cached_property
    def receptance(self) -> Complex:
        """(rows, lines) receptance of the plane model, m/N."""
        return np.ascontiguousarray(self._by_row(self._receptances[:, :, 0]))

    @cached_property
    def accelerance(self) -> Complex:
        """(rows, lines) accelerance as the accelerometer reads it, (m/s^2)/N."""
        return self._to_read * (self.receptance + self.bench.added)

    # --- derivatives ---

    @cached_property
    def _to_read(self) -> Complex:
        return self.bench.chain * self.bench.pole**2

    @cached_property
    def _pulled(self) -> Complex:
        """(states, lines, 1 + attached) unit force at the accelerometer, and the forces of attached parts under it."""
        states, lines = self._force.shape[:2]
        return np.concatenate([np.ones((states, lines, 1)), -self._force[..., 0]], axis=2)

    @cached_property
    def _pulling(self) -> Real:
        """(1 + attached, N) modes where these forces act."""
        return np.concatenate([self._ends[:1], self.attached_modes[0]])

    def _at_blows(self, fields: Complex) -> Complex:
        """(rows, lines) of (lines, 1 + attached, rows): the sum over the forces under a unit force at the sensor."""
        return np.asarray(np.einsum("rlk,lkr->rl", self._pulled_by_row, fields))

    @cached_property
    def _pulled_by_row(self) -> Complex:
        return np.asarray(self._pulled[self.rig.state])

    @cached_property
    def by_blow_offset(self) -> Complex:
        """(rows, lines) derivative of each row's accelerance in the position of its blow, (m/s^2)/N/m."""
        return self._to_read * self._at_blows(self._beam.receptance(self._pulling, self.blow_modes[1]))

    @cached_property
    def _by_lean(self) -> Complex:
        return self._to_read * self._at_blows(self._beam.receptance(self._pulling, self.blow_modes[2]))

    @cached_property
    def _by_sensor_position(self) -> Complex:
        """(rows, lines) derivative in the sensor's position; its mass moves with it."""
        carried = range(self.attached_stiffness.shape[-1] - 2, self.attached_stiffness.shape[-1])
        return self._to_read * self._by_row(self._receptances[:, :, 1] + self._moved(carried))

    @cached_property
    def _by_sensor_height(self) -> Complex:
        """(rows, lines) derivative in the height of the sensor's element, by differences."""
        higher, lower = (
            Answer(self.rig, replace(self.bench, sensor_height=self.bench.sensor_height + step), self.blow_offset)
            for step in (HEIGHT_STEP, -HEIGHT_STEP)
        )
        return np.asarray((higher.accelerance - lower.accelerance) / (2 * HEIGHT_STEP))

    @cached_property
    def _slopes_under_forces(self) -> Complex:
        """(states, lines, attached, 1 + n) slope of the beam at the attached, under unit forces at sensor and blows."""
        return self._under_forces(self.attached_modes[1])

    def _under_forces(self, modes: Real) -> Complex:
        """(states, lines, attached, 1 + n) motion in (attached, N) modes under unit forces at sensor and blows."""
        attached, _ = self.attached_modes
        free = self._by_state(self._beam.receptance(modes, self._ends[[0, *range(3, len(self._ends))]]), 1)
        at = [0, *range(3, self._force.shape[-1])]
        return free - self._beam.receptance(modes, attached) @ self._force[..., at]

    def _moved(self, which: range) -> Complex:
        """(states, lines, n) derivative of the receptance when the parts attached at `which` move along the beam."""
        return self._changed(which, self._slopes_under_forces)

    def _changed(self, which: range, under_forces: Complex) -> Complex:
        """(states, lines, n) derivative of the receptance when the modes at `which` change.

        `under_forces` is the motion in the derivatives of the modes, as of `_under_forces`.
        """
        at = list(which)
        of_sensor = np.einsum("sla,slan->sln", under_forces[:, :, at, 0], self._force[:, :, at, 3:])
        of_blows = np.einsum("sla,slan->sln", self._force[:, :, at, 0], under_forces[:, :, at, 1:])
        return np.asarray(-(of_sensor + of_blows))

    @cached_property
    def _by_joint_position(self) -> Complex:
        """(joints, rows, lines) derivatives in the position of each joint."""
        return self._at_each_joint(self._slopes_under_forces)

    @cached_property
    def _by_joint_reach(self) -> Complex:
        """(joints, rows, lines) derivatives in the reach of each joint."""
        slope, half = self.rig.modes.slope, self.bench.joint_reach / 2
        ends = [self.bench.joint_position + way * half for way in (1, -1)]
        wider = [(slope(way, ends[0]) - slope(way, ends[1])) / 12 for way in JOINT_DIRECTIONS]
        modes = np.zeros_like(self.attached_modes[0])
        modes[: 3 * len(half)] = np.stack(wider, axis=1).reshape(3 * len(half), -1)
        return self._at_each_joint(self._under_forces(modes))

    def _at_each_joint(self, under_forces: Complex) -> Complex:
        """(joints, rows, lines) derivatives as read when the modes of one joint change, as of `_changed`."""
        every = (self._changed(range(3 * j, 3 * j + 3), under_forces) for j in range(self.bench.joints.shape[2]))
        return np.array([self._to_read * self._by_row(each) for each in every])

    def _along(self, weights: Real) -> Complex:
        """(n, rows, lines) sums over free modes, with (n, N) weights, of the motion under the sensor's force times that
        under each blow, as read; by reciprocity."""
        attached, _ = self.attached_modes
        blows = len(self._ends) - 3
        every = self._beam.slopes(self._pulling, np.concatenate([self._ends[3:], attached]), weights)
        found = []
        for both in every:
            carried = (self._pulled[:, :, None] @ both[..., blows:])[:, :, 0]  # (states, lines, attached)
            through = carried[:, :, None] @ self._force[..., 3:]
            found.append(self._at_blows(both[..., :blows]) - self._by_row(through[:, :, 0]))
        return np.asarray(self._to_read * np.array(found))

    @cached_property
    def _by_modes(self) -> dict[str, Complex]:
        """(rows, lines) derivative of minus the accelerance, for fields that change the free modes' stiffness."""
        bench, modes = self.bench, self.rig.modes
        elastic, viscous = bench.modulus * (1 + 1j * bench.loss), np.sqrt(bench.modulus * bench.density)
        free, rates = modes.free.squared_frequency, (modes.damping_rate, modes.angular_frequency)
        weights = np.array([np.ones_like(free), free, modes.mesh_share * free, *rates])
        mass, unmeshed, meshed, drawn, half = self._along(weights)
        stiffness, alike = unmeshed + bench.mesh * meshed, 2 * half
        rate = bench.damping * drawn + bench.ratio * alike
        return {
            "modulus": elastic / bench.modulus * stiffness + viscous / (2 * bench.modulus) * bench.pole * rate,
            "density": bench.pole**2 * mass + viscous / (2 * bench.density) * bench.pole * rate,
            "loss": 1j * bench.modulus * stiffness,
            "damping": viscous * bench.pole * drawn,
            "ratio": viscous * bench.pole * alike,
            "mesh": elastic * meshed,
            "pole": 2 * bench.density * bench.pole * mass + viscous * rate,
        }

    def derivatives(self, changes: Sequence[Changes]) -> Complex:
        """(n, rows, lines) derivatives of the accelerance in n parameters, from those of the bench's fields."""
        found = np.array([self._besides_joints(each) for each in changes]).reshape(-1, *self.accelerance.shape)
        through = [place for place, each in enumerate(changes) if "joints" in each]
        if through:
            found[through] -= self._through_joints([changes[place]["joints"] for place in through])
        return found

    @property
    def _local(self) -> range:
        """Index of the local change among the attached parts; empty where there is none."""
        first = 3 * self.bench.joints.shape[2]
        return range(first, first + (self.bench.local is not None))

    @cached_property
    def _through_local(self) -> Complex:
        """(states, lines, n) minus the derivative of the receptance in the stiffness of the local change."""
        at = self._local[0]
        return np.asarray(self._motion[:, :, at, :1] * self._motion[:, :, at, 3:])

    def _through_joints(self, changes: Sequence[Complex | Real]) -> Complex:
        """(n, rows, lines) minus the derivatives of the accelerance, from those of the joints' stiffness."""
        states, lines, joints = len(self._motion), self.bench.pole.size, self.bench.joints.shape[2]
        sensor = self._deformation[..., 0].reshape(states, lines, joints, 3, 1)
        blows = self._deformation[..., 3:].reshape(states, lines, joints, 1, 3, -1)
        both = sensor[..., None] * blows  # (states, lines, joints, 3, 3, n)
        if all(each.shape[1] == 1 for each in changes):  # one stiffness at all lines: a product of small matrices
            both = np.moveaxis(both, 1, -2).reshape(states, 9 * joints, -1)
            flat = np.array([np.broadcast_to(each, (states, 1, joints, 3, 3)) for each in changes])
            found = np.moveaxis(flat.reshape(len(changes), states, -1), 0, 1) @ both
            return np.asarray(
                self._to_read * self._by_row(np.moveaxis(found, 0, 1).reshape(-1, states, lines, blows.shape[-1]))
            )
        both = both.reshape(states, lines, 9 * joints, -1)
        every = (np.broadcast_to(each, (states, lines, joints, 3, 3)).reshape(states, lines, -1) for each in changes)
        found = np.array([np.einsum("slk,slkn->sln", each, both) for each in every])
        return np.asarray(self._to_read * self._by_row(found))

    def _besides_joints(self, changes: Changes) -> Complex:
        """(rows, lines) derivative of the accelerance in one parameter, without the part through the joints."""
        bench = self.bench
        total = np.zeros_like(self.accelerance)
        if "sensor_mass" in changes:
            both = np.einsum("slp,slpn->sln", self._motion[:, :, -2:, 0], self._motion[:, :, -2:, 3:])
            total -= changes["sensor_mass"] * self._to_read * bench.pole**2 * self._by_row(both)
        if "sensor_damping" in changes:
            across = self._motion[:, :, -1, :1] * self._motion[:, :, -1, 3:]
            total -= changes["sensor_damping"] * self._to_read * bench.pole * self._by_row(across)
        for name in MODE_FIELDS:
            if name in changes:
                total -= changes[name] * self._by_modes[name]
        if "pole" in changes:
            total += changes["pole"] * (2 / bench.pole * self.accelerance + self._by_pole)
        if "sensor_position" in changes:
            total += changes["sensor_position"] * self._by_sensor_position
        if "sensor_height" in changes:
            total += changes["sensor_height"] * self._by_sensor_height
        if "local_stiffness" in changes:
            total -= self._to_read * self._by_row(changes["local_stiffness"][:, None] * self._through_local)
        if "local_position" in changes:
            total += changes["local_position"] * self._to_read * self._by_row(self._moved(self._local))
        if "base" in changes:
            moved = np.einsum("slp,slpn->sln", self._base_motion, self._motion[:, :, : self._base_motion.shape[-1]])
            total -= self._to_read * self._by_row(changes["base"][:, None] * moved[..., :1] * moved[..., 3:])
        if "cross_axis" in changes:
            total += changes["cross_axis"] * self._to_read * self._by_row(self._receptances[:, :, 2])
        if "joint_position" in changes:
            total += np.tensordot(changes["joint_position"], self._by_joint_position, axes=1)
        if "joint_reach" in changes:
            total += np.tensordot(changes["joint_reach"], self._by_joint_reach, axes=1)
        if "blow_offset" in changes:
            total += changes["blow_offset"][:, None] * self.by_blow_offset
        if "lean" in changes:
            total += changes["lean"][:, None] * self._by_lean
        if "chain" in changes:
            total += changes["chain"] * bench.pole**2 * (self.receptance + bench.added)
        if "added" in changes:
            total += self._to_read * changes["added"]
        return total

    @cached_property
    def _by_pole(self) -> Complex:
        """(rows, lines) derivative in the pole through the known masses; joints and modes are treated elsewhere."""
        joints = [mass for kilograms in self.rig.joint_mass for mass in (kilograms, kilograms, 0.0)]
        mass = np.array([*joints, *(0.0 for _ in self._local), *2 * [self.rig.sensor_mass + self.bench.sensor_mass]])
        both = np.einsum("slp,p,slpn->sln", self._motion[..., 0], mass, self._motion[..., 3:])
        across = self.bench.sensor_damping * self._motion[:, :, -1, :1] * self._motion[:, :, -1, 3:]
        return np.asarray(-self._to_read * self._by_row(2 * self.bench.pole[:, None] * both + across))
