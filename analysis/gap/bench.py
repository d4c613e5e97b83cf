"""The state of the bench: all quantities on which the response of both rigs to a blow or a sine depends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import Indices

TYPICAL_MOTION = 10e-6
"""m, typical amplitude of joints under blows of 200 N."""
FIRST_MODES = 80.0
"""Hz, about the first modes of a beam on joints; above, the motion under blows falls with frequency."""


@dataclass(frozen=True, eq=False)
class BlowAmplitudes:
    """How far the cylinders of each joint move under blows: amplitudes in m, zero to peak.

    Attributes:
        own: (joints, 2, states, 1) amplitude in shear and in compression, under the blows of each state.
        of_joint: (joints, 2, states, 1) the geometric mean of `own` over all blows of the set.
        of_set: (states, 1) the geometric mean of `of_joint` over joints and axes.
        error: (joints, 2, states, 1) factor by which the amplitude that counts may differ from `own`.
    """

    own: Real
    of_joint: Real
    of_set: Real
    error: Real

    def amplitude(self, factor: float, by_force: float, by_row: float, by_joint: float) -> Real:
        """(joints, 2, states, 1) amplitude on which the stiffness of the joints depends, m, zero to peak.

        It is `factor` times the mean of the set, taken to the power `by_force` about `TYPICAL_MOTION`. `by_row` and
        `by_joint` are powers of the ratios to this mean: with 0, all blows (all joints and axes) have the mean; with 1,
        each has its own value.
        """
        apart = (self.own / self.of_joint) ** by_row * (self.of_joint / self.of_set) ** by_joint
        return np.asarray(factor * TYPICAL_MOTION * (self.of_set / TYPICAL_MOTION) ** by_force * apart * self.error)


@dataclass(frozen=True, eq=False)
class Loading:
    """The state of motion for which the stiffness of cylinders is computed; arrays are (n,).

    Attributes:
        tester: whether the cylinders are in the tester; otherwise they are under the beam.
        frequency: Hz.
        amplitude: zero to peak in the tester, m; nan under the beam.
        blow_amplitudes: None where no effect asks for it, and in the tester.
        fraction: how far the test had come in the order of measuring, 0 to 1; 0 under the beam.
        angled: whether cylinders are tested at 45 degrees; false under the beam.
    """

    tester: bool
    frequency: Real
    amplitude: Real
    blow_amplitudes: BlowAmplitudes | None
    fraction: Real
    angled: NDArray[np.bool_]

    def deformation(
        self, component: bool, factor: float, by_force: float, by_row: float, by_joint: float, fall: float
    ) -> Real:
        """Amplitude, m, of the whole deformation, or of its component along each axis of the cylinders.

        Args:
            component: whether each axis follows its own component.
            factor, by_force, by_row, by_joint: as of `BlowAmplitudes.amplitude`.
            fall: power of frequency with which the amplitude falls above `FIRST_MODES`.

        Returns:
            (n,) in the tester, (joints, 1 or 3, states, n) under the beam.
        """
        if self.tester:
            return np.where(self.angled, self.amplitude / np.sqrt(2), self.amplitude) if component else self.amplitude
        assert self.blow_amplitudes is not None, "effects that follow motion say so"
        fallen = (1 + (self.frequency / FIRST_MODES) ** 2) ** (-fall / 2)
        axes = self.blow_amplitudes.amplitude(factor, by_force, by_row, by_joint) * fallen
        whole = np.hypot(axes[:, :1], axes[:, 1:])
        return np.concatenate([axes, whole], axis=1) if component else whole


@dataclass(frozen=True, eq=False)
class Setting:
    """How the beam is struck.

    Attributes:
        inputs: (rows,) points struck.
        frequency: (lines,) Hz.
        peak_force: (states,) of a blow in each state of the joints, N.
        state: (rows,) index of the state of the joints in which each row was measured.
        set_of_row: (rows,) index of the hammer set of each row.
        decay: of the exponential window that the records are stated to carry, 1/s.
        blow_amplitudes: None where no effect asks for it.
    """

    inputs: tuple[Dof, ...]
    frequency: Real
    peak_force: Real
    state: Indices
    set_of_row: Indices
    decay: float = 0.0
    blow_amplitudes: BlowAmplitudes | None = None

    def by_state(self, of_rows: Real) -> Real:
        """The mean of values (rows, ...) over the rows of each state, (states, ...)."""
        rows = np.arange(int(np.max(self.state)) + 1)[:, None] == self.state
        return np.asarray(rows / np.sum(rows, axis=1, keepdims=True) @ of_rows)

    @cached_property
    def loading(self) -> Loading:
        """The state of motion of the cylinders."""
        lines = self.frequency.size
        return Loading(
            tester=False,
            frequency=self.frequency,
            amplitude=np.full(lines, np.nan),
            blow_amplitudes=self.blow_amplitudes,
            fraction=np.zeros(lines),
            angled=np.zeros(lines, dtype=bool),
        )


@dataclass(frozen=True, eq=False)
class Cylinders:
    """Stiffness of the cylinders of each joint in shear, compression (N/m) and rotation (N m).

    Attributes:
        storage, loss: (joints, 3, states, n) k' and k''; 1 where they are the same for all states, points or lines.
    """

    storage: Real
    loss: Real

    @property
    def complex_stiffness(self) -> Complex:
        """(joints, 3, states, n) k' + i k''."""
        return np.asarray(self.storage + 1j * self.loss)

    def scaled(self, storage: Real | float, loss: Real | float) -> Cylinders:
        """The cylinders with their stiffness multiplied by factors that broadcast to (joints, 3, states, n)."""
        return Cylinders(np.asarray(self.storage * storage), np.asarray(self.loss * loss))


