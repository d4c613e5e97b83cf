"""The laboratory and its fits, for the tests of everything that judges or compares fits to accelerances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.structure.beam import Beam, Mesh, assemble
from analysis.structure.forward import accelerance
from tests.analysis.inverse.laboratory import FREQUENCY, RATIOS, SENSOR, Laboratory

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench


@pytest.fixture(scope="session")
def laboratory(bench: Bench, paper_beam: Beam) -> Laboratory:
    nodes = bench.free_beam.mesh.positions[list(bench.free_beam.mesh.named)]
    model, finer = (assemble(paper_beam, Mesh.through(nodes, n), damping_ratios=RATIOS) for n in (12, 16))
    exact = accelerance(finer, bench.joints, FREQUENCY, SENSOR, bench.inputs).accelerance
    return Laboratory(model, bench.joints, bench.inputs, exact)


@pytest.fixture(scope="session")
def fits(laboratory: Laboratory) -> list[JointFit]:
    """Forty measurements of one bench, each fitted from another start 20 % off."""
    return [
        identify_from_responses(laboratory.model, laboratory.measured(seed), laboratory.off(seed)) for seed in range(40)
    ]
