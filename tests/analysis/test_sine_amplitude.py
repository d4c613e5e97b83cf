"""The amplitude of a shaker's sine at a joint, against the forward prediction of the motion there."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.sine_amplitude import sine_amplitudes
from analysis.structure.forward import accelerance, eigensolution

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

SHAKER = Dof.parse("5y")
NODES = {"I": 2, "II": 10}


def test_it_is_what_the_joint_moves_by_at_each_mode(bench: Bench) -> None:
    modes = eigensolution(bench.free_beam, bench.joints, 3000.0)
    found = sine_amplitudes(modes, NODES, SHAKER, 2.0, "somewhere")
    for name, node in NODES.items():
        ways = [Dof.parse(f"{node}{way}") for way in "xy"]
        exact = [accelerance(bench.free_beam, bench.joints, modes.frequency, way, [SHAKER]) for way in ways]
        moved = np.linalg.norm([each.accelerance[0] for each in exact], axis=0) / (2 * np.pi * modes.frequency) ** 2
        np.testing.assert_allclose(found[name].amplitude_pp[:6], 2 * 2.0 * moved[:6], rtol=0.02)
        assert found[name].source == "somewhere"
        assert found[name].ci95 is None


def test_twice_the_force_moves_twice_as_far(bench: Bench) -> None:
    modes = eigensolution(bench.free_beam, bench.joints, 1500.0)
    once, twice = (sine_amplitudes(modes, NODES, SHAKER, force)["I"].amplitude_pp for force in (1.0, 2.0))
    np.testing.assert_allclose(twice, 2 * once)


def test_without_force_or_decay_there_is_no_amplitude(bench: Bench) -> None:
    modes = eigensolution(bench.free_beam, bench.joints, 1500.0)
    with pytest.raises(AnalysisError, match="a sine of 0 N"):
        sine_amplitudes(modes, NODES, SHAKER, 0.0)
    with pytest.raises(AnalysisError, match="does not decay"):
        sine_amplitudes(replace(modes, poles=-modes.poles.conj()), NODES, SHAKER, 1.0)
