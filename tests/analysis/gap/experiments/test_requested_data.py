"""What of an experiment is missing in further data: complete ones lack nothing, scatter is none, others are seen."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.gap.experiments.catalogue import CHECKS, EXPERIMENTS, Experiment, FurtherMeasurement
from analysis.gap.experiments.missing_condition import MissingCondition as Condition
from analysis.gap.experiments.requested_data import Compared, Missing, Mounting, compared
from analysis.gap.measurement import Configuration, HammerSet, Measurement, TesterPoints

PLANNED = {each.id: each.planned for each in EXPERIMENTS if isinstance(each, FurtherMeasurement)}


@pytest.fixture
def first(empty: Measurement) -> Measurement:
    """A measurement struck with 100 and 400 N and tested at random, at ten frequencies a series."""
    grid = np.array([(s, c, a, f) for s in (0, 1) for c in (0, 1, 2) for a in (5e-6, 5e-5) for f in range(20, 220, 20)])
    size = len(grid)
    points = TesterPoints(
        np.random.default_rng(1).permutation(size).astype(float), grid[:, 0].astype(np.intp),
        grid[:, 1].astype(np.intp), grid[:, 2], grid[:, 3], np.ones(size, dtype=complex), np.ones(size), np.ones(size),
    )  # fmt: skip
    return replace(empty, points=points)


def of(first: Measurement, asked: Experiment) -> Measurement:
    """Just what is asked for."""
    found = PLANNED[asked](first)
    assert found is not None
    return found


def points_of(measurement: Measurement) -> TesterPoints:
    assert measurement.points is not None
    return measurement.points


def struck(measurement: Measurement, *forces: float, inputs: tuple[Dof, ...] | None = None) -> Measurement:
    """Its first set with other forces, maybe at other points."""
    one = measurement.sets[0]
    one = one if inputs is None else one.struck_at(inputs, one.frequency)
    return replace(measurement, sets=tuple(replace(one, peak_force=each) for each in forces), points=None)


def with_points(measurement: Measurement, points: TesterPoints) -> Measurement:
    return replace(measurement, sets=(), points=points)


@pytest.mark.parametrize("asked", PLANNED)
def test_what_was_asked_for_lacks_nothing(first: Measurement, asked: Experiment) -> None:
    assert compared(asked, first, of(first, asked)) == Compared()


def test_readings_and_what_the_first_data_do_not_allow_are_not_compared(first: Measurement) -> None:
    for asked in (*CHECKS, Experiment.NOTHING, Experiment.NEW_SET_UP):
        assert compared(asked, first, first) == Compared()
    assert compared(Experiment.HALF_AMPLITUDE, replace(first, points=None), first) == Compared()


@pytest.mark.parametrize("asked", [Experiment.HALF_FORCE, Experiment.HALF_AMPLITUDE, Experiment.OTHER_LEVELS,
                                   Experiment.HIGHER_FREQUENCY])  # fmt: skip
def test_the_first_measurement_again_is_nothing_of_it(first: Measurement, asked: Experiment) -> None:
    assert compared(asked, first, first).nothing


def test_the_other_rig_alone_is_nothing_of_it(first: Measurement) -> None:
    tester, beam = replace(first, sets=()), replace(first, points=None)
    assert compared(Experiment.HALF_FORCE, first, tester) == Compared((Missing(Condition.HAMMER_SET),), nothing=True)
    for asked in (Experiment.HALF_AMPLITUDE, Experiment.RANDOM_ORDER, Experiment.HIGHER_FREQUENCY):
        assert compared(asked, first, beam) == Compared((Missing(Condition.TESTER_POINTS),), nothing=True)


@pytest.mark.parametrize(
    ("force", "missing", "nothing"),
    [(58.0, False, False), (38.0, False, False), (68.0, True, False), (20.0, True, False), (80.0, True, True)],
)
def test_a_force_may_miss_by_a_third_and_counts_while_it_is_nearer_to_the_wanted_one(
    first: Measurement, force: float, missing: bool, nothing: bool
) -> None:
    found = compared(Experiment.HALF_FORCE, first, struck(first, force))
    assert found == Compared((Missing(Condition.FORCE, 50.0, force),) if missing else (), nothing)


def test_points_that_were_not_struck_at_the_level_are_named(first: Measurement) -> None:
    inputs = first.sets[0].inputs
    soft = struck(first, 50.0, inputs=inputs[:2])
    both = replace(soft, sets=(*soft.sets, first.sets[0]))  # the others at the former level
    assert compared(Experiment.HALF_FORCE, first, both) == Compared((Missing(Condition.POINTS, points=inputs[2:]),))
    elsewhere = struck(first, 50.0, inputs=(Dof.parse("9y"),))
    assert compared(Experiment.HALF_FORCE, first, elsewhere) == Compared(
        (Missing(Condition.POINTS, points=inputs),), True
    )


def test_lines_that_end_far_below_are_missing(first: Measurement) -> None:
    def until(line: float) -> Measurement:
        def cut(each: HammerSet) -> HammerSet:
            return each.lines(each.frequency <= line)

        soft = struck(first, 50.0)
        return replace(soft, sets=tuple(map(cut, soft.sets)))

    assert compared(Experiment.HALF_FORCE, first, until(400.0)) == Compared()
    assert compared(Experiment.HALF_FORCE, first, until(200.0)) == Compared(
        (Missing(Condition.HIGHEST_LINE, 516.0, 200.0),)
    )


def test_any_level_that_is_new_is_another_one(first: Measurement) -> None:
    for force in (200.0, 800.0, 40.0):
        found = compared(Experiment.OTHER_LEVELS, first, struck(first, 100.0, force))
        assert found == Compared((Missing(Condition.TESTER_POINTS),))  # what was struck is useful alone
    found = compared(Experiment.OTHER_LEVELS, first, struck(first, 104.0, 380.0))
    assert found == Compared((Missing(Condition.FORCE, None, 380.0), Missing(Condition.TESTER_POINTS)), nothing=True)
    between = replace(points_of(first), amplitude=np.full(points_of(first).order.size, 1.6e-5))
    assert compared(Experiment.OTHER_LEVELS, first, replace(struck(first, 200.0), points=between)) == Compared()


def test_an_amplitude_is_missing_in_a_mounting_or_altogether(first: Measurement) -> None:
    half = points_of(of(first, Experiment.HALF_AMPLITUDE))
    some = half.only((half.specimen == 0) | (half.configuration != Configuration.SHEAR))
    shear = Missing(Condition.MOUNTINGS, mountings=(Mounting("II", Configuration.SHEAR),))
    assert compared(Experiment.HALF_AMPLITUDE, first, with_points(first, some)) == Compared((shear,))
    tiny = with_points(first, replace(half, amplitude=half.amplitude / 2))
    assert compared(Experiment.HALF_AMPLITUDE, first, tiny) == Compared(
        (Missing(Condition.AMPLITUDE, 2.5e-6, 1.25e-6),)
    )
    same = with_points(first, replace(half, amplitude=1.9 * half.amplitude))
    found = compared(Experiment.HALF_AMPLITUDE, first, same)
    assert found == Compared(
        (Missing(Condition.AMPLITUDE, 2.5e-6, float(np.min(points_of(same).amplitude))),), nothing=True
    )


def test_a_range_of_frequency_may_end_a_third_early(first: Measurement) -> None:
    half, higher = (points_of(of(first, each)) for each in (Experiment.HALF_AMPLITUDE, Experiment.HIGHER_FREQUENCY))
    upper, lower = half.only(half.frequency > 50.0), half.only(half.frequency < 130.0)
    for points, missing in (
        (upper, Missing(Condition.LOWEST_FREQUENCY, 20.0, 60.0)),
        (lower, Missing(Condition.HIGHEST_FREQUENCY, 200.0, 120.0)),
    ):
        assert compared(Experiment.HALF_AMPLITUDE, first, with_points(first, points)) == Compared((missing,))
    for highest, lacks, nothing in ((280.0, [], False), (240.0, [240.0], False), (200.0, [200.0], True)):
        points = replace(higher, frequency=higher.frequency * highest / np.max(higher.frequency))
        found = compared(Experiment.HIGHER_FREQUENCY, first, with_points(first, points))
        assert [each.what for each in found.missing] == [Condition.HIGHEST_FREQUENCY] * len(lacks)
        assert ([each.measured for each in found.missing], found.nothing) == (lacks, nothing)


def rising(points: TesterPoints) -> TesterPoints:
    """One series after the other, each from the lowest frequency up."""
    rank = np.lexsort((points.frequency, points.amplitude, points.configuration, points.specimen))
    return replace(points, order=np.argsort(rank).astype(float))


def grouped(points: TesterPoints) -> TesterPoints:
    """One series after the other, each in random order, as a sweep is shuffled."""
    chance = np.random.default_rng(5).random(points.order.size)
    rank = np.lexsort((chance, points.amplitude, points.configuration, points.specimen))
    return replace(points, order=np.argsort(rank).astype(float))


@pytest.mark.parametrize(("order", "nothing"), [(rising, True), (grouped, False), (lambda points: points, True)])
def test_a_rising_order_and_the_former_one_are_not_random(
    first: Measurement, order: Callable[[TesterPoints], TesterPoints], nothing: bool
) -> None:
    found = compared(Experiment.RANDOM_ORDER, first, with_points(first, order(points_of(first))))
    assert found == Compared((Missing(Condition.RANDOM_ORDER),) if nothing else (), nothing)


def test_few_points_are_in_order_by_chance(first: Measurement) -> None:
    few = points_of(first)
    few = rising(few.only((few.frequency < 90.0) & (few.specimen == 0) & (few.configuration == 0)))
    assert not compared(Experiment.RANDOM_ORDER, first, with_points(first, few)).nothing
