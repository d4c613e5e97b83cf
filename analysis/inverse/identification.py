"""Joint matrices from measured modes, the paper's way: Sections 3, 5 and 7.

Averaging of the longitudinal components, expansion to the joints, weighted regression for each joint,
intervals. What the numbers rest on is judged apart, by the information in the modes themselves.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Real
from analysis.inverse import regression
from analysis.inverse.covariance_propagation import ModalUncertainty, propagated_covariance
from analysis.inverse.expansion import joint_motion
from analysis.inverse.joint_estimate import HALF, JointEstimate, estimate, square
from analysis.inverse.longitudinal_averaging import averaged
from analysis.inverse.observability import modal_bound
from analysis.inverse.undetermined_terms import (
    Unobservable,
    WeakDirections,
    reasons_array,
    term_names,
    undetermined,
    weak_directions,
)
from analysis.modes import Modes
from analysis.structure.agreement import mode_errors
from analysis.structure.beam import FreeBeam
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint
from analysis.structure.setup import check_joint_nodes

PAPER_DOFS = (
    Dof(1, Direction.X),
    Dof(1, Direction.Y),
    Dof(3, Direction.Y),
    Dof(9, Direction.Y),
    Dof(11, Direction.Y),
    Dof(11, Direction.X),
)
"""The components that Section 3 uses on the paper's bench; for any other see `components_of`."""

FREEDOMS = 3  # of a joint: x, y, rotation
MARGIN = 1.5  # times the highest measured frequency, up to which modes of the identified model are searched


def components_of(joint_nodes: Sequence[int], last_node: int, struck: Sequence[Dof]) -> tuple[Dof, ...]:
    """The shape components for the joints of a bench, as Section 3 chooses them.

    They are those across the beam on either side of each joint and those along it at both ends, where all of them were
    struck and suffice, and else all that were struck.
    """
    beside = sorted({node + by for node in joint_nodes for by in (-1, 1)})
    across = (Dof(node, Direction.Y) for node in beside)
    chosen = (Dof(1, Direction.X), *across, Dof(last_node, Direction.X))
    enough = len(chosen) >= FREEDOMS * len(joint_nodes)
    return chosen if enough and set(chosen) <= set(struck) else tuple(struck)


def identify_joints(
    free_beam: FreeBeam,
    modes: Modes,
    joint_nodes: Mapping[str, int],
    measured: Sequence[Dof] = PAPER_DOFS,
    average_longitudinal: bool = True,
) -> dict[str, JointEstimate]:
    """Symmetric k and h of every joint from measured modes, Eqs. (17)-(44).

    Args:
        free_beam: the beam without joints, with its C and known masses.
        modes: measured, three or more; their covariances, where given, are propagated.
        joint_nodes: node by name of joint, any number.
        measured: shape components to use, at least three for each joint.
        average_longitudinal: whether x components are averaged in magnitude and phase first, as in Section 3.

    Raises:
        AnalysisError: a component is missing, or modes or components are too few for the joints.
    """
    check_joint_nodes(joint_nodes)
    nodes = list(joint_nodes.values())
    shapes = np.stack([modes.at(dof) for dof in measured], axis=1)
    if average_longitudinal:
        shapes = averaged(shapes, measured)
    motion = joint_motion(free_beam, modes.poles, shapes, measured, nodes)
    solved = [regression.solve(motion.displacement[:, j], motion.force[:, j]) for j in range(len(nodes))]

    joints = [
        Joint(name, node, square(found.terms[:HALF]) + 1j * square(found.terms[HALF:]))
        for (name, node), found in zip(joint_nodes.items(), solved, strict=True)
    ]
    bound = information_bound(free_beam, joints, modes, measured)
    values = np.concatenate([found.terms for found in solved])
    names = term_names(tuple(joint_nodes))
    why_not = reasons_array([Unobservable.FEWER_MODES] * values.size)
    if bound is not None:
        why_not = undetermined(bound, values, names)
    size = len(regression.TERMS)
    places = [slice(size * joint, size * (joint + 1)) for joint in range(len(joints))]
    propagated = None
    if ModalUncertainty.of(modes, measured) is not None:
        propagated = propagated_covariance(free_beam, modes, nodes, measured, average_longitudinal)
    return {
        joint.name: estimate(
            joint.name, joint.node, found, None if propagated is None else propagated[at, at], why_not[at]
        )
        for joint, found, at in zip(joints, solved, places, strict=True)
    }


def information_bound(
    free_beam: FreeBeam, joints: Sequence[Joint], modes: Modes, measured: Sequence[Dof] = PAPER_DOFS
) -> Real | None:
    """(12 joints, 12 joints) Cramer-Rao bound of modes as uncertain as the measured ones, about identified joints.

    Where the modes carry no covariance, that of a careful test is taken: see `ModalUncertainty.nominal`.
    `joints` are as identified, `modes` as measured, with the components `measured`.

    Returns:
        The bound, or None where the joints do not give back as many modes as were measured.
    """
    predicted = eigensolution(free_beam, joints, MARGIN * float(np.max(modes.frequency)), measured)
    if predicted.poles.size < modes.poles.size:
        return None
    chosen = Modes(modes.poles, np.stack([modes.at(dof) for dof in measured], axis=1), tuple(measured))
    order = [pair.predicted for pair in mode_errors(chosen, predicted)]
    shapes = predicted.shapes[order]
    scale = np.sum(shapes.conj() * chosen.shapes, axis=1) / np.sum(np.abs(shapes) ** 2, axis=1)
    alike = Modes(predicted.poles[order], shapes * scale[:, None], tuple(measured))
    uncertainty = ModalUncertainty.of(modes, measured) or ModalUncertainty.nominal(alike, measured)
    return modal_bound(free_beam, joints, alike, measured, uncertainty)


def weakest_directions(
    free_beam: FreeBeam,
    modes: Modes,
    estimates: Mapping[str, JointEstimate],
    measured: Sequence[Dof] = PAPER_DOFS,
) -> WeakDirections | None:
    """Combinations of joint terms that these modes hardly determine, the weakest first.

    `estimates` are by name of joint, from `identify_joints`, and the other arguments as there.

    Returns:
        The combinations, or None where the identified joints do not give back as many modes as were measured:
        nothing can be said then.
    """
    bound = information_bound(free_beam, [found.joint for found in estimates.values()], modes, measured)
    if bound is None:
        return None
    values = np.concatenate([found.regression.terms for found in estimates.values()])
    return weak_directions(bound, tuple(estimates), free_beam.beam.stiffness_unit, values)
