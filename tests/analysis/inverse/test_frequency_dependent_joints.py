"""Modes and accelerances of a beam whose joints follow frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.inverse.frequency_dependent_joints import accelerance_on, joints_at, modes_on
from analysis.structure.forward import accelerance, eigensolution
from tests.analysis.inverse.laboratory import following

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

LAWS = np.array([[0.06, 0.11], [0.2, 0.0], [0.5, 0.0], [-0.3, 0.0]])
SENSOR = Dof.parse("3y")


def test_each_mode_is_one_of_the_joints_at_its_own_frequency(bench: Bench) -> None:
    found = modes_on(bench.free_beam, bench.joints, 1000.0, LAWS)
    assert found.poles.size == 6
    for number, frequency in enumerate(found.frequency):
        held_by = joints_at(float(frequency), bench.joints, LAWS)
        own = eigensolution(bench.free_beam, held_by, 1100.0)
        assert own.poles[number] == pytest.approx(found.poles[number], rel=1e-8)


def test_without_laws_joints_are_constant(bench: Bench) -> None:
    expected = eigensolution(bench.free_beam, bench.joints, 1000.0)
    np.testing.assert_array_equal(modes_on(bench.free_beam, bench.joints, 1000.0).poles, expected.poles)


def test_accelerances_are_those_of_another_joint_at_each_line(bench: Bench) -> None:
    frequency = np.array([0.0, 30.0, 100.0, 400.0, 900.0])
    follow = following(LAWS, len(bench.inputs))
    found = accelerance_on(bench.free_beam, bench.joints, follow, frequency, SENSOR, bench.inputs).accelerance
    assert not np.any(found[:, 0])
    for line in range(1, frequency.size):
        held_by = joints_at(float(frequency[line]), bench.joints, LAWS)
        at = frequency[line : line + 1]
        expected = accelerance(bench.free_beam, held_by, at, SENSOR, bench.inputs).accelerance[:, 0]
        assert found[:, line] == pytest.approx(expected, rel=1e-7)
