"""Joints or readings that differ by row or by set: the right response, and no cause of the catalogue."""

from dataclasses import replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Effect
from analysis.gap.effects.joint_amplitude import CubicStiffness
from analysis.gap.effects.measuring_chain import ChannelDelay
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import UNKNOWN, Weighed, leading, weigh
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.row_change import (
    OF_A_PHASE,
    OF_A_READING,
    ChangeByRow,
    ChangeBySet,
    ReadingByRow,
    ReadingBySet,
    changes_of_rows,
)
from analysis.gap.search.forward_selection import selected
from tests.analysis.gap.conftest import INPUTS, Made, search_among, simulation_of

CATALOGUE = {"cubic_stiffness", "temperature_shift", "channel_delay"}
LINES, FEWER_LINES = 42, 31
"""Of each set, at least: fewer where effects of amplitude, which take long, are tried beside a delay."""


def verdict_on(measurement: Measurement, lines: int = LINES) -> Weighed[Model]:
    search = replace(search_among(measurement.thinned(lines), CATALOGUE), rivals=changes_of_rows(measurement))
    none = search.fit_paper_model()
    rivals = search.fitted_everywhere(none, search.rivals, known=[none])
    return leading(weigh(none, [*selected(search, none, UNCALIBRATED), *rivals], UNCALIBRATED))


def test_joints_that_soften_while_points_are_struck_are_in_no_catalogue(made: Made, empty: Measurement) -> None:
    softer = tuple(np.linspace(0.4, -0.4, len(INPUTS)).tolist())
    verdict = verdict_on(made((ChangeByRow.variants(empty)[0],), softer))
    assert verdict.effects == UNKNOWN
    assert type(verdict.model.effects[0]) is ChangeByRow


def test_readings_that_drift_while_points_are_struck_are_in_no_catalogue(made: Made, empty: Measurement) -> None:
    rising = tuple(np.linspace(-1.0, 1.0, len(INPUTS)).tolist())
    verdict = verdict_on(made((ReadingByRow.variants(empty)[0],), rising))
    assert verdict.effects == UNKNOWN
    assert type(verdict.model.effects[0]) is ReadingByRow


def test_a_joint_that_settles_between_two_sets_is_in_no_catalogue(made: Made, empty: Measurement) -> None:
    verdict = verdict_on(made((ChangeBySet.variants(empty)[0],), (1.0, 0.0)))
    assert verdict.effects == UNKNOWN
    assert type(verdict.model.effects[0]) is ChangeBySet


def test_a_phase_that_is_off_in_one_set_is_in_no_catalogue(made: Made, empty: Measurement) -> None:
    verdict = verdict_on(made((ReadingBySet(len(empty.sets)),), (0.0, 1.0, 0.0)), FEWER_LINES)
    assert verdict.effects == UNKNOWN
    assert type(verdict.model.effects[0]) is ReadingBySet


def test_a_delay_is_named_although_it_is_a_phase(made: Made) -> None:
    assert verdict_on(made((ChannelDelay(),), (0.5,))).effects == ("channel_delay",)


def test_an_effect_of_amplitude_is_named_although_its_joints_differ_from_row_to_row(made: Made) -> None:
    assert verdict_on(made((CubicStiffness(),), (0.8,))).effects == ("cubic_stiffness",)


def joints_of(empty: Measurement, effect: Effect, scores: list[float]) -> Real:
    """(states,) stiffness of the second joint across the beam, over that without the effect."""
    found = []
    for own in (scores, [0.0] * len(scores)):
        simulation = simulation_of(empty, effect)
        setting = simulation.groups[0].setting
        values = simulation.values([*([0.0] * len(simulation.baseline.parameters)), *own])
        states = np.ones((int(np.max(setting.state)) + 1, 2))
        found.append(simulation.joints(values, setting, np.zeros(1, dtype=complex), states)[:, 0, 1, 1, 1])
    return np.asarray((found[0] / found[1]).real)


def test_each_row_of_the_concerned_sets_has_the_share_of_its_point(empty: Measurement) -> None:
    shares, rows = list(range(len(INPUTS))), len(INPUTS)
    of_one = next(each for each in ChangeByRow.variants(empty) if each.sets == (1,))
    found = joints_of(empty, of_one, [float(each) for each in shares])
    np.testing.assert_allclose(found, [*[1.0] * rows, *(1 + 0.1 * np.array(shares))])


def readings_of(empty: Measurement, effect: Effect, scores: list[float]) -> list[Complex]:
    """(rows, lines) readings of each set, over those without the effect."""
    found = []
    for own in (scores, [0.0] * len(scores)):
        simulation = simulation_of(empty, effect)
        likelihood = Likelihood(simulation)
        unknowns = np.zeros(likelihood.unknowns)
        shared = len(simulation.baseline.parameters)
        unknowns[shared : shared + len(own)] = own
        found.append(likelihood.predict(unknowns, ()).accelerances)
    return [more / plain for more, plain in zip(*found, strict=True)]


def test_the_readings_of_the_concerned_sets_alone_have_the_share_of_their_point(empty: Measurement) -> None:
    of_one = next(each for each in ReadingByRow.variants(empty) if each.sets == (1,))
    scores = [float(each) for each in range(len(INPUTS))]
    first, second = readings_of(empty, of_one, scores)
    np.testing.assert_allclose(first, 1.0)
    np.testing.assert_allclose(second, (1 + OF_A_READING * np.array(scores))[:, None] * np.ones(second.shape))


def test_each_set_has_its_phase_and_the_second_another_gain(empty: Measurement) -> None:
    first, second = readings_of(empty, ReadingBySet(len(empty.sets)), [1.0, -2.0, 3.0])
    np.testing.assert_allclose(first, np.exp(1j * OF_A_PHASE))
    np.testing.assert_allclose(second, (1 + 3 * OF_A_READING) * np.exp(-2j * OF_A_PHASE))


def test_a_set_has_the_share_of_each_of_its_joints(empty: Measurement) -> None:
    found = joints_of(empty, ChangeBySet.variants(empty)[0], [3.0, 2.0])
    np.testing.assert_allclose(found, [1.0, 1.1])


def test_nothing_is_sought_where_no_beam_was_struck_nor_joints_compared_where_there_is_one_set(
    empty: Measurement,
) -> None:
    assert changes_of_rows(replace(empty, sets=())) == ()
    assert [type(each) for each in changes_of_rows(replace(empty, sets=empty.sets[:1]))] == [
        ChangeByRow,
        ReadingByRow,
        ReadingBySet,
    ]
