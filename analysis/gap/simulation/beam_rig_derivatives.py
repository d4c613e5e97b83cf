"""Derivatives of the accelerometer's reading in all quantities of the bench, exact where not said otherwise.

With y_q the beam's motion under a unit force at the accelerometer and y_r that under a blow, a change dD of dynamic
stiffness anywhere changes the receptance by -y_q^T dD y_r: cheap for any number of changes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.simulation.beam_rig import JOINT_DIRECTIONS, BeamResponse

MODE_FIELDS = ("modulus", "density", "loss", "damping", "ratio", "mesh", "pole")
"""Fields of `BeamBench` that change the dynamic stiffness of the free modes."""
HEIGHT_STEP = 1e-4
"""m, step of the finite differences that give the derivative in the sensor's height."""
Changes = Mapping[str, Complex | Real]
"""Derivatives of the fields of `BeamBench` in one parameter, by name of the field."""


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of one response of the beam rig.

    Attributes:
        response: the response at one state of the bench.
    """

    response: BeamResponse

    def in_parameters(self, changes: Sequence[Changes]) -> Complex:
        """(n, rows, lines) derivatives of the accelerance in n parameters, from those of the bench's fields."""
        found = np.array([self._besides_joints(each) for each in changes]).reshape(-1, *self.response.accelerance.shape)
        through = [place for place, each in enumerate(changes) if "joints" in each]
        if through:
            found[through] -= self._through_joints([changes[place]["joints"] for place in through])
        return found

    @cached_property
    def by_blow_offset(self) -> Complex:
        """(rows, lines) derivative of each row's accelerance in the position of its blow, (m/s^2)/N/m."""
        return self._by_blow[0]

    @cached_property
    def by_lean(self) -> Complex:
        """(rows, lines) derivative of each row's accelerance in the lean of its blow, (m/s^2)/N/rad."""
        return self._by_blow[1]

    @cached_property
    def _by_blow(self) -> tuple[Complex, Complex]:
        """(rows, lines) derivatives in the position and in the lean of each blow."""
        response = self.response
        _, by_offset, by_lean = response.blow_modes
        both = response.beam.receptance(self._pulling, np.concatenate([by_offset, by_lean]))
        rows = len(by_offset)
        return response.to_read * self._at_blows(both[..., :rows]), response.to_read * self._at_blows(both[..., rows:])

    @cached_property
    def _pulled(self) -> Complex:
        """(states, lines, 1 + attached) unit force at the accelerometer, and the forces of attached parts under it."""
        response = self.response
        states, lines = response.force.shape[:2]
        return np.concatenate([np.ones((states, lines, 1)), -response.force[..., 0]], axis=2)

    @cached_property
    def _pulling(self) -> Real:
        """(1 + attached, N) modes where these forces act."""
        response = self.response
        return np.concatenate([response.ends[:1], response.attached_modes[0]])

    def _at_blows(self, fields: Complex) -> Complex:
        """(rows, lines) of (lines, 1 + attached, rows): the sum over the forces under a unit force at the sensor."""
        return np.asarray(np.einsum("rlk,lkr->rl", self._pulled_by_row, fields))

    @cached_property
    def _pulled_by_row(self) -> Complex:
        return np.asarray(self._pulled[self.response.rig.state])

    @cached_property
    def _by_sensor_position(self) -> Complex:
        """(rows, lines) derivative in the sensor's position; its mass moves with it."""
        response = self.response
        carried = range(response.attached_stiffness.shape[-1] - 2, response.attached_stiffness.shape[-1])
        return response.to_read * response.by_row(response.receptances[:, :, 1] + self._moved(carried))

    @cached_property
    def _by_sensor_height(self) -> Complex:
        """(rows, lines) derivative in the height of the sensor's element, by differences."""
        response = self.response
        higher, lower = (
            BeamResponse(
                response.rig,
                replace(response.bench, sensor_height=response.bench.sensor_height + step),
                response.blow_offset,
                response.blow_lean,
            )
            for step in (HEIGHT_STEP, -HEIGHT_STEP)
        )
        return np.asarray((higher.accelerance - lower.accelerance) / (2 * HEIGHT_STEP))

    @cached_property
    def _slopes_under_forces(self) -> Complex:
        """(states, lines, attached, 1 + n) slope of the beam at the attached, under unit forces at sensor and blows."""
        return self._under_forces(self.response.attached_modes[1])

    def _under_forces(self, modes: Real) -> Complex:
        """(states, lines, attached, 1 + n) motion in (attached, N) modes under unit forces at sensor and blows."""
        response = self.response
        attached, _ = response.attached_modes
        ends = response.ends[[0, *range(3, len(response.ends))]]
        every = response.beam.receptance(modes, np.concatenate([attached, ends]))
        at = [0, *range(3, response.force.shape[-1])]
        free = response.by_state(every[..., len(attached) :], 1)
        return free - every[..., : len(attached)] @ response.force[..., at]

    def _moved(self, which: range) -> Complex:
        """(states, lines, n) derivative of the receptance when the parts attached at `which` move along the beam."""
        return self._changed(which, self._slopes_under_forces)

    def _changed(self, which: range, under_forces: Complex) -> Complex:
        """(states, lines, n) derivative of the receptance when the modes at `which` change.

        `under_forces` is the motion in the derivatives of the modes, as of `_under_forces`.
        """
        response = self.response
        at = list(which)
        of_sensor = np.einsum("sla,slan->sln", under_forces[:, :, at, 0], response.force[:, :, at, 3:])
        of_blows = np.einsum("sla,slan->sln", response.force[:, :, at, 0], under_forces[:, :, at, 1:])
        return np.asarray(-(of_sensor + of_blows))

    @cached_property
    def _by_joint_position(self) -> Complex:
        """(joints, rows, lines) derivatives in the position of each joint."""
        return self._at_each_joint(self._slopes_under_forces)

    @cached_property
    def _by_joint_reach(self) -> Complex:
        """(joints, rows, lines) derivatives in the reach of each joint."""
        response = self.response
        slope, half = response.rig.modes.slope, response.bench.joint_reach / 2
        ends = [response.bench.joint_position + way * half for way in (1, -1)]
        wider = [(slope(way, ends[0]) - slope(way, ends[1])) / 12 for way in JOINT_DIRECTIONS]
        modes = np.zeros_like(response.attached_modes[0])
        modes[: 3 * len(half)] = np.stack(wider, axis=1).reshape(3 * len(half), -1)
        return self._at_each_joint(self._under_forces(modes))

    def _at_each_joint(self, under_forces: Complex) -> Complex:
        """(joints, rows, lines) derivatives as read when the modes of one joint change, as of `_changed`."""
        response = self.response
        every = (self._changed(range(3 * j, 3 * j + 3), under_forces) for j in range(response.bench.joints.shape[2]))
        return np.array([response.to_read * response.by_row(each) for each in every])

    def _along(self, weights: Real) -> Complex:
        """(n, rows, lines) sums over free modes, with (n, N) weights, of the motion under the sensor's force times that
        under each blow, as read; by reciprocity."""
        response = self.response
        attached, _ = response.attached_modes
        blows = len(response.ends) - 3
        every = response.beam.slopes(self._pulling, np.concatenate([response.ends[3:], attached]), weights)
        found = []
        for both in every:
            carried = (self._pulled[:, :, None] @ both[..., blows:])[:, :, 0]  # (states, lines, attached)
            through = carried[:, :, None] @ response.force[..., 3:]
            found.append(self._at_blows(both[..., :blows]) - response.by_row(through[:, :, 0]))
        return np.asarray(response.to_read * np.array(found))

    @cached_property
    def _by_modes(self) -> dict[str, Complex]:
        """(rows, lines) derivative of minus the accelerance, for fields that change the free modes' stiffness."""
        response = self.response
        bench, modes = response.bench, response.rig.modes
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
        response = self.response
        first = 3 * response.bench.joints.shape[2]
        return range(first, first + (response.bench.local is not None))

    @cached_property
    def _through_local(self) -> Complex:
        """(states, lines, n) minus the derivative of the receptance in the stiffness of the local change."""
        response = self.response
        at = self._local[0]
        return np.asarray(response.motion[:, :, at, :1] * response.motion[:, :, at, 3:])

    def _through_joints(self, changes: Sequence[Complex | Real]) -> Complex:
        """(n, rows, lines) minus the derivatives of the accelerance, from those of the joints' stiffness."""
        response = self.response
        states, lines, joints = len(response.motion), response.bench.pole.size, response.bench.joints.shape[2]
        sensor = response.deformation[..., 0].reshape(states, lines, joints, 3, 1)
        blows = response.deformation[..., 3:].reshape(states, lines, joints, 1, 3, -1)
        both = sensor[..., None] * blows  # (states, lines, joints, 3, 3, n)
        if all(each.shape[1] == 1 for each in changes):  # one stiffness at all lines: a product of small matrices
            both = np.moveaxis(both, 1, -2).reshape(states, 9 * joints, -1)
            flat = np.array([np.broadcast_to(each, (states, 1, joints, 3, 3)) for each in changes])
            found = np.moveaxis(flat.reshape(len(changes), states, -1), 0, 1) @ both
            return np.asarray(
                response.to_read * response.by_row(np.moveaxis(found, 0, 1).reshape(-1, states, lines, blows.shape[-1]))
            )
        both = both.reshape(states, lines, 9 * joints, -1)
        every = (np.broadcast_to(each, (states, lines, joints, 3, 3)).reshape(states, lines, -1) for each in changes)
        found = np.array([np.einsum("slk,slkn->sln", each, both) for each in every])
        return np.asarray(response.to_read * response.by_row(found))

    def _besides_joints(self, changes: Changes) -> Complex:
        """(rows, lines) derivative of the accelerance in one parameter, without the part through the joints."""
        response, bench = self.response, self.response.bench
        total = np.zeros_like(response.accelerance)
        if "sensor_mass" in changes:
            both = np.einsum("slp,slpn->sln", response.motion[:, :, -2:, 0], response.motion[:, :, -2:, 3:])
            total -= changes["sensor_mass"] * response.to_read * bench.pole**2 * response.by_row(both)
        if "sensor_damping" in changes:
            across = response.motion[:, :, -1, :1] * response.motion[:, :, -1, 3:]
            total -= changes["sensor_damping"] * response.to_read * bench.pole * response.by_row(across)
        for name in MODE_FIELDS:
            if name in changes:
                total -= changes[name] * self._by_modes[name]
        if "pole" in changes:
            total += changes["pole"] * (2 / bench.pole * response.accelerance + self._by_pole)
        if "sensor_position" in changes:
            total += changes["sensor_position"] * self._by_sensor_position
        if "sensor_height" in changes:
            total += changes["sensor_height"] * self._by_sensor_height
        if "local_stiffness" in changes:
            total -= response.to_read * response.by_row(changes["local_stiffness"][:, None] * self._through_local)
        if "local_position" in changes:
            total += changes["local_position"] * response.to_read * response.by_row(self._moved(self._local))
        if "base" in changes:
            moved = np.einsum(
                "slp,slpn->sln", response.base_motion, response.motion[:, :, : response.base_motion.shape[-1]]
            )
            total -= response.to_read * response.by_row(changes["base"][:, None] * moved[..., :1] * moved[..., 3:])
        if "cross_axis" in changes:
            total += changes["cross_axis"] * response.to_read * response.by_row(response.receptances[:, :, 2])
        if "joint_position" in changes:
            total += np.tensordot(changes["joint_position"], self._by_joint_position, axes=1)
        if "joint_reach" in changes:
            total += np.tensordot(changes["joint_reach"], self._by_joint_reach, axes=1)
        if "blow_offset" in changes:
            total += changes["blow_offset"][:, None] * self.by_blow_offset
        if "lean" in changes:
            total += changes["lean"][:, None] * self.by_lean
        if "chain" in changes:
            total += changes["chain"] * bench.pole**2 * (response.receptance + bench.added)
        if "added" in changes:
            total += response.to_read * changes["added"]
        return total

    @cached_property
    def _by_pole(self) -> Complex:
        """(rows, lines) derivative in the pole through the known masses; joints and modes are treated elsewhere."""
        response = self.response
        joints = [mass for kilograms in response.rig.joint_mass for mass in (kilograms, kilograms, 0.0)]
        mass = np.array(
            [*joints, *(0.0 for _ in self._local), *2 * [response.rig.sensor_mass + response.bench.sensor_mass]]
        )
        both = np.einsum("slp,p,slpn->sln", response.motion[..., 0], mass, response.motion[..., 3:])
        across = response.bench.sensor_damping * response.motion[:, :, -1, :1] * response.motion[:, :, -1, 3:]
        return np.asarray(-response.to_read * response.by_row(2 * response.bench.pole[:, None] * both + across))
