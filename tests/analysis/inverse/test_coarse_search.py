"""Joints to start from, found from accelerances and the drawing alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses
from analysis.inverse.coarse_search import JointShapes, coarse_joints, drawn_as_cylinders
from analysis.inverse.cylinder_parameters import CylinderPair
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint
from tests.analysis.inverse.laboratory import drawn_as_springs

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

BAND = (20.0, 1024.0)
NOISE = 0.01
FREQUENCY = np.arange(20.0, 1024.0, 4.0)
LEANING = {"I": (-np.pi / 4, 3 * np.pi / 4), "II": (np.pi / 4, -3 * np.pi / 4)}


def measured(bench: Bench, joints: list[Joint]) -> FrequencyResponses:
    exact = accelerance(bench.free_beam, joints, FREQUENCY, Dof.parse("3y"), bench.inputs)
    parts = np.random.default_rng(1).standard_normal((2, *exact.accelerance.shape))
    noisy = exact.accelerance + NOISE * (parts[0] + 1j * parts[1])
    return replace(exact, accelerance=noisy, variance=np.full(noisy.shape, NOISE**2))


def as_cylinders(bench: Bench) -> list[JointShapes]:
    return [
        drawn_as_cylinders(joint.node, CylinderPair(joint.name, LEANING[joint.name], 0.006), bench.free_beam)
        for joint in bench.joints
    ]


@pytest.mark.parametrize("scales", [(0.1, 0.1), (1.0, 1.0), (10.0, 10.0), (0.2, 4.0), (5.0, 0.3)])
def test_the_likest_joints_are_near_the_true_ones_whatever_their_stiffness(
    bench: Bench, scales: tuple[float, float]
) -> None:
    joints = [
        replace(joint, dynamic_stiffness=scale * joint.dynamic_stiffness)
        for joint, scale in zip(bench.joints, scales, strict=True)
    ]
    best = coarse_joints(bench.free_beam, measured(bench, joints), as_cylinders(bench), BAND)[0]
    for found, true in zip(best, joints, strict=True):
        assert (found.name, found.node) == (true.name, true.node)
        ratio = found.dynamic_stiffness[1, 1].real / true.dynamic_stiffness[1, 1].real
        assert 1 / 1.3 < ratio < 1.3


def test_several_starts_are_offered_and_none_lies_near_another(bench: Bench) -> None:
    drawn = [drawn_as_springs(joint.name, joint.node, bench.free_beam) for joint in bench.joints]
    offered = coarse_joints(bench.free_beam, measured(bench, list(bench.joints)), drawn, BAND)
    assert len(offered) >= 2
    stacked = [np.array([joint.dynamic_stiffness for joint in joints]) for joints in offered]
    for one, other in combinations(stacked, 2):
        assert np.linalg.norm(one - other) > 0.05 * np.linalg.norm(one)


def test_a_fit_that_starts_nowhere_near_goes_on_from_a_search(bench: Bench) -> None:
    responses, asked = measured(bench, list(bench.joints)), list[int]()

    def other_starts() -> Iterator[list[Joint]]:
        asked.append(1)
        yield from coarse_joints(bench.free_beam, responses, as_cylinders(bench), BAND)

    far = [replace(joint, dynamic_stiffness=1e-3 * joint.dynamic_stiffness) for joint in bench.joints]
    found = identify_from_responses(bench.free_beam, responses, far, other_starts=other_starts())
    assert found.passed
    assert len(asked) == 1
    for joint in bench.joints:
        true = joint.dynamic_stiffness[1, 1].real
        assert found.joints[joint.name].stiffness[1, 1] == pytest.approx(true, rel=0.01)


def test_a_near_start_asks_for_no_other(bench: Bench) -> None:
    def other_starts() -> Iterator[list[Joint]]:
        yield from pytest.fail("no other start is needed")

    near = [replace(joint, dynamic_stiffness=1.2 * joint.dynamic_stiffness) for joint in bench.joints]
    responses = measured(bench, list(bench.joints))
    assert identify_from_responses(bench.free_beam, responses, near, other_starts=other_starts()).passed


def test_two_joints_at_one_node_are_refused(bench: Bench) -> None:
    drawn = [drawn_as_springs(name, 2, bench.free_beam) for name in ("I", "II")]
    with pytest.raises(AnalysisError, match="each at a node of its own"):
        coarse_joints(bench.free_beam, measured(bench, list(bench.joints)), drawn, BAND)
