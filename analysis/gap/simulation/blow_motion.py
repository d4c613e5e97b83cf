"""How far joints move under a blow: one amplitude for each joint and axis of its cylinders.

The motion after a blow decays, and a joint has one stiffness in each record. Which amplitude counts is not known: the
peak, or a mean over some time. Here it is the root of a mean square with the weight exp(-2 s t); by Parseval's theorem
only the response at s + i w is needed. Parameters of the laws cover what this definition does not know.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BlowAmplitudes, Mounting
from analysis.gap.measurement import Indices

MOTION_DECAY = 100.0
"""Decay rate s of the weight exp(-2 s t) in the mean square of the motion, 1/s. The weight lasts about 5 ms, in which
the joints of a beam of a metre come near their peak."""
MOTION_LINES = np.arange(15.0, 420.0, 30.0)
"""Frequencies at which the motion after a blow is computed, Hz. Few are enough: at s + i w no peak is narrower than s,
and displacement falls with the square of frequency."""
CONTACT = 1e-3
"""s, duration of a blow that excites a beam up to a kilohertz; a half sine of 1.5 ms excites nothing there."""
POINT_SCATTER, ROW_SCATTER = 0.15, 0.05
"""Standard deviations of the logarithm of the amplitude, for each joint and axis. The first is for a struck point, in
all sets alike, as definitions of amplitude differ from point to point; the second is for a row, as blows differ, and
definitions differ with force. Motion and stiffness agree without these errors."""
FIRST_COMPLIANCE = 8e-8
"""m/N, amplitude over peak force from which the iteration starts."""
REPETITIONS = 10
SETTLED = 1e-11
"""Change of the logarithm of amplitude at which the iteration ends."""
LARGEST_STEP = 0.7
"""Largest change of the logarithm of amplitude in one step of the iteration."""
STEP = 1e-6
"""Step of the logarithm of amplitude, for finite differences."""


def half_sine(pole: Complex) -> Complex:
    """(lines,) Laplace transform of a half sine of unit height and duration `CONTACT`, s, at `pole` (lines,)."""
    own = np.pi / CONTACT
    return np.asarray(own * (1 + np.exp(-pole * CONTACT)) / (pole**2 + own**2))


@dataclass(frozen=True, eq=False)
class BlowMotion:
    """The motion of joints under the blows of each row, and its change with the stiffness that joints have in a set.

    Attributes:
        moved: (rows, lines, joints, 3) Laplace transform of their motion (x, y, rotation) at `MOTION_LINES`, m s.
        receptance: (sets, lines, 3 joints, 3 joints) of the joints on the beam, m/N.
        set_of_row: (rows,) index of the set of each row.
        measured: (rows,) whether a row was measured; the others, which are only asked for, change no mean.
        mounting: of the cylinders; both of a joint move alike.
    """

    moved: Complex
    receptance: Complex
    set_of_row: Indices
    measured: NDArray[np.bool_]
    mounting: Mounting

    @cached_property
    def _axes(self) -> Real:
        """(joints, 2, 3) axes of shear and compression."""
        lean = self.mounting.inclination[:, 0]
        cosine, sine, none = np.cos(lean), np.sin(lean), np.zeros(lean.size)
        return np.array([[cosine, sine, none], [-sine, cosine, none]]).transpose(2, 0, 1)

    @cached_property
    def _along(self) -> Complex:
        """(rows, lines, joints, 2) motion along both axes."""
        return np.asarray(np.einsum("jap,rljp->rlja", self._axes, self.moved))

    @cached_property
    def _power(self) -> Real:
        """(rows, joints, 2) sum of squares of the motion along both axes."""
        return np.asarray(np.sum(np.abs(self._along) ** 2, axis=1))

    @cached_property
    def logarithm(self) -> Real:
        """(rows, 2 joints) natural logarithm of the amplitude, m zero to peak, along both axes of each joint."""
        step = 2 * np.pi * (MOTION_LINES[1] - MOTION_LINES[0])
        return np.asarray(np.log(4 * MOTION_DECAY / np.pi * step * self._power) / 2).reshape(len(self.moved), -1)

    @cached_property
    def average(self) -> Real:
        """(sets, rows) matrix that takes the mean over the measured rows of each set."""
        members = (np.arange(len(self.receptance))[:, None] == self.set_of_row) & self.measured
        return np.asarray(members / np.sum(members, axis=1, keepdims=True))

    @cached_property
    def _sensitivity(self) -> Complex:
        """(rows, lines, 2 joints, joints, 3, 3) derivative of `logarithm` in the joints' stiffness at each line."""
        rows, lines, joints = self.moved.shape[:3]
        pulled = self.receptance.reshape(-1, lines, joints, 3, joints, 3)
        by_axis = np.einsum("jap,sljpkq->sljakq", self._axes, pulled)[self.set_of_row]
        weighed = -(self._along.conj() / self._power[:, None])[..., None, None] * by_axis
        found = weighed[..., None] * self.moved[:, :, None, None, :, None, :]
        return np.asarray(found.reshape(rows, lines, 2 * joints, joints, 3, 3))

    @cached_property
    def _whole_sensitivity(self) -> Complex:
        return np.asarray(np.sum(self._sensitivity, axis=1))

    def change(self, stiffness: Complex) -> Real:
        """(n, rows, 2 joints) derivatives of `logarithm`, from those of the joints' stiffness.

        Args:
            stiffness: (n, sets, lines or 1, joints, 3, 3).
        """
        own = stiffness[:, self.set_of_row]
        if own.shape[2] == 1:
            return np.real(np.einsum("rajpq,nrjpq->nra", self._whole_sensitivity, own[:, :, 0], optimize=True))
        return np.real(np.einsum("rlajpq,nrljpq->nra", self._sensitivity, own, optimize=True))


