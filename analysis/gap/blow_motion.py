"""How far joints move under a blow: one amplitude for each joint and axis of its cylinders.

The motion after a blow decays, and a joint has one stiffness in each record. Which amplitude counts is not known: the
peak, or a mean over some time. Here it is a mean square that forgets, with the weight exp(-2 s t); by Parseval's
theorem it needs no more than the response at s + i w. Laws have parameters for what it does not know.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import Felt, Mounting
from analysis.gap.measurement import Indices

MOTION_DECAY = 100.0
"""1/s; the mean is over the first 5 ms, in which the joints of a beam of a metre come near their peak."""
MOTION_LINES = np.arange(10.0, 430.0, 20.0)
"""Hz. At s + i w no peak is narrower than s, and displacement falls with the square of frequency."""
CONTACT = 1e-3
"""s, duration of a blow that excites a beam up to a kilohertz; a half sine of 1.5 ms excites nothing there."""
MOTION_DOUBT = 0.15
"""Standard deviation of the logarithm of an amplitude that counts, for each joint and axis of each row: the blows of a
row differ in force by a tenth, and definitions of amplitude by as much from row to row."""
FIRST_COMPLIANCE = 5e-8
"""m/N, amplitude over peak force from which the iteration starts."""
REPETITIONS = 10
SETTLED = 1e-8
"""Change of the logarithm of amplitude at which the iteration ends."""
LARGEST_STEP = 0.7
"""Of that logarithm."""
STEP = 1e-6
"""Of that logarithm, for differences."""


def half_sine(pole: Complex) -> Complex:
    """(lines,) Laplace transform of a half sine of unit height and duration `CONTACT`, s, at `pole` (lines,)."""
    own = np.pi / CONTACT
    return np.asarray(own * (1 + np.exp(-pole * CONTACT)) / (pole**2 + own**2))


@dataclass(frozen=True, eq=False)
class BlowMotion:
    """The motion of joints under the blows of each state, and how it changes with their stiffness.

    Attributes:
        moved: (states, lines, joints, 3) transform of their motion (x, y, rotation) at `MOTION_LINES`, m s.
        receptance: (states, lines, 3 joints, 3 joints) of the joints on the beam, m/N.
        mounting: of the cylinders; both of a joint move alike.
    """

    moved: Complex
    receptance: Complex
    mounting: Mounting

    @cached_property
    def _axes(self) -> Real:
        """(joints, 2, 3) axes of shear and compression."""
        lean = self.mounting.inclination[:, 0]
        cosine, sine, none = np.cos(lean), np.sin(lean), np.zeros(lean.size)
        return np.array([[cosine, sine, none], [-sine, cosine, none]]).transpose(2, 0, 1)

    @cached_property
    def _along(self) -> Complex:
        """(states, lines, joints, 2) motion along both axes."""
        return np.asarray(np.einsum("jap,sljp->slja", self._axes, self.moved))

    @cached_property
    def _power(self) -> Real:
        """(states, joints, 2) sum of squares."""
        return np.asarray(np.sum(np.abs(self._along) ** 2, axis=1))

    @cached_property
    def logarithm(self) -> Real:
        """(states, 2 joints) of the amplitude, m zero to peak, along both axes of each joint."""
        step = 2 * np.pi * (MOTION_LINES[1] - MOTION_LINES[0])
        return np.asarray(np.log(4 * MOTION_DECAY / np.pi * step * self._power) / 2).reshape(len(self.moved), -1)

    @cached_property
    def _sensitivity(self) -> Complex:
        """(states, lines, 2 joints, joints, 3, 3) derivative of `logarithm` in the joints' stiffness at each line."""
        states, lines, joints = self.moved.shape[:3]
        pulled = self.receptance.reshape(states, lines, joints, 3, joints, 3)
        by_axis = np.einsum("jap,sljpkq->sljakq", self._axes, pulled)
        weighed = -(self._along.conj() / self._power[:, None])[..., None, None] * by_axis
        found = weighed[..., None] * self.moved[:, :, None, None, :, None, :]
        return np.asarray(found.reshape(states, lines, 2 * joints, joints, 3, 3))

    @cached_property
    def _whole_sensitivity(self) -> Complex:
        return np.asarray(np.sum(self._sensitivity, axis=1))

    def change(self, stiffness: Complex) -> Real:
        """(n, states, 2 joints) derivative of `logarithm` with one of the joints' stiffness.

        Args:
            stiffness: (n, states, lines or 1, joints, 3, 3).
        """
        if stiffness.shape[2] == 1:
            return np.real(np.einsum("sajpq,nsjpq->nsa", self._whole_sensitivity, stiffness[:, :, 0], optimize=True))
        return np.real(np.einsum("slajpq,nsljpq->nsa", self._sensitivity, stiffness, optimize=True))


