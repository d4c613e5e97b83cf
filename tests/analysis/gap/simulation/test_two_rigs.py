"""One simulation of both rigs, with derivatives that can be trusted."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.frequency_response import Complex
from analysis.gap.catalogue import candidates, law_free
from analysis.gap.effects.measuring_chain import ExponentialWindow
from analysis.gap.fitting.likelihood import BLOW_AT_POINT, BLOW_OF_ROW, Likelihood
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.rivals import rivals_of
from analysis.gap.simulation.baseline import baseline_of
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from analysis.gap.simulation.simulation_state import Prediction
from analysis.gap.simulation.two_rigs import Simulation
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint
from tests.analysis.gap.conftest import simulation_of

ROUNDED = 3e-5
"""Share of a derivative by which a difference may be off: steps are finite, and the sum of high modes is interpolated
over frequency."""
ROUNDING = 5e-8
"""Norm of the rounding of the derivatives of readings that are about one, whose steps are 1e-7."""


def numeric(likelihood: Likelihood, scores: np.ndarray, place: int, step: float) -> np.ndarray:
    """Central difference of all that both rigs read, (data,) complex."""
    found = []
    for sign in (1, -1):
        at = scores.copy()
        at[place] += sign * step
        predicted = likelihood.predict(at, derivatives=())
        found.append(np.concatenate([*(each.ravel() for each in predicted.accelerances), predicted.stiffness * 1e-6]))
    return np.asarray((found[0] - found[1]) / (2 * step))


def analytic(predicted: Prediction, place: int) -> np.ndarray:
    """The same from the derivatives of one prediction, which has those in all parameters."""
    columns = [by[place].ravel() for by in predicted.by_shared]
    return np.concatenate([*columns, predicted.stiffness_by_shared[place] * 1e-6])


def test_derivatives_of_the_baseline_are_exact(empty: Measurement) -> None:
    simulation = simulation_of(empty)
    likelihood = Likelihood(simulation)
    scores = 0.3 * np.random.default_rng(1).standard_normal(likelihood.unknowns)
    predicted = likelihood.predict(scores)
    for place, parameter in enumerate(simulation.shared):
        # two steps of a difference, the error of which falls with the fourth power
        difference = (4 * numeric(likelihood, scores, place, 5e-4) - numeric(likelihood, scores, place, 1e-3)) / 3
        exact = analytic(predicted, place)
        assert np.linalg.norm(difference - exact) < 2e-6 * np.linalg.norm(exact) + ROUNDING, parameter.name


def test_derivatives_in_the_stiffness_after_each_set_up_are_exact(empty: Measurement) -> None:
    likelihood = Likelihood(simulation_of(empty))
    scores = 0.3 * np.random.default_rng(1).standard_normal(likelihood.unknowns)
    predicted = likelihood.predict(scores)
    for number, (_, *joints) in enumerate(likelihood.setups):
        for joint, place in enumerate(joints):
            difference = numeric(likelihood, scores, place, 1e-3)
            exact = [np.zeros_like(each) for each in predicted.accelerances]
            exact[number] = predicted.by_setup[number][joint]
            whole = np.concatenate([*(each.ravel() for each in exact), np.zeros_like(predicted.stiffness)])
            assert np.linalg.norm(difference - whole) < 1e-6 * np.linalg.norm(whole)


def test_derivatives_in_offset_and_lean_of_the_blows_of_each_row_are_exact(empty: Measurement) -> None:
    likelihood = Likelihood(simulation_of(empty))
    scores = 0.3 * np.random.default_rng(1).standard_normal(likelihood.unknowns)
    predicted, rows = likelihood.predict(scores), len(empty.sets[1].inputs)
    for row in range(rows):
        for which, place in enumerate(likelihood.blow_of_row(1, row)):
            difference = numeric(likelihood, scores, place, 5e-4)
            exact = [np.zeros_like(each) for each in predicted.accelerances]
            exact[1][row] = BLOW_OF_ROW * predicted.by_blow[1][which, row]
            whole = np.concatenate([*(each.ravel() for each in exact), np.zeros_like(predicted.stiffness)])
            assert np.linalg.norm(difference - whole) < ROUNDED * np.linalg.norm(whole), (row, which)


def test_what_blows_at_a_point_have_in_common_moves_the_rows_of_all_sets(empty: Measurement) -> None:
    likelihood = Likelihood(simulation_of(empty))
    scores = 0.3 * np.random.default_rng(1).standard_normal(likelihood.unknowns)
    predicted = likelihood.predict(scores)
    for point in empty.sets[0].inputs:
        for which, place in enumerate(likelihood.blow_at_point(point)):
            difference = numeric(likelihood, scores, place, 5e-4)
            exact = [np.zeros_like(each) for each in predicted.accelerances]
            for number, each in enumerate(empty.sets):
                row = each.inputs.index(point)
                exact[number][row] = BLOW_AT_POINT * predicted.by_blow[number][which, row]
            whole = np.concatenate([*(each.ravel() for each in exact), np.zeros_like(predicted.stiffness)])
            assert np.linalg.norm(difference - whole) < ROUNDED * np.linalg.norm(whole), (point, which)


def struck(empty: Measurement, inputs: tuple[str, ...], offset: float = 0.0, lean: float = 0.0) -> Complex:
    """(rows, lines) accelerance of the baseline, every row struck `offset` m beside its mark and `lean` rad off."""
    one = replace(empty, sets=(empty.sets[0].struck_at(tuple(map(Dof.parse, inputs)), empty.sets[0].frequency),))
    likelihood = Likelihood(simulation_of(one))
    scores = np.zeros(likelihood.unknowns)
    for row in range(len(inputs)):
        sizes = one.tolerances.impact_position, likelihood.scales.blow_lean
        scores[list(likelihood.blow_of_row(0, row))] = np.array([offset, lean]) / sizes / BLOW_OF_ROW
    return likelihood.predict(scores, ()).accelerances[0]


def test_a_blow_above_the_axis_of_an_end_face_is_one_on_it_with_a_couple(empty: Measurement) -> None:
    """A couple is a pair of opposite blows across the beam, a little apart."""
    height, apart = 1e-3, 1e-5
    straight, above = (struck(empty, ("1x",), offset)[0] for offset in (0.0, height))
    right, left = (struck(empty, ("1y",), offset)[0] for offset in (apart, -apart))
    couple = (right - left) / (2 * apart)
    assert np.linalg.norm(above - straight + height * couple) < 1e-3 * np.linalg.norm(height * couple)


def test_a_blow_that_leans_is_its_part_across_and_its_part_along(empty: Measurement) -> None:
    across, along = (struck(empty, (point,))[0] for point in ("1y", "1x"))
    lean = 0.02
    assert np.allclose(struck(empty, ("1y",), lean=lean)[0], np.cos(lean) * across + np.sin(lean) * along)
    assert np.allclose(struck(empty, ("1x",), lean=lean)[0], np.cos(lean) * along + np.sin(lean) * across)


def test_derivatives_of_every_effect_are_exact(empty: Measurement) -> None:
    sets = tuple(each.lines(np.arange(2, each.frequency.size, 9)) for each in empty.sets)
    baseline, modes = baseline_of(replace(empty, sets=sets)), beam_modes_of(empty.drawing)
    rivals = rivals_of(empty)
    every = (*candidates(empty), *law_free(empty), *rivals)
    own, laws = len(baseline.parameters), {type(each): each for each in every}
    for effect in laws.values():  # of variants, which differ in joint or row, the last
        simulation = Simulation(baseline, modes, (effect,))
        likelihood = Likelihood(simulation)
        scores = 0.2 * np.random.default_rng(2).standard_normal(likelihood.unknowns)
        predicted = likelihood.predict(scores)
        for place in range(own, len(simulation.shared)):
            difference = (4 * numeric(likelihood, scores, place, 5e-4) - numeric(likelihood, scores, place, 1e-3)) / 3
            exact = analytic(predicted, place)
            error = np.linalg.norm(difference - exact)
            # a slider sticks or slides, with a kink between; steps of curves of a few tenths of a per cent are rounded
            rounded = effect.law_free or any(each.height for each in effect.parameters)
            within = 1e-2 if effect.id == "coulomb_friction" else 1e-4 if rounded else ROUNDED
            assert error < within * np.linalg.norm(exact) + ROUNDING, (effect.id, simulation.shared[place].name)


def test_the_baseline_is_the_forward_model_of_the_beam(empty: Measurement) -> None:
    simulation = simulation_of(empty)
    scores = np.zeros(Likelihood(simulation).unknowns)
    values = simulation.values(scores[: len(simulation.shared)].tolist())
    bench = simulation.joints(values, simulation.groups[0].setting, np.zeros(1, dtype=complex), np.ones((1, 2)))
    joints = [Joint(each.name, each.node, bench[0, 0, place]) for place, each in enumerate(empty.drawing.joints)]
    free = simulation.modes.free
    undamped = Simulation(simulation.baseline, type(simulation.modes)(free, np.zeros_like(free.squared_frequency)))
    predicted = Likelihood(undamped).predict(scores, derivatives=()).accelerances[0]
    each = empty.sets[0]
    expected = accelerance(free, joints, each.frequency, empty.drawing.accelerometer, each.inputs).accelerance
    assert np.max(np.abs(predicted - expected)) < 1e-6 * np.max(np.abs(expected))


def test_derivatives_without_those_of_set_ups_and_rows_are_the_same(empty: Measurement) -> None:
    modes, shown = beam_modes_of(empty.drawing), {"joint_mass", "amplitude_dependence"}
    for effect in {each.id: each for each in candidates(empty) if each.id in shown}.values():
        likelihood = Likelihood(Simulation(baseline_of(empty), modes, (effect,)))
        scores = np.full(likelihood.unknowns, 0.1)
        whole, shared = likelihood.predict(scores, (0, 3)), likelihood.predict(scores, (0, 3), own=False)
        for one, other in zip(whole.by_shared, shared.by_shared, strict=True):
            assert np.array_equal(one, other)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_scale_of_stiffness_density_and_gain_cancels(empty: Measurement, scale: float) -> None:
    """All stiffness, E and density times one factor divide accelerances by it: absolute scale is not observable."""
    simulation = simulation_of(empty)
    names = [parameter.name for parameter in simulation.shared]
    once, scaled = np.zeros((2, Likelihood(simulation).unknowns))
    for place, parameter in enumerate(simulation.shared):
        if parameter.name.startswith(("a(", "b(", "c(")):
            scaled[place] = np.log(scale) / parameter.spread
        if parameter.name in ("modulus", "density"):
            scaled[place] = (scale - 1) / parameter.spread
    first, second = (
        Likelihood(simulation).predict(scores, derivatives=()).accelerances[0] for scores in (once, scaled)
    )
    assert "mesh" in names
    assert np.allclose(first, scale * second, rtol=1e-9, atol=0)


def test_an_effect_without_size_changes_nothing(empty: Measurement) -> None:
    baseline, modes = baseline_of(empty), beam_modes_of(empty.drawing)
    plain = Simulation(baseline, modes)
    reference = Likelihood(plain).predict(np.zeros(Likelihood(plain).unknowns), derivatives=())
    for effect in candidates(empty):
        if any(parameter.positive or parameter.centre for parameter in effect.parameters):
            continue
        simulation = Simulation(baseline, modes, (effect,))
        same = Likelihood(simulation).predict(np.zeros(Likelihood(simulation).unknowns), derivatives=())
        assert np.allclose(same.stiffness, reference.stiffness, rtol=1e-12, atol=0), effect.id
        for own, plain_one in zip(same.accelerances, reference.accelerances, strict=True):
            assert np.allclose(own, plain_one, rtol=1e-10, atol=0), effect.id


def test_records_decay_by_the_window_that_was_stated_and_by_one_that_was_not(empty: Measurement) -> None:
    first, *rest = empty.sets
    stated = replace(empty, sets=(replace(first, decay=2.0), *rest))
    (window,) = ExponentialWindow.variants(stated)
    simulation = simulation_of(stated, window)
    scores = np.zeros(Likelihood(simulation).unknowns)
    assert simulation.decays(scores) == pytest.approx([2.0, *(each.decay for each in rest)])
    scores[len(simulation.shared) - 1] = 0.5
    own = window.parameters[0].value(0.5)
    assert simulation.decays(scores) == pytest.approx([2.0 + own, *(each.decay + own for each in rest)])
