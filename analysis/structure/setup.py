"""Checks of a beam's setup that every identification needs. They run before a measurement, so this imports no scipy."""

from collections.abc import Mapping, Sequence

from analysis.errors import AnalysisError

RIGID_MODES = 3
FREEDOMS = 3  # of a node: x, y, rotation
ALIKE = 1e-9  # of the beam's length


def check_setup(
    length: float, positions: Sequence[float], damping_ratios: Sequence[float], joint_nodes: Mapping[str, int]
) -> None:
    """Check that joints can be identified on a beam.

    Args:
        length: of the beam, m.
        positions: of the nodes, m from the left end, rising.
        damping_ratios: of the free beam's elastic modes.
        joint_nodes: node by name of joint.

    Raises:
        AnalysisError: the nodes do not span the beam, a damping ratio is none, or two joints share a node.
    """
    check_span(length, positions[0], positions[-1])
    check_damping(damping_ratios, FREEDOMS * len(positions))
    check_joint_nodes(joint_nodes)


def check_span(length: float, first: float, last: float) -> None:
    """AnalysisError where the first node, m, is not at 0, or the last not at the beam's length, m."""
    if abs(first) > ALIKE * length or abs(last - length) > ALIKE * length:
        raise AnalysisError(f"nodes run from {first} m to {last} m, the beam from 0 to {length} m; make them agree")


def check_damping(ratios: Sequence[float], degrees: int) -> None:
    """AnalysisError for ratios outside of 0..1, or more than a mesh of `degrees` of freedom has elastic modes."""
    if not all(0 <= ratio < 1 for ratio in ratios) or len(ratios) > degrees - RIGID_MODES:
        raise AnalysisError(f"damping ratios of the free beam must lie in 0..1, one a mode, not {list(ratios)}")


def check_joint_nodes(joint_nodes: Mapping[str, int]) -> None:
    """AnalysisError where there is no joint, or two are at one node; `joint_nodes` has their nodes by name."""
    if not joint_nodes or len(set(joint_nodes.values())) < len(joint_nodes):
        raise AnalysisError(f"joints need a node each of their own, not {dict(joint_nodes)}")
