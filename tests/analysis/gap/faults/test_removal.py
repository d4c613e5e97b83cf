"""Faults of a measurement are found, named and taken out before any effect is looked for."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.gap.faults.removal import examine, record_faults
from analysis.gap.measurement import Configuration, Measurement, RawBlow
from tests.analysis.gap.conftest import Made

UNUSABLE = 1
"""Set, counted from 0, that gets the fault."""


@pytest.fixture(scope="module")
def clean(made: Made) -> Measurement:
    return made().thinned(42)


def spoilt(clean: Measurement, change: Callable[[Complex], None]) -> Measurement:
    """With the rows of one set changed in place."""
    accelerance = clean.sets[UNUSABLE].accelerance.copy()
    change(accelerance)
    sets = list(clean.sets)
    sets[UNUSABLE] = replace(sets[UNUSABLE], accelerance=accelerance)
    return replace(clean, sets=tuple(sets))


def examined_rows(measurement: Measurement) -> tuple[Measurement, tuple[str, ...]]:
    found = examine(measurement)
    return found.measurement, found.faults


def test_a_clean_measurement_has_no_fault_and_is_left_as_it_is(clean: Measurement) -> None:
    found = examine(clean)
    assert found.faults == ()
    assert found.effects == ()
    assert found.measurement is clean


def test_a_measurement_without_hammer_sets_is_left_as_it_is(clean: Measurement) -> None:
    alone = replace(clean, sets=())
    found = examine(alone)
    assert found.measurement is alone
    assert found.faults == ()


def test_configurations_that_may_be_exchanged_are_named(clean: Measurement) -> None:
    points = clean.points
    assert points is not None
    other = {Configuration.COMPRESSION: Configuration.SHEAR, Configuration.SHEAR: Configuration.COMPRESSION}
    exchanged = np.array([other.get(each, each) for each in points.configuration.tolist()])
    found = examine(replace(clean, sets=(), points=replace(points, configuration=exchanged)))
    assert len(found.faults) == len(clean.drawing.joints)
    assert all("in compression and" in each and "exchanged" in each for each in found.faults)


def test_a_row_of_wrong_polarity_is_turned(clean: Measurement) -> None:
    def turn(rows: Complex) -> None:
        rows[3] *= -1

    found, faults = examined_rows(spoilt(clean, turn))
    assert faults == ("hammer set 2: row 7y has the wrong polarity; corrected",)
    assert np.array_equal(found.sets[UNUSABLE].accelerance, clean.sets[UNUSABLE].accelerance)
    assert np.array_equal(found.sets[0].accelerance, clean.sets[0].accelerance)


# rows apart, rows of opposite ends, neighbours that are alike, a row and one along the beam
PAIRS = ((2, 4), (0, 3), (1, 2), (0, 5))


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_rows_swapped_in_one_set_are_put_back(clean: Measurement, first: int, second: int) -> None:
    def swap(rows: Complex) -> None:
        rows[[first, second]] = rows[[second, first]]

    found, faults = examined_rows(spoilt(clean, swap))
    inputs = clean.sets[UNUSABLE].inputs
    assert faults == (f"hammer set 2: rows {inputs[first]} and {inputs[second]} are swapped; corrected",)
    assert np.array_equal(found.sets[UNUSABLE].accelerance, clean.sets[UNUSABLE].accelerance)
    assert np.array_equal(found.sets[0].accelerance, clean.sets[0].accelerance)


@pytest.mark.parametrize(("first", "second"), PAIRS[:3])
def test_rows_swapped_in_every_set_are_put_back(clean: Measurement, first: int, second: int) -> None:
    places = [first, second]
    sets = []
    for each in clean.sets:
        accelerance = each.accelerance.copy()
        accelerance[places] = accelerance[places[::-1]]
        sets.append(replace(each, accelerance=accelerance))
    found, (fault,) = examined_rows(replace(clean, sets=tuple(sets)))
    inputs = clean.sets[0].inputs
    assert fault == f"hammer sets 1 and 2: rows {inputs[first]} and {inputs[second]} are swapped; corrected"
    for each, of in zip(found.sets, clean.sets, strict=True):
        assert np.array_equal(each.accelerance, of.accelerance)


def along(clean: Measurement, sets: int, changed: Callable[[Complex, Complex], tuple[Complex, Complex]]) -> Measurement:
    """With a further row along the beam, 5 % from the other, in several sets alike, and both rows of set 2 changed."""
    first = clean.sets[0]
    near = first.accelerance[-1]
    far = near * (1 + 0.05j * np.linspace(1.0, 2.0, near.size))
    inputs = (*first.inputs, Dof(11, Direction.X))
    found = []
    for number in range(sets):
        rows = changed(near, far) if number == UNUSABLE else (near, far)
        accelerance = np.concatenate([first.accelerance[:-1], rows])
        deviation = np.concatenate([first.deviation, first.deviation[-1:]])
        found.append(replace(first, inputs=inputs, accelerance=accelerance, deviation=deviation))
    return replace(clean, sets=tuple(found))


def test_two_rows_along_the_beam_that_one_of_three_sets_names_the_other_way_round_are_put_back(
    clean: Measurement,
) -> None:
    found, faults = examined_rows(along(clean, 3, lambda near, far: (far, near)))
    assert faults == ("hammer set 2: rows 1x and 11x are swapped; corrected",)
    assert np.array_equal(found.sets[UNUSABLE].accelerance, found.sets[0].accelerance)


@pytest.mark.parametrize("share", [0.52, 0.55, 0.58])
def test_rows_along_the_beam_that_change_as_much_as_they_differ_are_not_swapped(
    clean: Measurement, share: float
) -> None:
    """As where one joint softens with the force of blows."""
    measurement = along(clean, 3, lambda near, far: (near + share * (far - near), far + share * (near - far)))
    found, faults = examined_rows(measurement)
    assert faults == ()
    assert found is measurement


def test_of_two_sets_neither_outvotes_the_other(clean: Measurement) -> None:
    """In set 2 noise hides half of the lines; on the others its rows along the beam look exchanged."""
    half = np.arange(clean.sets[0].frequency.size) < clean.sets[0].frequency.size // 2
    measurement = along(clean, 2, lambda near, far: (np.where(half, far, 0.5 * near), np.where(half, near, 0.5 * far)))
    second = measurement.sets[UNUSABLE]
    hidden = np.where(half, second.deviation, np.abs(second.accelerance))
    measurement = replace(measurement, sets=(measurement.sets[0], replace(second, deviation=hidden)))
    assert examine(measurement).faults == ()


def test_two_rows_of_wrong_polarity_are_turned_and_not_swapped(clean: Measurement) -> None:
    def turn(rows: Complex) -> None:
        rows[[1, 3]] *= -1

    found, faults = examined_rows(spoilt(clean, turn))
    assert faults == ("hammer set 2: rows 3y and 7y have the wrong polarity; corrected",)
    assert np.array_equal(found.sets[UNUSABLE].accelerance, clean.sets[UNUSABLE].accelerance)


def test_an_accelerometer_upside_down_is_turned(clean: Measurement) -> None:
    sets = tuple(replace(each, accelerance=-each.accelerance) for each in clean.sets)
    found, faults = examined_rows(replace(clean, sets=sets))
    assert len(faults) == len(clean.sets)
    assert all("have the wrong polarity" in fault for fault in faults)
    assert all(np.array_equal(a.accelerance, b.accelerance) for a, b in zip(found.sets, clean.sets, strict=True))


def test_an_accelerometer_that_says_nothing_is_refused(clean: Measurement) -> None:
    sets = tuple(replace(each, accelerance=0 * each.accelerance) for each in clean.sets)
    with pytest.raises(AnalysisError, match="check the accelerometer"):
        examine(replace(clean, sets=sets))


def test_a_dead_row_is_left_out_of_its_set_alone(clean: Measurement) -> None:
    def die(rows: Complex) -> None:
        rows[2] *= 1e-3

    found, (fault,) = examined_rows(spoilt(clean, die))
    assert fault.startswith("hammer set 2: row 4y is dead (it has 0.")
    assert fault.endswith("left out")
    kept = [place for place in range(len(clean.sets[UNUSABLE].inputs)) if place != 2]
    assert found.sets[UNUSABLE].inputs == tuple(clean.sets[UNUSABLE].inputs[place] for place in kept)
    assert np.array_equal(found.sets[UNUSABLE].accelerance, clean.sets[UNUSABLE].accelerance[kept])
    assert found.sets[0].inputs == clean.sets[0].inputs


def test_faults_of_different_kinds_are_all_found(clean: Measurement) -> None:
    def spoil(rows: Complex) -> None:
        rows[1] *= -1
        rows[2] *= 1e-4

    found, faults = examined_rows(spoilt(clean, spoil))
    assert len(faults) == 2
    assert np.array_equal(found.sets[UNUSABLE].accelerance[1], clean.sets[UNUSABLE].accelerance[1])
    assert len(found.sets[UNUSABLE].inputs) == len(clean.sets[UNUSABLE].inputs) - 1


def test_a_row_of_zeros_is_dead(clean: Measurement) -> None:
    def silence(rows: Complex) -> None:
        rows[2] = 0

    _, (fault,) = examined_rows(spoilt(clean, silence))
    assert "row 4y is dead" in fault


RATE, SAMPLES, TOUCH = 4096.0, 8192, 41


def struck(contacts: dict[float, float], answers: bool = True, name: str = "blow_1y") -> RawBlow:
    """A record with contacts: peak in N by time after the first touch, s."""
    random, time = np.random.default_rng(5), (np.arange(SAMPLES) - TOUCH) / RATE
    force = 0.01 * random.standard_normal(SAMPLES)
    acceleration = 0.01 * random.standard_normal(SAMPLES)
    for after, peak in contacts.items():
        since = time - after
        force += np.where(np.abs(since) < 0.5e-3, peak * np.cos(np.pi * since / 1e-3), 0.0)
        if answers:
            acceleration += np.where(since > 0, peak * np.exp(-12 * since) * np.sin(480 * since), 0.0)
    return RawBlow(name, Dof(1, Direction.Y), force, acceleration, RATE)


def test_a_clean_blow_has_no_fault() -> None:
    assert record_faults([struck({0.0: 100.0})]) == (None, ())


def test_a_bounce_is_a_double_hit_with_its_height() -> None:
    found, others = record_faults([struck({0.0: 100.0}), struck({0.0: 100.0, 0.012: 30.0}, name="blow_6y")])
    assert others == ()
    assert found is not None
    assert found.id == "double_hit"
    assert abs(found.parameters["ratio"].value - 0.3) < 0.02
    assert found.fault.startswith("1 of 2 blows kept are double hits: blow_6y at 1y")
    assert "12.0 ms after" in found.fault


def test_an_accelerometer_that_does_not_answer_is_named() -> None:
    found, (fault,) = record_faults([struck({0.0: 100.0}, answers=False)])
    assert found is None
    assert fault.startswith("blow blow_1y at 1y: accelerometer 1 did not respond")


def test_a_record_that_begins_with_the_blow_cannot_be_checked() -> None:
    blow = struck({0.0: 100.0})
    late = RawBlow(blow.name, blow.point, blow.force[TOUCH - 2 :], blow.acceleration[TOUCH - 2 :], RATE)
    found, (fault,) = record_faults([late])
    assert found is None
    assert "cannot be checked" in fault
    assert "longer pre-trigger" in fault