@dataclass(frozen=True, eq=False)
class Mounting:
    """How cylinders hold the beam.

    Attributes:
        inclination: (joints, 2) theta of the lower and the upper cylinder, rad.
        eccentricity: (joints, 2) distance of each from the beam's axis, m; negative for the lower one.
        length: (joints,) length of beam over which the stiffness is spread, m.
        position: (joints,) of each joint, m from the left end.
    """

    inclination: Real
    eccentricity: Real
    length: Real
    position: Real


@dataclass(frozen=True)
class LocalMotion:
    """The motion of the beam on which a local change acts.

    Attributes:
        direction: of that motion.
        half_length: m; above 0, the motion is the difference between the points so far to the right and to the left.
    """

    direction: Direction
    half_length: float = 0.0


@dataclass(frozen=True, eq=False)
class BeamBench:
    """The beam rig in one hammer set.

    Attributes:
        pole: (lines,) at which the bench is evaluated: i w, plus the decay of an exponential window.
        joints: (states, lines or 1, joints, 3, 3) dynamic stiffness on (x, y, rotation).
        modulus, density: relative to the drawing.
        mesh: share by which the mesh raises the squared frequency of the third free mode; it grows with that square.
        loss: (lines or 1,) structural loss factor of the beam beyond its free damping.
        damping: damping ratios of the free beam, relative to the drawing.
        ratio: damping ratio that every elastic mode has in addition.
        joint_position: (joints,) m.
        joint_reach: (joints,) length over which a joint holds the beam, m: it feels the mean motion over it.
        sensor_position: m.
        sensor_height: of the sensor's element above the beam's axis, m.
        sensor_mass: kg, beyond the known one.
        sensor_damping: N s/m, of what holds the sensor's cable; across the beam.
        cross_axis: share of the axial acceleration that the sensor reads.
        blow_offset: (rows,) of the blows from their marks, in addition to the tolerance of each set, m: along the beam,
            on an end face above the axis.
        lean: (rows,) of the blows, in addition to the tolerance of each set, rad: to the right, on an end face upwards.
        strike_height: of the struck surface over the beam's axis, m: the lever of a leaning blow.
        chain: (rows or 1, lines or 1) reading over true acceleration per force.
        added: (rows or 1, lines or 1) receptance that the plane model does not have, m/N.
        local: motion on which a change acts that the drawing does not have; None without such a change.
        local_stiffness: (lines or 1,) dynamic stiffness of that change, N/m, or N m where it turns.
        local_position: of its middle, m.
        on_base: whether all joints stand on one base that moves across the beam.
        base: (lines or 1,) dynamic stiffness of that base, N/m.
    """

    pole: Complex
    joints: Complex
    modulus: float
    density: float
    mesh: float
    loss: Real
    damping: float
    ratio: float
    joint_position: Real
    joint_reach: Real
    sensor_position: float
    sensor_height: float
    sensor_mass: float
    sensor_damping: float
    cross_axis: float
    blow_offset: Real
    lean: Real
    strike_height: float
    chain: Complex
    added: Complex
    local: LocalMotion | None
    local_stiffness: Complex
    local_position: float
    on_base: bool
    base: Complex


def joint_matrices(cylinders: Cylinders, mounting: Mounting) -> Complex:
    """(states, lines, joints, 3, 3) stiffness of joints with a lower and an upper cylinder each, Eqs. (9)-(11).

    A stiffness that is spread over a length l adds k22 l^2 / 12 in rotation.
    """
    cosine, sine, e = np.cos(mounting.inclination), np.sin(mounting.inclination), mounting.eccentricity
    along, across = np.array([[cosine, sine, -e * cosine], [-sine, cosine, e * sine]])  # (3, joints, 2)
    of_one = np.zeros((len(e), 3, 3, 3))  # joint matrices of one N/m of shear, of compression, and one N m of rotation
    of_one[:, 0], of_one[:, 1] = (np.einsum("pjn,qjn->jpq", each, each) for each in (along, across))
    of_one[:, 2, 2, 2] = 2.0
    of_one[:, :, 2, 2] += of_one[:, :, 1, 1] * mounting.length[:, None] ** 2 / 12
    stiffness = cylinders.complex_stiffness
    joints, _, states, lines = stiffness.shape
    # one real product for all joints, states and lines: many small complex ones take five times as long
    every = np.zeros((joints, 3, 2, joints, 9, 2))
    for joint, own in enumerate(of_one.reshape(joints, 3, 9)):
        every[joint, :, 0, joint, :, 0] = every[joint, :, 1, joint, :, 1] = own  # real and imaginary
    parts = np.ascontiguousarray(stiffness.reshape(3 * joints, -1).T).view(np.float64)
    found = (parts @ every.reshape(6 * joints, -1)).view(np.complex128)
    return np.asarray(found.reshape(states, lines, joints, 3, 3))


def mass_on_spring(stiffness: float, loss: float, resonance: float, pole: Complex) -> Complex:
    """(lines,) dynamic stiffness of a mass on a spring with structural damping: k (1 + i loss) - w^2 m.

    Args:
        stiffness: of the spring, k.
        loss: loss factor of the spring.
        resonance: of the mass on the spring, Hz.
        pole: (lines,) 1/s.
    """
    return np.asarray(stiffness * (1 + 1j * loss + (pole / (2 * np.pi * resonance)) ** 2))
