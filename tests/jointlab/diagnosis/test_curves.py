"""Measured, before and after over each other: what is shown is what was read and what the model has there."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.dof import Dof
from analysis.gap.diagnosis import Predicted
from analysis.gap.measurement import Configuration, HammerSet, Measurement, TesterPoints
from jointlab.diagnosis.catalogue import blank_measurement
from jointlab.diagnosis.curves import (
    CLOSE_UP,
    LINES,
    band_of_largest_gap,
    curves_of,
    kept_lines,
    split_predictions,
    with_rows_predicted,
)
from rig.sequences.sequence_file import load_sequence
from tests.jointlab.diagnosis.test_next_sequence import paper_file

STRUCK = (Dof.parse("1y"), Dof.parse("3y"), Dof.parse("1x"))
FREQUENCY = np.linspace(5, 1024, 1900)


@pytest.fixture(scope="module")
def measurement() -> Measurement:
    """Three rows, the second a resonance that the first has three times over, and the third dead."""
    with paper_file() as path:
        blank = blank_measurement(load_sequence(path).article, STRUCK)
    resonance = 1 / (1 - (FREQUENCY / 400) ** 2 + 0.02j)
    accelerance = np.array([3 * resonance, resonance, 0 * resonance])
    deviation = np.full(accelerance.shape, 0.01)
    return Measurement(blank.drawing, (HammerSet(STRUCK, FREQUENCY, accelerance, deviation, 100.0),), points())


def points() -> TesterPoints:
    """Four points of two series, in no order."""
    return TesterPoints(
        order=np.arange(4.0),
        specimen=np.array([1, 0, 1, 0]),
        configuration=np.full(4, Configuration.SHEAR, dtype=np.intp),
        amplitude=np.full(4, 0.5e-4),
        frequency=np.array([200.0, 200.0, 100.0, 100.0]),
        stiffness=np.array([1 + 0.1j, 2 + 0.2j, 3 + 0.3j, 4 + 0.4j], dtype=np.complex128) * 1e6,
        deviation=np.full(4, 1e4),
        temperature=np.full(4, 23.0),
    )


def predicted(measurement: Measurement) -> Predicted:
    """Ten per cent too large before, right afterwards."""
    measured = measurement.sets[0].accelerance
    return Predicted(FREQUENCY, 1.1 * measured, measured)


def test_rows_are_asked_for_after_what_was_asked_for_already(measurement: Measurement) -> None:
    asked = ((Dof.parse("3y"), Dof.parse("5y")),)
    own = measurement.drawing.accelerometer
    found = with_rows_predicted(Measurement(measurement.drawing, measurement.sets, None, predict=asked)).predict
    assert found == (*asked, *((own, point) for point in STRUCK))


def test_predictions_asked_for_and_those_of_rows_are_separated() -> None:
    both = np.arange(8).reshape(4, 2).astype(np.complex128)
    asked, rows = split_predictions(Predicted(np.arange(2.0), both, -both), 1)
    assert asked is not None
    assert (asked.before.tolist(), asked.after.tolist()) == ([[0, 1]], [[0, -1]])
    assert rows.before.tolist() == [[2, 3], [4, 5], [6, 7]]
    assert split_predictions(Predicted(np.arange(2.0), both, both), 0)[0] is None


def test_the_largest_gap_comes_first_and_a_dead_row_not_at_all(measurement: Measurement) -> None:
    found = curves_of(measurement, predicted(measurement))
    assert [curve["input"] for curve in found] == ["1y", "3y"]
    assert [curve["gap"]["before"]["percent"] for curve in found] == pytest.approx([10.0, 10.0])
    assert [curve["gap"]["after"]["percent"] for curve in found] == [0.0, 0.0]
    assert found[0]["gap"]["before"]["sigma"] == pytest.approx(3 * found[1]["gap"]["before"]["sigma"])
    assert json.loads(json.dumps(found, allow_nan=False)) == found


def test_a_row_is_shown_as_it_was_read_with_every_line_of_its_close_up(measurement: Measurement) -> None:
    curve = curves_of(measurement, predicted(measurement))[0]
    shown = np.array(curve["frequency_hz"])
    low, high = curve["close_up_hz"]
    assert low < 400 < high
    assert np.sum((shown >= low) & (shown <= high)) == round(CLOSE_UP * FREQUENCY.size)
    places = np.searchsorted(FREQUENCY, shown * (1 - 1e-5))
    expected = measurement.sets[0].accelerance[0, places]
    assert curve["magnitude"]["measured"] == pytest.approx(np.abs(expected), rel=1e-3)
    assert curve["phase_deg"]["measured"] == pytest.approx(np.degrees(np.angle(expected)), rel=1e-3)


def test_a_series_of_the_tester_rises_in_frequency_and_has_its_own_points(measurement: Measurement) -> None:
    stiffness = points().stiffness
    first, second = curves_of(measurement, None, (2 * stiffness, stiffness))
    assert {(curve["specimen"], curve["configuration"], curve["amplitude_pp_mm"]) for curve in (first, second)} == {
        ("I", "shear", 0.1),
        ("II", "shear", 0.1),
    }
    assert first["frequency_hz"] == [100.0, 200.0]
    assert (first["stiffness"]["measured"], first["stiffness"]["before"]) == ([4e6, 2e6], [8e6, 4e6])
    assert first["loss_factor"]["after"] == [0.1, 0.1]


def test_predictions_at_other_lines_are_passed_over(measurement: Measurement) -> None:
    short = Predicted(FREQUENCY[:5], np.ones((3, 5), complex), np.ones((3, 5), complex))
    assert curves_of(measurement, short) == []
    assert curves_of(measurement, None) == []


@given(seed=st.integers(0, 2**32 - 1), lines=st.integers(1, 3000))
def test_kept_lines_have_the_extremes_of_every_curve(seed: int, lines: int) -> None:
    size = np.random.default_rng(seed).standard_normal((3, lines))
    keep = kept_lines(size)
    assert keep.size <= LINES
    assert np.all(np.diff(keep) > 0)
    assert np.array_equal(size[:, keep].max(axis=1), size.max(axis=1))
    assert np.array_equal(size[:, keep].min(axis=1), size.min(axis=1))


def test_the_widest_gap_holds_the_largest_difference() -> None:
    difference = np.zeros(100)
    difference[[40, 45]] = 5.0
    difference[80] = 6.0
    found = band_of_largest_gap(difference)
    assert found.start <= 40 < 45 < found.stop
    assert found.stop - found.start == 10
