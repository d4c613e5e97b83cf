"""The amplitude at which a blow works a joint, for asking the direct method at the same one.

A blow rings down, so its amplitude is no single number. From the modal model: a blow of force spectrum F at freedom j
leaves the freedom p of a joint moving as

    u_p(t) = Re sum_r a_pr e^(lambda_r t),     a_pr = psi_pr psi_jr F(w_r) / lambda_r,

with shapes of unit modal mass and t = 0 in the middle of a short blow, where |F| will do. The rubber feels the whole
deformation, all modes together, of envelope

    x(t) = sqrt(sum_p |sum_r a_pr e^(lambda_r t)|^2).

Its stiffness falls nearly linearly with ln x, and an accelerance weighs each moment by its energy. So the equivalent
amplitude that mode r sees is the mean of ln x, weighted by the energy that mode r then has in the joint, over time and
over all blows:

    ln x_r = sum_blows int e_r ln x dt / sum_blows int e_r dt,     e_r = sum_p |a_pr|^2 e^(2 Re(lambda_r) t).

A single mode alone has x_r = x(0) / sqrt(e): 0.61 of where it starts. What the joint's rotation adds through the
lever of the cylinders is left out; translations are larger by far.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.modes import Modes

SAMPLES_PER_CYCLE = 8  # of the highest mode; the envelope beats with differences of frequencies
MEMORY = 6.0  # time constants of the slowest mode; then 1e-5 of its energy is left
MOST_SAMPLES = 200_000


@dataclass(frozen=True, eq=False)
class BlowForce:
    """One blow, or the mean one at a point.

    Attributes:
        point: where the hammer struck.
        impulse: (modes,) |F| at the frequency of each mode, N s.
    """

    point: Dof
    impulse: Real

    @classmethod
    def from_record(cls, point: Dof, force: ArrayLike, sample_rate: float, modes: Modes) -> BlowForce:
        """From a force record (samples,) in N that holds one blow.

        Raises:
            AnalysisError: the record is empty or not finite.
        """
        record = np.asarray(force, dtype=np.float64)
        if record.ndim != 1 or record.size == 0 or not np.all(np.isfinite(record)):
            raise AnalysisError(f"the force record of the blow at {point} has to be finite numbers, (samples,)")
        time = np.arange(record.size) / sample_rate
        wave = np.exp(-2j * np.pi * modes.frequency[:, None] * time)
        return cls(point, np.abs(wave @ record) / sample_rate)

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
        # |F| of a half-sine; at turn = 1 its limit is peak * length / 2
        spectrum = np.where(off < 1e-6, np.pi / 4, np.abs(np.cos(np.pi * turn / 2)) / np.where(off < 1e-6, 1, off))
        return cls(point, 2 * length * peak_force / np.pi * spectrum)


def joint_amplitudes_pp(modes: Modes, joint_nodes: Mapping[str, int], blows: Sequence[BlowForce]) -> dict[str, Real]:
    """(modes,) peak-to-peak amplitude in m at which each mode sees each joint, by the joint's name.

    Args:
        modes: shapes of unit modal mass with x and y at every joint and at every point struck, as
            `forward.eigensolution` gives them.
        joint_nodes: of each joint, numbered from 1.
        blows: those that the accelerances are made of; a mean one for each point will do.

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
    found = {}
    for name, node in joint_nodes.items():
        at_joint = np.stack([modes.at(Dof(node, direction)) for direction in (Direction.X, Direction.Y)])
        weighted, weight = np.zeros(modes.poles.size), np.zeros(modes.poles.size)
        for blow in blows:
            started: Complex = at_joint * modes.at(blow.point) * blow.impulse / modes.poles
            envelope = np.sqrt(np.sum(np.abs(started @ decay) ** 2, axis=0))
            # in trapezia; where all modes pass through zero at once there is no energy either
            energy = np.sum(np.abs(started) ** 2, axis=0)[:, None] * np.abs(decay) ** 2
            weighted += np.trapezoid(energy * np.log(np.maximum(envelope, np.finfo(float).tiny)), time, axis=1)
            weight += np.trapezoid(energy, time, axis=1)
        found[name] = 2 * np.exp(weighted / weight)
    return found