def felt_of(logarithm: Real, set_of_state: Indices, doubt: Real) -> Felt:
    """What joints feel, from (states, 2 joints) logarithms of their amplitudes and of the factor of doubt."""
    mean = _average(set_of_state) @ logarithm
    parts = (logarithm, mean, doubt)
    own, of_joint, factor = (np.exp(each.T.reshape(-1, 2, len(set_of_state), 1)) for each in parts)
    return Felt(own, of_joint, np.exp(np.mean(mean, axis=1, keepdims=True)), factor)


def moved_alone(felt: Felt, logarithm: Real, doubt: Real) -> Felt:
    """What joints feel where one state alone has other amplitudes and doubts, for each state in turn: means stay.

    A mean is over ten rows or more.
    """
    other = felt_of(logarithm, np.arange(len(logarithm)), doubt)
    return replace(felt, own=other.own, doubt=other.doubt)


def _average(set_of_state: Indices) -> Real:
    """(states, states) that takes the mean over the states of each set."""
    alike = set_of_state[:, None] == set_of_state
    return np.asarray(alike / np.sum(alike, axis=1))


@dataclass(frozen=True, eq=False)
class Agreed:
    """The motion at which stiffness that follows it, and motion that follows stiffness, agree.

    Attributes:
        logarithm: (states, 2 joints) of the amplitudes.
        motion: there.
        stiffness: (states, lines or 1, joints, 3, 3) of the joints there.
        system: (states 2 joints, states 2 joints) the unit matrix less the derivative of that motion in itself.
    """

    logarithm: Real
    motion: BlowMotion
    stiffness: Complex
    system: Real

    def change(self, stiffness: Complex) -> Real:
        """(n, states, 2 joints) derivatives of `logarithm`, from those of the stiffness at the same motion."""
        direct = self.motion.change(stiffness)
        if not len(direct):
            return direct
        return np.asarray(np.linalg.solve(self.system, direct.reshape(len(direct), -1).T).T.reshape(direct.shape))

    def change_alone(self, stiffness: Complex) -> Real:
        """The same where the stiffness of one state changes and that of others does not, for each state in turn."""
        direct = self.motion.change(stiffness)
        states, size = self.logarithm.shape
        own = np.einsum("rarb->rab", self.system.reshape(states, size, states, size))
        return np.asarray(np.linalg.solve(own, direct[..., None])[..., 0])


def agreed(
    stiffness_at: Callable[[Felt], Complex],
    motion_of: Callable[[Complex], BlowMotion],
    peak_force: Real,
    set_of_state: Indices,
    doubt: Real,
) -> Agreed:
    """Equivalent linearisation (T. K. Caughey, J. Acoust. Soc. Am. 35, 1963, 1706-1711), by Newton's method.

    Args:
        stiffness_at: of the joints (states, lines or 1, joints, 3, 3), from what they feel.
        motion_of: the joints, from their stiffness.
        peak_force: (states,) of the blows, N.
        set_of_state: (states,) index of the set of each state.
        doubt: (states, 2 joints) logarithm of the factor of doubt.
    """
    logarithm = np.log(FIRST_COMPLIANCE * peak_force)[:, None] + np.zeros_like(doubt)
    for _ in range(REPETITIONS):
        felt = felt_of(logarithm, set_of_state, doubt)
        stiffness = stiffness_at(felt)
        motion = motion_of(stiffness)
        found = Agreed(logarithm, motion, stiffness, _system(stiffness_at, felt, stiffness, motion, set_of_state))
        left = (motion.logarithm - logarithm).ravel()
        change = np.linalg.solve(found.system, left).reshape(logarithm.shape)
        if not np.max(np.abs(change)) > SETTLED:
            break
        logarithm = logarithm + np.clip(change, -LARGEST_STEP, LARGEST_STEP)
    return found


def _system(
    stiffness_at: Callable[[Felt], Complex], felt: Felt, stiffness: Complex, motion: BlowMotion, set_of_state: Indices
) -> Real:
    """`Agreed.system`."""
    states, joints = len(set_of_state), len(felt.own)

    def slope(**moved: Real) -> Complex:
        return (stiffness_at(replace(felt, **moved)) - stiffness) / STEP

    def by_axis(name: str) -> Real:
        """(states, 2 joints, 2 joints) derivative of `logarithm` in the amplitudes of one kind of each joint."""
        factors = np.exp(STEP * np.eye(2))[:, :, None, None]
        slopes = [slope(**{name: getattr(felt, name) * factor}) for factor in factors]
        columns = [motion.change(np.eye(joints)[:, None, None, :, None, None] * each) for each in slopes]
        return np.array(columns).transpose(2, 3, 1, 0).reshape(states, 2 * joints, 2 * joints)

    of_set = motion.change(slope(of_set=felt.of_set * np.exp(STEP))[None])[0]
    own, shared = by_axis("own"), by_axis("of_joint") + of_set[:, :, None] / (2 * joints)
    coupled = np.einsum("rab,rq->raqb", own, np.eye(states)) + np.einsum("rab,rq->raqb", shared, _average(set_of_state))
    return np.asarray(np.eye(states * 2 * joints) - coupled.reshape(states * 2 * joints, -1))
