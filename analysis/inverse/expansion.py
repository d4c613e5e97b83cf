"""Joint motion from measured shape components: the modified Kidder expansion, Eqs. (38)-(44).

Equation (42) says that Z(lambda) psi vanishes at every freedom without a joint. So the shape is the
free beam's answer to forces p at the joint freedoms alone, psi = Z^-1 T_o^t p, and the measured
components determine p. With as many of them as joint freedoms this is Eq. (44); with more, p fits them
in the least squares sense. It needs a few rows of Z^-1 instead of an inverse of the beam's size, and
gives the forces that the joints exert, which the identification wants, together with the motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.structure.beam import FreeBeam

SINGULAR = 1e-11  # smallest singular value of the scaled matrix, as a share of the largest


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Displacement and force of the joints in each mode, with the mode's arbitrary scale.

    Attributes:
        displacement: (modes, joints, 3) x, y, rotation at the joint nodes.
        force: (modes, joints, 3) what each joint exerts on the beam, in N and N m per unit of shape:
            f = -(k + i h) u, which is Z psi at the joint.
    """

    displacement: Complex
    force: Complex


def joint_motion(
    free_beam: FreeBeam,
    poles: Complex,
    shapes: Complex,
    measured: Sequence[Dof],
    joint_nodes: Sequence[int],
) -> JointMotion:
    """Displacements and forces at the joints, from measured components of the shapes.

    Args:
        free_beam: the beam without joints.
        poles: (modes,) lambda_r, rad/s.
        shapes: (modes, measured) components at `measured`.
        measured: at least three for each joint.
        joint_nodes: (joints,) numbered from 1.

    Raises:
        AnalysisError: too few components, or components that leave a joint motion undetermined.
    """
    at_joints = joint_degrees(free_beam, joint_nodes)
    if shapes.shape != (poles.size, len(measured)):
        raise AnalysisError(
            f"shapes have shape {shapes.shape}, expected (modes, measured) = {(poles.size, len(measured))}"
        )
    forces = (force_solution(free_beam, poles, measured, joint_nodes) @ shapes[..., None])[..., 0]
    displacement = free_beam.receptance(poles, at_joints, at_joints) @ forces[..., None]
    split = (len(forces), len(joint_nodes), 3)
    return JointMotion(displacement.reshape(split), forces.reshape(split))


def joint_degrees(free_beam: FreeBeam, joint_nodes: Sequence[int]) -> NDArray[np.intp]:
    """(3 joints,) rows of the joints' freedoms in the matrices of the beam."""
    return np.concatenate([free_beam.mesh.node_degrees(node) for node in joint_nodes])


def measured_degrees(free_beam: FreeBeam, measured: Sequence[Dof]) -> NDArray[np.intp]:
    """(measured,) rows of the measured freedoms in the matrices of the beam."""
    return np.array([free_beam.mesh.degree(dof) for dof in measured], dtype=np.intp)


def force_solution(free_beam: FreeBeam, poles: Complex, measured: Sequence[Dof], joint_nodes: Sequence[int]) -> Complex:
    """(modes, 3 joints, measured) what turns measured components into joint forces: (Z^-1)_mo inverted.

    Raises:
        AnalysisError: too few components, or components that leave a joint motion undetermined.
    """
    unknowns = 3 * len(joint_nodes)
    listed = ", ".join(map(str, measured))
    if len(measured) < unknowns:
        raise AnalysisError(
            f"{len(joint_nodes)} joints need {unknowns} shape components or more, of which {listed or 'none'} were "
            "measured: strike more points"
        )
    at_joints = joint_degrees(free_beam, joint_nodes)
    reach = free_beam.receptance(poles, measured_degrees(free_beam, measured), at_joints)
    scale = np.linalg.norm(free_beam.receptance(poles, at_joints, at_joints), axis=-2, keepdims=True)
    singular_values = np.linalg.svd(reach / scale, compute_uv=False)
    if np.any(singular_values[..., -1] < SINGULAR * singular_values[..., 0]):
        raise AnalysisError(
            f"shape components {listed} do not determine the motion of joints at nodes {list(joint_nodes)}; "
            "measure x at one point for each joint at least, and y or rotation at two"
        )
    return np.asarray(np.linalg.pinv(reach / scale, rcond=SINGULAR) / np.swapaxes(scale, -1, -2))
