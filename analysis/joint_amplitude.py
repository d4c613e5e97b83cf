"""The amplitude at which blows or a steady sine move a joint, to ask the direct method at the same one.

A blow rings down, so its amplitude is no single number. By the modal model, a blow of force spectrum F at freedom j
moves freedom p of a joint by

    u_p(t) = Re sum_r a_pr e^(lambda_r t),     a_pr = psi_pr psi_jr F(w_r) / lambda_r,

with shapes of unit modal mass and t = 0 in the middle of a short blow, where |F| is enough. The rubber sees the whole
deformation, all modes together, of envelope

    x(t) = sqrt(sum_p |sum_r a_pr e^(lambda_r t)|^2).

Its stiffness falls nearly linearly with ln x. An accelerance weighs each moment by its energy, and all blows alike
whatever their force F_b (root mean square of |F| at the modes). So mode r sees the mean of ln x, weighted by the energy
per squared force that the mode has in the joint at that moment, over time and all blows:

    ln x_r = sum_blows int e_r ln x dt / sum_blows int e_r dt,   e_r = sum_p |a_pr|^2 e^(2 Re(lambda_r) t) / F_b^2.

A single mode alone has x_r = x(0) / sqrt(e): 0.61 of its start. The mean over the blows has weights w_b = int e_r dt.
Its error follows from the scatter of the means y_b of single blows,

    var ln x_r = n / (n - 1) sum_b w_b^2 (y_b - ln x_r)^2 / (sum_b w_b)^2

(W. G. Cochran, Sampling Techniques, 3rd ed., Section 6.4, for a ratio of sums). The difference between points counts as
scatter, because accelerances weigh points only roughly by their energy. The joint's rotation, which acts through the
lever of the cylinders, is left out; translations are larger by far.

A steady sine of a shaker, of force F at frequency w, moves freedom p of a joint by F |u_p|, with the modal sum

    u_p(w) = sum_s psi_ps psi_js / (-lambda_s^2 - w^2),

j being the point of the shaker. Off resonance the rubber hardly moves, so mode r sees the amplitude at its own
frequency.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.interval import quantile
from analysis.modes import Modes

SAMPLES_PER_CYCLE = 8  # of the highest mode; the envelope beats with differences of frequencies
MEMORY = 6.0  # time constants of the slowest mode; then 1e-5 of its energy is left
MOST_SAMPLES = 200_000


@dataclass(frozen=True, eq=False)
class BlowForce:
    """One blow, or the mean blow at a point.

    Attributes:
        point: that was struck.
        impulse: (modes,) |F| at the frequency of each mode, N s.
    """

    point: Dof
    impulse: Real

    @classmethod
    def from_records(cls, point: Dof, force: ArrayLike, sample_rate: float, modes: Modes) -> tuple[BlowForce, ...]:
        """From force records (blows, samples) in N, each of which holds one blow at `point`.

        Raises:
            AnalysisError: the records are empty or not finite.
        """
        records = np.asarray(force, dtype=np.float64)
        if records.ndim != 2 or records.size == 0 or not np.all(np.isfinite(records)):
            raise AnalysisError(
                f"the force records of the blows at {point} have to be finite numbers, (blows, samples)"
            )
        time = np.arange(records.shape[1]) / sample_rate
        wave = np.exp(-2j * np.pi * time[:, None] * modes.frequency)
        return tuple(cls(point, impulse) for impulse in np.abs(records @ wave) / sample_rate)

    @classmethod
    def from_peak(cls, point: Dof, peak_force: float, width: float, modes: Modes) -> BlowForce:
        """From the peak in N and the width in s at half of it, for a half-sine pulse.

        Raises:
            AnalysisError: the peak or the width is not positive.
        """
        if not (peak_force > 0 and width > 0):
            raise AnalysisError(f"a blow of {peak_force} N and {width} s; both have to be positive")
        length = 1.5 * width  # a half-sine is above half of its peak for two thirds of its length
        turn = 2 * modes.frequency * length
        off = np.abs(1 - turn**2)
        # |F| of a half-sine; its limit at turn = 1 is peak * length / 2
        spectrum = np.where(off < 1e-6, np.pi / 4, np.abs(np.cos(np.pi * turn / 2)) / np.where(off < 1e-6, 1, off))
        return cls(point, 2 * length * peak_force / np.pi * spectrum)


@dataclass(frozen=True, eq=False)
class JointAmplitude:
    """The amplitude at which each mode sees a joint.

    Attributes:
        amplitude_pp: (modes,) peak to peak, m.
        log_error: (modes,) standard error of its logarithm, from the scatter over the blows; None without scatter.
        degrees_of_freedom: behind the error.
        source: what it was computed from, as text for reports.
    """

    amplitude_pp: Real
    log_error: Real | None = None
    degrees_of_freedom: float = math.inf
    source: str = ""

    @property
    def ci95(self) -> Real | None:
        """(modes, 2) 95 % intervals, m, or None."""
        if self.log_error is None:
            return None
        half = quantile(self.degrees_of_freedom) * self.log_error
        return np.asarray(self.amplitude_pp[:, None] * np.exp(np.stack([-half, half], axis=1)))

    @property
    def over_modes(self) -> JointAmplitude:
        """One amplitude for all modes, (1,): the mean of the logarithm. The same blows moved all modes."""
        return replace(
            self,
            amplitude_pp=np.exp(np.mean(np.log(self.amplitude_pp), keepdims=True)),
            log_error=None if self.log_error is None else np.mean(self.log_error, keepdims=True),
        )


def joint_amplitudes(
    modes: Modes, joint_nodes: Mapping[str, int], blows: Sequence[BlowForce], source: str = ""
) -> dict[str, JointAmplitude]:
    """The amplitude at which each mode sees each joint, by the joint's name.

    Args:
        modes: shapes of unit modal mass with x and y at every joint and at every point struck, as
            `forward.eigensolution` gives them.
        joint_nodes: of each joint, numbered from 1.
        blows: of the accelerances. A mean blow for each point is enough, but then there is no scatter of blows.
        source: what the blows are known from, as text for reports.

    Raises:
        AnalysisError: there is no blow, a shape lacks a component, or a mode does not decay.
    """
    if not blows:
        raise AnalysisError("no blow: the amplitude at the joints cannot be computed")
    if np.any(modes.poles.real >= 0):
        raise AnalysisError("a mode does not decay; an amplitude needs poles in the left half-plane")
    slowest = float(np.min(-modes.poles.real))
    step = 1 / (SAMPLES_PER_CYCLE * float(np.max(modes.poles.imag)) / (2 * np.pi))
    time = np.linspace(0, MEMORY / slowest, min(int(MEMORY / slowest / step) + 2, MOST_SAMPLES))
    decay = np.exp(modes.poles[:, None] * time)  # (modes, times)
    # energy as a share of that at the start, by the trapezoidal rule
    fading = np.abs(decay) ** 2 * (time[1] - time[0])
    fading[:, [0, -1]] /= 2
    strength = np.array([max(float(np.mean(blow.impulse**2)), np.finfo(float).tiny) for blow in blows])
    return {
        name: _amplitude(np.array([_at_start(modes, node, blow) for blow in blows]), strength, decay, fading, source)
        for name, node in joint_nodes.items()
    }


def _at_start(modes: Modes, node: int, blow: BlowForce) -> Complex:
    """(2, modes) complex amplitudes a_pr in m with which a blow starts each mode along x and y of a node."""
    at_joint = np.stack([modes.at(Dof(node, direction)) for direction in (Direction.X, Direction.Y)])
    return np.asarray(at_joint * modes.at(blow.point) * blow.impulse / modes.poles)


def _amplitude(started: Complex, strength: Real, decay: Complex, fading: Real, source: str) -> JointAmplitude:
    """The amplitude of blows with these start amplitudes.

    Args:
        started: (blows, 2, modes) m.
        strength: (blows,) squared force.
        decay: (modes, times).
        fading: (modes, times) its energy, as weights of an integral over time.
        source: see `JointAmplitude`.
    """
    lasting = np.sum(fading, axis=1)
    energy = np.sum(np.abs(started) ** 2, axis=1) * lasting / strength[:, None]  # (blows, modes)
    # where all modes pass through zero at once there is no energy either
    smallest = np.finfo(float).tiny
    means = np.array(
        [
            fading @ np.log(np.maximum(np.sqrt(np.sum(np.abs(each @ decay) ** 2, axis=0)), smallest)) / lasting
            for each in started
        ]
    )
    share = energy / np.sum(energy, axis=0)
    mean = np.sum(share * means, axis=0)
    count = len(started)
    error = None
    if count > 1:
        error = np.sqrt(count / (count - 1) * np.sum((share * (means - mean)) ** 2, axis=0))
    return JointAmplitude(2 * np.exp(mean), error, count - 1 if count > 1 else math.inf, source)


def sine_amplitudes(
    modes: Modes, joint_nodes: Mapping[str, int], point: Dof, force: float
) -> dict[str, JointAmplitude]:
    """The amplitude at which each mode sees each joint under a sine, by the joint's name.

    Args:
        modes: shapes of unit modal mass with x and y at every joint and at the point, as `forward.eigensolution` gives
            them.
        joint_nodes: of each joint, numbered from 1.
        point: of the shaker.
        force: amplitude of the sine, zero to peak, N.

    Raises:
        AnalysisError: the force is not positive, or a mode does not decay.
    """
    if not force > 0:
        raise AnalysisError(f"a sine of {force:g} N; the amplitude at the joints needs a positive one")
    if np.any(modes.poles.real >= 0):
        raise AnalysisError("a mode does not decay; a sine at its frequency has no steady amplitude")
    compliance = 1 / (-(modes.poles[:, None] ** 2) - (2 * np.pi * modes.frequency) ** 2)  # (modes, lines)
    excited = force * modes.at(point)[:, None] * compliance
    found = {}
    for name, node in joint_nodes.items():
        at_joint = np.array([modes.at(Dof(node, direction)) for direction in (Direction.X, Direction.Y)])
        found[name] = JointAmplitude(2 * np.sqrt(np.sum(np.abs(at_joint @ excited) ** 2, axis=0)))
    return found
