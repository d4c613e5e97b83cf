"""Derivatives of the accelerometer's reading in all quantities of the bench, exact where not said otherwise.

With y_q the beam's motion under a unit force at the accelerometer and y_r that under a blow, a change dD of dynamic
stiffness anywhere changes the receptance by -y_q^T dD y_r: cheap for any number of changes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.simulation.beam_rig import JOINT_DIRECTIONS, Answer

MODE_FIELDS = ("modulus", "density", "loss", "damping", "ratio", "mesh", "pole")
"""Fields of `BeamBench` that change the dynamic stiffness of the free modes."""
HEIGHT_STEP = 1e-4
"""m, step of the finite differences that give the derivative in the sensor's height."""
Changes = Mapping[str, Complex | Real]
"""Derivatives of the fields of `BeamBench` in one parameter, by name of the field."""


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of one answer of the beam rig.

    Attributes:
        answer: the response at one state of the bench.
    """

    answer: Answer

    def in_parameters(self, changes: Sequence[Changes]) -> Complex:
        """(n, rows, lines) derivatives of the accelerance in n parameters, from those of the bench's fields."""
        found = np.array([self._besides_joints(each) for each in changes]).reshape(-1, *self.answer.accelerance.shape)
        through = [place for place, each in enumerate(changes) if "joints" in each]
        if through:
            found[through] -= self._through_joints([changes[place]["joints"] for place in through])
        return found

    @cached_property
    def by_blow_offset(self) -> Complex:
        """(rows, lines) derivative of each row's accelerance in the position of its blow, (m/s^2)/N/m."""
        answer = self.answer
        return answer.to_read * self._at_blows(answer.beam.receptance(self._pulling, answer.blow_modes[1]))

    @cached_property
    def _pulled(self) -> Complex:
        """(states, lines, 1 + attached) unit force at the accelerometer, and the forces of attached parts under it."""
        answer = self.answer
        states, lines = answer.force.shape[:2]
        return np.concatenate([np.ones((states, lines, 1)), -answer.force[..., 0]], axis=2)

    @cached_property
    def _pulling(self) -> Real:
        """(1 + attached, N) modes where these forces act."""
        answer = self.answer
        return np.concatenate([answer.ends[:1], answer.attached_modes[0]])

    def _at_blows(self, fields: Complex) -> Complex:
        """(rows, lines) of (lines, 1 + attached, rows): the sum over the forces under a unit force at the sensor."""
        return np.asarray(np.einsum("rlk,lkr->rl", self._pulled_by_row, fields))

    @cached_property
    def _pulled_by_row(self) -> Complex:
        return np.asarray(self._pulled[self.answer.rig.state])

    @cached_property
    def _by_lean(self) -> Complex:
        answer = self.answer
        return answer.to_read * self._at_blows(answer.beam.receptance(self._pulling, answer.blow_modes[2]))

    @cached_property
    def _by_sensor_position(self) -> Complex:
        """(rows, lines) derivative in the sensor's position; its mass moves with it."""
        answer = self.answer
        carried = range(answer.attached_stiffness.shape[-1] - 2, answer.attached_stiffness.shape[-1])
        return answer.to_read * answer.by_row(answer.receptances[:, :, 1] + self._moved(carried))

    @cached_property
    def _by_sensor_height(self) -> Complex:
        """(rows, lines) derivative in the height of the sensor's element, by differences."""
        answer = self.answer
        higher, lower = (
            Answer(
                answer.rig,
                replace(answer.bench, sensor_height=answer.bench.sensor_height + step),
                answer.blow_offset,
            )
            for step in (HEIGHT_STEP, -HEIGHT_STEP)
        )
        return np.asarray((higher.accelerance - lower.accelerance) / (2 * HEIGHT_STEP))

    @cached_property
    def _slopes_under_forces(self) -> Complex:
        """(states, lines, attached, 1 + n) slope of the beam at the attached, under unit forces at sensor and blows."""
        return self._under_forces(self.answer.attached_modes[1])

    def _under_forces(self, modes: Real) -> Complex:
        """(states, lines, attached, 1 + n) motion in (attached, N) modes under unit forces at sensor and blows."""
        answer = self.answer
        attached, _ = answer.attached_modes
        free = answer.by_state(answer.beam.receptance(modes, answer.ends[[0, *range(3, len(answer.ends))]]), 1)
        at = [0, *range(3, answer.force.shape[-1])]
        return free - answer.beam.receptance(modes, attached) @ answer.force[..., at]

    def _moved(self, which: range) -> Complex:
        """(states, lines, n) derivative of the receptance when the parts attached at `which` move along the beam."""
        return self._changed(which, self._slopes_under_forces)

    def _changed(self, which: range, under_forces: Complex) -> Complex:
        """(states, lines, n) derivative of the receptance when the modes at `which` change.

        `under_forces` is the motion in the derivatives of the modes, as of `_under_forces`.
        """
        answer = self.answer
        at = list(which)
        of_sensor = np.einsum("sla,slan->sln", under_forces[:, :, at, 0], answer.force[:, :, at, 3:])
        of_blows = np.einsum("sla,slan->sln", answer.force[:, :, at, 0], under_forces[:, :, at, 1:])
        return np.asarray(-(of_sensor + of_blows))

    @cached_property
    def _by_joint_position(self) -> Complex:
        """(joints, rows, lines) derivatives in the position of each joint."""
        return self._at_each_joint(self._slopes_under_forces)

    @cached_property
    def _by_joint_reach(self) -> Complex:
        """(joints, rows, lines) derivatives in the reach of each joint."""
        answer = self.answer
        slope, half = answer.rig.modes.slope, answer.bench.joint_reach / 2
        ends = [answer.bench.joint_position + way * half for way in (1, -1)]
        wider = [(slope(way, ends[0]) - slope(way, ends[1])) / 12 for way in JOINT_DIRECTIONS]
        modes = np.zeros_like(answer.attached_modes[0])
        modes[: 3 * len(half)] = np.stack(wider, axis=1).reshape(3 * len(half), -1)
        return self._at_each_joint(self._under_forces(modes))

    def _at_each_joint(self, under_forces: Complex) -> Complex:
        """(joints, rows, lines) derivatives as read when the modes of one joint change, as of `_changed`."""
        answer = self.answer
        every = (self._changed(range(3 * j, 3 * j + 3), under_forces) for j in range(answer.bench.joints.shape[2]))
        return np.array([answer.to_read * answer.by_row(each) for each in every])

    def _along(self, weights: Real) -> Complex:
        """(n, rows, lines) sums over free modes, with (n, N) weights, of the motion under the sensor's force times that
        under each blow, as read; by reciprocity."""
        answer = self.answer
        attached, _ = answer.attached_modes
        blows = len(answer.ends) - 3
        every = answer.beam.slopes(self._pulling, np.concatenate([answer.ends[3:], attached]), weights)
        found = []
        for both in every:
            carried = (self._pulled[:, :, None] @ both[..., blows:])[:, :, 0]  # (states, lines, attached)
            through = carried[:, :, None] @ answer.force[..., 3:]
            found.append(self._at_blows(both[..., :blows]) - answer.by_row(through[:, :, 0]))
        return np.asarray(answer.to_read * np.array(found))

    @cached_property
    def _by_modes(self) -> dict[str, Complex]:
        """(rows, lines) derivative of minus the accelerance, for fields that change the free modes' stiffness."""
        answer = self.answer
        bench, modes = answer.bench, answer.rig.modes
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

    @property
    def _local(self) -> range:
        """Index of the local change among the attached parts; empty where there is none."""
        answer = self.answer
        first = 3 * answer.bench.joints.shape[2]
        return range(first, first + (answer.bench.local is not None))

    @cached_property
    def _through_local(self) -> Complex:
        """(states, lines, n) minus the derivative of the receptance in the stiffness of the local change."""
        answer = self.answer
        at = self._local[0]
        return np.asarray(answer.motion[:, :, at, :1] * answer.motion[:, :, at, 3:])

    def _through_joints(self, changes: Sequence[Complex | Real]) -> Complex:
        """(n, rows, lines) minus the derivatives of the accelerance, from those of the joints' stiffness."""
        answer = self.answer
        states, lines, joints = len(answer.motion), answer.bench.pole.size, answer.bench.joints.shape[2]
        sensor = answer.deformation[..., 0].reshape(states, lines, joints, 3, 1)
        blows = answer.deformation[..., 3:].reshape(states, lines, joints, 1, 3, -1)
        both = sensor[..., None] * blows  # (states, lines, joints, 3, 3, n)
        if all(each.shape[1] == 1 for each in changes):  # one stiffness at all lines: a product of small matrices
            both = np.moveaxis(both, 1, -2).reshape(states, 9 * joints, -1)
            flat = np.array([np.broadcast_to(each, (states, 1, joints, 3, 3)) for each in changes])
            found = np.moveaxis(flat.reshape(len(changes), states, -1), 0, 1) @ both
            return np.asarray(
                answer.to_read * answer.by_row(np.moveaxis(found, 0, 1).reshape(-1, states, lines, blows.shape[-1]))
            )
        both = both.reshape(states, lines, 9 * joints, -1)
        every = (np.broadcast_to(each, (states, lines, joints, 3, 3)).reshape(states, lines, -1) for each in changes)
        found = np.array([np.einsum("slk,slkn->sln", each, both) for each in every])
        return np.asarray(answer.to_read * answer.by_row(found))

    def _besides_joints(self, changes: Changes) -> Complex:
        """(rows, lines) derivative of the accelerance in one parameter, without the part through the joints."""
        answer, bench = self.answer, self.answer.bench
        total = np.zeros_like(answer.accelerance)
        if "sensor_mass" in changes:
            both = np.einsum("slp,slpn->sln", answer.motion[:, :, -2:, 0], answer.motion[:, :, -2:, 3:])
            total -= changes["sensor_mass"] * answer.to_read * bench.pole**2 * answer.by_row(both)
        if "sensor_damping" in changes:
            across = answer.motion[:, :, -1, :1] * answer.motion[:, :, -1, 3:]
            total -= changes["sensor_damping"] * answer.to_read * bench.pole * answer.by_row(across)
        for name in MODE_FIELDS:
            if name in changes:
                total -= changes[name] * self._by_modes[name]
        if "pole" in changes:
            total += changes["pole"] * (2 / bench.pole * answer.accelerance + self._by_pole)
        if "sensor_position" in changes:
            total += changes["sensor_position"] * self._by_sensor_position
        if "sensor_height" in changes:
            total += changes["sensor_height"] * self._by_sensor_height
        if "local_stiffness" in changes:
            total -= answer.to_read * answer.by_row(changes["local_stiffness"][:, None] * self._through_local)
        if "local_position" in changes:
            total += changes["local_position"] * answer.to_read * answer.by_row(self._moved(self._local))
        if "base" in changes:
            moved = np.einsum("slp,slpn->sln", answer.base_motion, answer.motion[:, :, : answer.base_motion.shape[-1]])
            total -= answer.to_read * answer.by_row(changes["base"][:, None] * moved[..., :1] * moved[..., 3:])
        if "cross_axis" in changes:
            total += changes["cross_axis"] * answer.to_read * answer.by_row(answer.receptances[:, :, 2])
        if "joint_position" in changes:
            total += np.tensordot(changes["joint_position"], self._by_joint_position, axes=1)
        if "joint_reach" in changes:
            total += np.tensordot(changes["joint_reach"], self._by_joint_reach, axes=1)
        if "blow_offset" in changes:
            total += changes["blow_offset"][:, None] * self.by_blow_offset
        if "lean" in changes:
            total += changes["lean"][:, None] * self._by_lean
        if "chain" in changes:
            total += changes["chain"] * bench.pole**2 * (answer.receptance + bench.added)
        if "added" in changes:
            total += answer.to_read * changes["added"]
        return total

    @cached_property
    def _by_pole(self) -> Complex:
        """(rows, lines) derivative in the pole through the known masses; joints and modes are treated elsewhere."""
        answer = self.answer
        joints = [mass for kilograms in answer.rig.joint_mass for mass in (kilograms, kilograms, 0.0)]
        mass = np.array(
            [*joints, *(0.0 for _ in self._local), *2 * [answer.rig.sensor_mass + answer.bench.sensor_mass]]
        )
        both = np.einsum("slp,p,slpn->sln", answer.motion[..., 0], mass, answer.motion[..., 3:])
        across = answer.bench.sensor_damping * answer.motion[:, :, -1, :1] * answer.motion[:, :, -1, 3:]
        return np.asarray(-answer.to_read * answer.by_row(2 * answer.bench.pole[:, None] * both + across))
