"""Modulus and density from a suspended bar, and what they are worth to the joints that are identified with it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses, Real
from analysis.interval import Estimate
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.tolerances import Tolerances
from analysis.structure.beam import Beam, Mesh, assemble
from analysis.structure.forward import accelerance
from analysis.suspended.beam_update import BeamTolerances, BeamUpdate, update_beam
from analysis.suspended.free_modes import ElasticModes
from analysis.suspended.material import Material, material_of

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

RATIOS = (0.004, 0.001, 0.001)
FREQUENCY = np.arange(20.0, 1025.0, 4.0)
NOISE = 0.003
STATED = Tolerances(sensor_gain=0.005, youngs_modulus=0.005, density=0.003)


@dataclass(frozen=True)
class Test:
    """The bar as it is, as drawn, and what its free frequencies and a balance say."""

    __test__ = False

    true: Beam
    drawn: Beam
    nodes: Real
    update: BeamUpdate


@pytest.fixture(scope="module")
def suspended(paper_beam: Beam, bench: Bench) -> Test:
    """A bar two per cent stiffer than drawn, and a little off in size and density."""
    nodes = bench.free_beam.mesh.positions[list(bench.free_beam.mesh.named)]
    true = replace(paper_beam, youngs_modulus=1.02 * 207e9, density=0.998 * 7850.0, height=1.0015 * paper_beam.height)
    frequency = assemble(true, Mesh.through(nodes, 16)).frequency[3:6]
    errors = np.stack([1e-5 * frequency, np.full(3, 1e-5)], axis=1).ravel()
    none = np.zeros(3)
    seen = ElasticModes((4, 5, 6), frequency, np.array(RATIOS), np.diag(errors**2), none, none + 1, (), ())
    weighed = Estimate(true.density * true.area * true.length, 5e-4)
    mesh = Mesh.through(nodes, 8)
    return Test(true, paper_beam, nodes, update_beam(seen, paper_beam, mesh, BeamTolerances(), weighed=weighed))


@pytest.fixture(scope="module")
def material(suspended: Test) -> Material:
    return material_of(suspended.update)


@pytest.fixture(scope="module")
def measured(suspended: Test, bench: Bench) -> FrequencyResponses:
    """The true bar on its joints."""
    free = assemble(suspended.true, Mesh.through(suspended.nodes, 16), damping_ratios=RATIOS)
    exact = accelerance(free, bench.joints, FREQUENCY, Dof.parse("3y"), bench.inputs)
    parts = np.random.default_rng(5).standard_normal((2, *exact.accelerance.shape))
    return replace(
        exact,
        accelerance=exact.accelerance + NOISE * (parts[0] + 1j * parts[1]),
        variance=np.full(exact.accelerance.shape, NOISE**2),
    )


def fitted(suspended: Test, bench: Bench, measured: FrequencyResponses, beam: Beam, tolerances: Tolerances) -> JointFit:
    free = assemble(beam, Mesh.through(suspended.nodes, 12), damping_ratios=RATIOS)
    return identify_from_responses(free, measured, bench.joints, tolerances=tolerances)


def errors(fit: JointFit, bench: Bench) -> tuple[Real, Real]:
    """(4,) relative errors of k12 and k22 of both joints, and half-widths of their intervals."""
    error, half = [], []
    for joint in bench.joints:
        found, true = fit.joints[joint.name], joint.dynamic_stiffness.real
        for place in ((0, 1), (1, 1)):
            error.append(found.stiffness[place] / true[place] - 1)
            half.append(np.ptp(found.k_ci95[place]) / 2 / abs(true[place]))
    return np.array(error), np.array(half)


def test_the_bar_bends_and_weighs_as_the_true_one(suspended: Test, material: Material) -> None:
    true, drawn = suspended.true, suspended.drawn
    bends, weighs = (
        (beam.youngs_modulus * beam.height**3, beam.density * beam.height) for beam in (true, material.of(drawn))
    )
    assert weighs == pytest.approx(bends, rel=2e-4)
    assert material.density.standard_error / material.density.value == pytest.approx(5e-4 / 9.3, rel=0.1)
    # one by one they are known to no more than their tolerances
    assert suspended.update.parameter("density").standard_error > 10 * material.density.standard_error


def test_without_a_balance_modulus_and_density_share_their_error(suspended: Test) -> None:
    update = suspended.update
    seen = np.exp(np.log(update.frequency) + update.misfit)
    covariance = np.kron(np.diag((1e-5 * seen) ** 2), np.diag([1.0, 0.0])) + np.kron(np.eye(3), np.diag([0.0, 1e-10]))
    none = np.zeros(3)
    modes = ElasticModes((4, 5, 6), seen, np.array(RATIOS), covariance, none, none + 1, (), ())
    mesh = Mesh.through(suspended.nodes, 8)
    material = material_of(update_beam(modes, suspended.drawn, mesh, BeamTolerances()))
    relative = material.youngs_modulus.standard_error / material.youngs_modulus.value
    assert 0.003 < relative < 0.01
    assert material.correlation > 0.999


def test_joints_are_right_on_a_bar_two_per_cent_stiffer_than_drawn(
    suspended: Test, material: Material, measured: FrequencyResponses, bench: Bench
) -> None:
    as_stated, _ = errors(fitted(suspended, bench, measured, suspended.drawn, STATED), bench)
    modulus, density = (each.standard_error / each.value for each in (material.youngs_modulus, material.density))
    known = replace(STATED, youngs_modulus=modulus, density=density, material_correlation=material.correlation)
    found, half = errors(fitted(suspended, bench, measured, material.of(suspended.drawn), known), bench)
    assert np.max(np.abs(as_stated)) > 0.005
    assert np.max(np.abs(found)) < 0.001
    assert np.all(np.abs(found) < 1.5 * half)
    assert np.max(half[[1, 3]]) < 0.001  # k22: weighed, the bar is a standard of stiffness, and gain counts no longer
