"""What effects promise before they are fitted to everything."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.gap.effect import Effect
from analysis.gap.effects.beam import AccelerometerMass
from analysis.gap.effects.blow import AllBlows, BlowsAtOnePoint, ImpactAngle
from analysis.gap.effects.joint_amplitude import StickingFriction
from analysis.gap.effects.joint_state import TemperatureShift
from analysis.gap.effects.tester import FrameCompliance, TransducerLag
from analysis.gap.fitting.fit import evaluated, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.search.screening import (
    LARGEST_DERIVATIVE,
    MOST_STARTS,
    ExpectedGain,
    LinearStep,
    best_laws,
    bounded,
    by_gain,
    gain_by_linear_step,
    gain_by_tester_fit,
    inserted,
    plausible,
    starts,
)
from analysis.gap.search.single_effects import search_of
from tests.analysis.gap.conftest import Made

FRICTION = (0.8, 0.3, 0.0, 0.0)
"""Scores: 3 N, in three of ten parts of the stiffness."""


def promised_and_gained(made: Made, effect: Effect, scores: tuple[float, ...]) -> tuple[ExpectedGain, float]:
    """What an effect promises on data that it made, and what its fit then gains."""
    search = search_of(made((effect,), scores), ())
    without = Likelihood(search.simulation())
    before = fit(without.simulation, np.zeros(without.unknowns))
    found = gain_by_linear_step(without, LinearStep.about(without, before.scores), search.simulation((effect,)))
    assert found is not None
    shared = len(without.simulation.shared)
    after = fit(search.simulation((effect,)), inserted(before.scores, shared, found.starts[0]))
    return found, before.at.cost - after.at.cost


def test_one_step_promises_what_a_fit_of_a_small_effect_then_gains(made: Made) -> None:
    found, gained = promised_and_gained(made, AccelerometerMass(), (0.01,))
    assert found.gain == pytest.approx(gained, rel=0.1)


def test_a_second_step_sees_how_a_softening_is_distributed_over_frequency(made: Made) -> None:
    effect = TemperatureShift()
    found, gained = promised_and_gained(made, effect, (0.2, 0.5, 0.0, -2.0, 2.0))
    assert found.gain == pytest.approx(gained, rel=0.2)


def test_the_tester_alone_shows_friction_that_is_far_from_linear(made: Made) -> None:
    effect = StickingFriction()
    search = search_of(made((effect,), FRICTION), ())
    found = gain_by_tester_fit(search.simulation((effect,)))
    lag = gain_by_tester_fit(search.simulation((TransducerLag(),)))
    assert found.gain > 10 * lag.gain
    assert found.starts[0][:2] == pytest.approx(FRICTION[:2], abs=0.05)


def test_what_the_tester_cannot_see_gains_nothing_there(made: Made) -> None:
    search = search_of(made((FrameCompliance(),), (1.0,)), ())
    assert gain_by_tester_fit(search.simulation((AccelerometerMass(),))).gain == pytest.approx(0.0, abs=0.1)
    assert gain_by_tester_fit(search.simulation((FrameCompliance(),))).gain > 50  # gains of configurations take a part


def test_noise_is_inflated_until_a_model_that_does_not_hold_could_be_right(made: Made) -> None:
    search = search_of(made((AccelerometerMass(),), (1.0,)), ())
    exact = Likelihood(search.simulation())
    astray = evaluated(exact, np.zeros(exact.unknowns))
    found = plausible(astray)
    assert found.inflation > 0
    assert found.at(astray.scores).cost < astray.at.cost
    held = fit(search.simulation((AccelerometerMass(),)), np.zeros(exact.unknowns + 1))
    assert plausible(held).inflation == 0.0


def test_a_law_that_promises_little_comes_along_with_its_rivals() -> None:
    friction, mass, lag = StickingFriction(), AccelerometerMass(), TransducerLag()
    rival = replace(friction)
    expected = [
        ExpectedGain(friction, -5.0, ()),
        ExpectedGain(mass, 3.0, ()),
        ExpectedGain(lag, 50.0, ()),
        ExpectedGain(rival, 20.0, ()),
    ]
    assert [each.gain for each in by_gain(expected, 12.0)] == [50.0, 20.0, -5.0]


def test_two_variants_of_each_of_the_best_laws_are_fitted() -> None:
    points = [BlowsAtOnePoint(point=Dof(node, Direction.Y)) for node in (1, 3, 4)]
    ranked = [ExpectedGain(each, 0.0, ()) for each in (*points, ImpactAngle(), AllBlows())]
    assert [each.effect for each in best_laws(ranked, 2)] == [*points[:2], ImpactAngle()]
    assert [each.effect for each in best_laws(ranked, 1)] == points[:1]


def test_starts_are_all_combinations_up_to_a_number() -> None:
    assert len(starts(AccelerometerMass())) == 1
    for effect in (StickingFriction(), FrameCompliance()):
        assert 1 <= len(starts(effect)) <= MOST_STARTS
        assert all(start.size == len(effect.parameters) for start in starts(effect))


@pytest.mark.parametrize("size", [1.0, 1e3, 1e9])
def test_the_gain_of_a_step_is_that_of_least_squares_also_where_large_columns_say_the_same(size: float) -> None:
    chance = np.random.default_rng(3)
    known, left, scores = chance.standard_normal((3, 20)), chance.standard_normal(20), 0.1 * chance.standard_normal(3)
    column, start = size * chance.standard_normal(20), np.array([0.2, -0.1])
    step = LinearStep.of(known, scores, 30.0)
    columns = np.stack([column, column])
    every, at = np.concatenate([known, columns]), np.concatenate([scores, start])
    whole, wanted = np.concatenate([every.T, np.eye(5)]), np.concatenate([left, -at])
    best = np.linalg.lstsq(whole / np.linalg.norm(whole, axis=0), wanted)[0] / np.linalg.norm(whole, axis=0)
    expected = 30.0 - np.sum((wanted - whole @ best) ** 2)
    assert step.with_further(bounded(columns), start, left)[0] == pytest.approx(
        expected, rel=1e-6, abs=1e-2 if size > 1e6 else 0.0
    )


def test_a_step_from_a_model_far_outside_of_what_is_possible_is_finite() -> None:
    """Derivatives of 1e160 overflow in a sum of squares; one that is no number leaves its parameter out."""
    chance = np.random.default_rng(4)
    sizes = np.array([1.0, 1e90, 1e160, np.nan, np.inf])[:, None]
    known, left, scores = sizes * chance.standard_normal((5, 20)), chance.standard_normal(20), np.zeros(5)
    step, column = LinearStep.of(known, scores, float(left @ left)), chance.standard_normal((1, 20))
    possible = LinearStep.of(np.minimum(1e4, sizes[:3]) * known[:3] / sizes[:3], scores[:3], float(left @ left))
    assert step.with_further(column, np.zeros(1), left)[0] == pytest.approx(
        possible.with_further(column, np.zeros(1), left)[0], rel=1e-3
    )


def test_derivatives_are_bounded_in_another_unit_of_their_parameter() -> None:
    columns = np.array([[3.0, -4.0], [3e9, -4e9], [0.0, 0.0]])
    expected = [[3.0, -4.0], [0.75 * LARGEST_DERIVATIVE, -LARGEST_DERIVATIVE], [0.0, 0.0]]
    np.testing.assert_allclose(bounded(columns), expected)
