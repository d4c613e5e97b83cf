"""The amplitude at which a steady sine of a shaker works a joint, for asking the direct method at the same one.

A sine of force F at frequency w moves freedom p of a joint by F |u_p|, with the modal sum over shapes of unit modal
mass, j being where the shaker pushes,

    u_p(w) = sum_s psi_ps psi_js / (-lambda_s^2 - w^2).

Off resonance the rubber is hardly moved, so the amplitude that mode r sees is that at its own frequency.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from analysis.blow_amplitude import JointAmplitude
from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.modes import Modes


def sine_amplitudes(
    modes: Modes, joint_nodes: Mapping[str, int], point: Dof, force: float, source: str = ""
) -> dict[str, JointAmplitude]:
    """The amplitude at which each mode sees each joint, by the joint's name.

    Args:
        modes: shapes of unit modal mass with x and y at every joint and at the point, as `forward.eigensolution` gives
            them.
        joint_nodes: of each joint, numbered from 1.
        point: where the shaker pushes.
        force: amplitude of the sine, zero to peak, N.
        source: where it is known from, in words.

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
        found[name] = JointAmplitude(2 * np.sqrt(np.sum(np.abs(at_joint @ excited) ** 2, axis=0)), source=source)
    return found