def blow_amplitudes_of(logarithm: Real, average: Real, set_of_row: Indices) -> BlowAmplitudes:
    """Amplitudes of the joints under the blows of each row.

    Args:
        logarithm: (rows, 2 joints) of the amplitudes.
        average: (sets, rows) matrix that takes the mean over the rows of each set.
        set_of_row: (rows,) index of the set of each row.
    """
    mean = (average @ logarithm)[set_of_row]
    own = factors_of(logarithm)
    return BlowAmplitudes(own, factors_of(mean), np.exp(np.mean(mean, axis=1, keepdims=True)), np.ones_like(own))


def factors_of(logarithm: Real) -> Real:
    """(joints, 2, rows, 1) factors of (rows, 2 joints) logarithms."""
    return np.asarray(np.exp(logarithm.T.reshape(-1, 2, len(logarithm), 1)))


@dataclass(frozen=True, eq=False)
class EquivalentLinearisation:
    """Motion and stiffness that agree: the stiffness of a set belongs to its mean motion, the motion to that stiffness.

    Attributes:
        motion: of each row.
        stiffness: (sets, lines or 1, joints, 3, 3) of the joints there.
        by_mean: (2 joints, sets, lines or 1, joints, 3, 3) derivative of `stiffness` in the logarithm of each mean.
    """

    motion: BlowMotion
    stiffness: Complex
    by_mean: Complex

    @cached_property
    def system(self) -> Real:
        """(sets, 2 joints, 2 joints) the unit matrix less the derivative of the mean motion in itself."""
        by_own = self._mean(self.motion.change(self.by_mean))  # (2 joints, sets, 2 joints)
        return np.asarray(np.eye(len(by_own)) - np.moveaxis(by_own, 0, -1))

    def _mean(self, of_rows: Real) -> Real:
        return np.asarray(np.einsum("sr,nra->nsa", self.motion.average, of_rows))

    def blow_amplitudes(self, logarithm: Real) -> BlowAmplitudes:
        """Amplitudes of the joints, from their logarithm for each row (rows, 2 joints)."""
        return blow_amplitudes_of(logarithm, self.motion.average, self.motion.set_of_row)

    def mean_step(self, left: Real) -> Real:
        """(n, sets, 2 joints) change of the mean motion; `left` (n, sets, 2 joints) is that at fixed stiffness."""
        return np.asarray(np.linalg.solve(self.system, left[..., None])[..., 0])

    def change(self, stiffness: Complex) -> Real:
        """(n, rows, 2 joints) derivatives of the motion, from those of the stiffness at the same mean motion."""
        mean = self.mean_step(self._mean(self.motion.change(stiffness)))
        followed = np.einsum("nsa,asljpq->nsljpq", mean, self.by_mean)
        return self.motion.change(stiffness + followed)


def equivalent_linearisation(
    stiffness_at: Callable[[BlowAmplitudes], Complex],
    motion_of: Callable[[Complex], BlowMotion],
    peak_force: Real,
    joints: int,
) -> EquivalentLinearisation:
    """Equivalent linearisation (T. K. Caughey, J. Acoust. Soc. Am. 35, 1963, 1706-1711), by Newton's method.

    The motion of each row is that of a bench whose joints have the stiffness of the mean motion of the set.

    Args:
        stiffness_at: of the joints (sets, lines or 1, joints, 3, 3), from their amplitudes in the mean of each set.
        motion_of: the joints, from that stiffness.
        peak_force: (sets,) of the blows, N.
        joints: their number.
    """
    sets = np.arange(len(peak_force))
    logarithm = np.tile(np.log(FIRST_COMPLIANCE * peak_force)[:, None], 2 * joints)
    for _ in range(REPETITIONS):
        stiffness, *moved = (
            stiffness_at(blow_amplitudes_of(logarithm + step, np.eye(len(sets)), sets))
            for step in (np.zeros(2 * joints), *(STEP * np.eye(2 * joints)))
        )
        found = EquivalentLinearisation(motion_of(stiffness), stiffness, (np.array(moved) - stiffness) / STEP)
        change = found.mean_step((found.motion.average @ found.motion.logarithm - logarithm)[None])[0]
        if not np.max(np.abs(change)) > SETTLED:
            break
        logarithm = logarithm + np.clip(change, -LARGEST_STEP, LARGEST_STEP)
    return found
