"""Model and derivatives together: every derivative against differences of the model, the model against another one."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.inverse.regression import UPPER
from analysis.inverse.response_jacobian import deviation_columns, term_columns
from analysis.inverse.response_model import ResponseModel
from analysis.inverse.tolerances import Deviations
from analysis.structure.beam import Beam, Mesh, assemble
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

BEAM = Beam(0.914, 0.0254, 0.0507874, 207e9, 0.3, 7850.0)
INPUTS = tuple(map(Dof.parse, ["1y", "3y", "5y", "8y", "11x"]))
SIZES = np.array([0.02, 0.01, 0.01, 1e-3])  # of gain, E, rho and the accelerometer's position
STENCIL = (4 / 5, -1 / 5, 4 / 105, -1 / 280)  # eighth order


@dataclass(frozen=True)
class Case:
    model: ResponseModel
    stiffness: Complex
    deviations: Deviations

    def accelerance(self, stiffness: Complex, values: Real) -> Complex:
        return self.model.condensed(Deviations(values, len(stiffness))).evaluate_on(stiffness).accelerance

    def along(self, stiffness: Complex, values: Real, size: float) -> Complex:
        return self.accelerance(self.stiffness + size * stiffness, self.deviations.values + size * values)


@st.composite
def cases(draw: st.DrawFn) -> Case:
    gaps = np.array(draw(st.lists(st.floats(0.6, 1.6), min_size=10, max_size=10)))
    positions = np.concatenate([[0.0], np.cumsum(gaps) / np.sum(gaps) * BEAM.length])
    positions[-1] = BEAM.length
    nodes = draw(st.sampled_from([(2, 10), (3, 8), (6,), (2, 6, 10)]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    damping = draw(st.floats(0.002, 0.02))
    free = assemble(BEAM, Mesh.through(positions, draw(st.integers(2, 4))), damping_ratios=3 * [damping])
    lever = np.array([1.0, 1.0, 0.1])
    stiffness = []
    for _ in nodes:
        k, h = (factor @ factor.T + 0.3 * np.eye(3) for factor in rng.standard_normal((2, 3, 3)))
        stiffness.append(50 * BEAM.stiffness_unit * np.outer(lever, lever) * (k + 0.15j * h))
    model = ResponseModel(free, nodes, Dof.parse("3y"), INPUTS, np.linspace(20.3, 1024.0, 40))
    joints = np.repeat([1e-3, 0.1, 0.5, 1.0, 0.7], len(nodes))  # positions and laws
    sizes = np.concatenate([SIZES, joints, np.repeat([1.5e-3, 0.02], len(INPUTS))])
    return Case(model, np.array(stiffness), Deviations(sizes * rng.uniform(-1, 1, sizes.size), len(nodes)))


def difference(function: Callable[[float], Complex], step: float) -> Complex:
    ahead = [function((place + 1) * step) - function(-(place + 1) * step) for place in range(len(STENCIL))]
    return np.asarray(np.tensordot(STENCIL, ahead, axes=1) / step)


def assert_same(found: Complex, expected: Complex) -> None:
    assert np.max(np.abs(found - expected)) < 1e-6 * np.max(np.abs(expected))


@settings(max_examples=10, deadline=None)
@given(case=cases())
def test_derivatives_in_joint_terms_are_exact(case: Case) -> None:
    values, z = case.deviations.values, case.stiffness
    columns = term_columns(case.model.condensed(case.deviations).evaluate_on(z))
    for joint in range(len(z)):
        size = np.sqrt(np.abs(np.diag(z[joint])))
        for place, (p, q) in enumerate(UPPER):
            unit = np.zeros_like(z)
            unit[joint, [p, q], [q, p]] = 1.0
            step = 2e-4 * size[p] * size[q]
            expected = difference(partial(case.along, unit, np.zeros_like(values)), step)
            assert_same(columns[len(UPPER) * joint + place], expected)


@settings(max_examples=10, deadline=None)
@given(case=cases())
def test_derivatives_in_all_deviations_of_the_bench_are_exact(case: Case) -> None:
    values, z = case.deviations.values, case.stiffness
    beside = case.deviations.blow_positions[INPUTS.index(case.model.response)] - case.deviations.sensor_position
    assume(abs(beside) > 5e-4)  # nearer, the beam bends over less than the step of a difference
    active = np.ones(values.size, dtype=bool)
    columns = deviation_columns(case.model.condensed(case.deviations).evaluate_on(z), active)
    for place, column in enumerate(columns):
        unit = np.eye(values.size)[place]
        step = 5e-5 if place < 3 else 1e-4
        assert_same(column, difference(partial(case.along, np.zeros_like(z), unit), step))


@settings(max_examples=10, deadline=None)
@given(case=cases())
def test_k_and_modulus_and_density_and_gain_scale_out_together(case: Case) -> None:
    """No data can tell them apart; derivatives that are not exact would pretend so."""
    response = case.model.condensed(case.deviations).evaluate_on(case.stiffness)
    joint_terms = np.array([z[place] for z in case.stiffness for place in UPPER])
    scaling = np.tensordot(joint_terms, term_columns(response), axes=1)
    active = np.arange(case.deviations.values.size) < 3
    scaling += np.tensordot(1 + case.deviations.values[:3], deviation_columns(response, active), axes=1)
    assert np.max(np.abs(scaling)) < 1e-10 * np.max(np.abs(response.accelerance))


@settings(max_examples=10, deadline=None)
@given(case=cases())
def test_a_bench_as_drawn_answers_as_the_forward_prediction(case: Case) -> None:
    model = case.model
    joints = [Joint(str(n), node, z) for n, (node, z) in enumerate(zip(model.joint_nodes, case.stiffness, strict=True))]
    expected = accelerance(model.free_beam, joints, model.frequency, model.response, model.inputs).accelerance
    found = case.accelerance(case.stiffness, np.zeros_like(case.deviations.values))
    assert np.max(np.abs(found - expected)) < 1e-9 * np.max(np.abs(expected))


@settings(max_examples=8, deadline=None)
@given(case=cases(), modulus=st.floats(-0.02, 0.02), density=st.floats(-0.02, 0.02))
def test_modulus_and_density_act_as_on_a_beam_assembled_with_them(case: Case, modulus: float, density: float) -> None:
    free = case.model.free_beam
    own = replace(
        free.beam,
        youngs_modulus=free.beam.youngs_modulus * (1 + modulus),
        density=free.beam.density * (1 + density),
    )
    ratios = 3 * [float(free.damping_rate[3] / (2 * np.sqrt(free.squared_frequency[3])))]
    other = replace(case.model, free_beam=assemble(own, free.mesh, damping_ratios=ratios))
    none = np.zeros_like(case.deviations.values)
    off = none.copy()
    off[1:3] = modulus, density
    expected = replace(case, model=other).accelerance(case.stiffness, none)
    found = case.accelerance(case.stiffness, off)
    assert np.max(np.abs(found - expected)) < 1e-7 * np.max(np.abs(expected))


def test_a_joint_beside_its_node_acts_as_one_at_a_node_there() -> None:
    positions = np.linspace(0.0, BEAM.length, 11)
    frequency = np.linspace(20.3, 1024.0, 40)
    z = np.array([50 * BEAM.stiffness_unit * np.diag([1.0, 1.0, 0.01]) * (1 + 0.1j)] * 2)

    def answer(at: NDArray[np.float64], joint_off: float) -> Complex:
        free = assemble(BEAM, Mesh.through(at, 6), damping_ratios=(0.004, 0.001, 0.001))
        model = ResponseModel(free, (2, 10), Dof.parse("4y"), INPUTS, frequency)
        values = np.zeros(4 + 5 * 2 + 2 * len(INPUTS))
        values[4] = joint_off
        return model.condensed(Deviations(values, 2)).evaluate_on(z).accelerance

    moved = positions.copy()
    moved[1] += 0.001
    expected, effect = answer(moved, 0.0), answer(positions, 0.0)
    found = answer(positions, 0.001)
    assert np.max(np.abs(found - expected)) < 0.01 * np.max(np.abs(effect - expected))


@pytest.mark.parametrize("beside", [0.002, -0.002])
def test_a_blow_beside_the_accelerometer_meets_the_kink_that_it_makes(beside: float) -> None:
    positions = np.linspace(0.0, BEAM.length, 11)
    frequency = np.linspace(20.3, 2000.0, 40)
    z = np.array([50 * BEAM.stiffness_unit * np.diag([1.0, 1.0, 0.01]) * (1 + 0.1j)] * 2)
    moved = np.sort(np.append(positions, positions[3] + beside))
    here, there = (5, 4) if beside < 0 else (4, 5)  # of the accelerometer, and of a node where the blow falls
    free = assemble(BEAM, Mesh.through(moved, 32), damping_ratios=(0.004, 0.001, 0.001))
    joints = [Joint("I", 2, z[0]), Joint("II", 11, z[1])]
    exact = accelerance(free, joints, frequency, Dof(here, Direction.Y), [Dof(there, Direction.Y)]).accelerance

    own = assemble(BEAM, Mesh.through(positions, 32), damping_ratios=(0.004, 0.001, 0.001))
    model = ResponseModel(own, (2, 10), Dof.parse("4y"), (Dof.parse("4y"),), frequency)
    values = np.zeros(4 + 5 * 2 + 2)
    values[14] = beside
    deviations = Deviations(values, 2)
    found = model.condensed(deviations).evaluate_on(z).accelerance
    kink = model.kinks(deviations)[1] * (2 * np.pi * frequency) ** 2
    assert np.max(np.abs(found - exact)) < 0.1 * np.max(np.abs(kink))


def test_lines_at_zero_and_joints_at_one_node_are_refused() -> None:
    free = assemble(BEAM, Mesh.through(np.linspace(0.0, BEAM.length, 11)))
    with pytest.raises(AnalysisError, match="above 0 Hz"):
        ResponseModel(free, (2, 10), Dof.parse("3y"), INPUTS, np.array([0.0, 1.0]))
    with pytest.raises(AnalysisError, match="node of its own"):
        ResponseModel(free, (2, 2), Dof.parse("3y"), INPUTS, np.array([1.0]))
    with pytest.raises(AnalysisError, match="no node 12"):
        ResponseModel(free, (2, 12), Dof.parse("3y"), INPUTS, np.array([1.0]))
