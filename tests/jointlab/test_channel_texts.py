"""A channel as the fields of a form: nothing is lost on the way; what is wrong is told at its field, in its unit."""

from datetime import date
from typing import Any

import pytest
from hypothesis import given, settings

from daq.channels import ChannelKind
from jointlab.channel_file import Row
from jointlab.channel_texts import NEW, WHOLE, Texts, has_field, row_of, texts_of
from jointlab.instruments import channel_of
from jointlab.settings import ChannelSettings
from tests.jointlab.test_channel_file import LOAD_CELL, valid_rows

HAMMER: Row = {
    "name": "hammer", "physical": "cDAQ1Mod1/ai0", "kind": "force_iepe", "unit": "N", "sensitivity": "2.25 mV/N",
    "minimum": -2000, "maximum": 2e3, "excitation_current": 0.002, "uncertainty": 0.02, "noise": 0.02,
}  # fmt: skip
LVDT: Row = {
    "name": "displacement", "physical": "cDAQ1Mod2/ai0", "kind": "voltage", "unit": "m", "sensitivity": 2000.0,
    "minimum": -0.005, "maximum": 0.0071, "noise": 3e-8, "excitation_current": 0.0,
}  # fmt: skip
WRITTEN: Texts = {
    **NEW, "name": "displacement", "physical": "cDAQ1Mod2/ai0", "kind": "voltage", "sensitivity": "2 V/mm",
    "minimum": "−5 mm", "maximum": "0.0071 m",
}  # fmt: skip


def test_the_fields_have_units_and_all_digits() -> None:
    texts = texts_of(LVDT)
    assert (texts["sensitivity"], texts["minimum"], texts["maximum"]) == ("2000 V/m", "-5 mm", "7.1 mm")
    assert (texts["noise"], texts["excitation_current"], texts["calibrated_on"]) == ("0.00003 mm", "", "")
    texts = texts_of(HAMMER)
    assert (texts["sensitivity"], texts["minimum"], texts["maximum"]) == ("2.25 mV/N", "-2000 N", "2000 N")
    assert (texts["excitation_current"], texts["uncertainty"]) == ("2", "2")
    texts = texts_of(LOAD_CELL)
    assert (texts["excitation"], texts["configuration"], texts["resistance"]) == ("5", "full", "350")


@pytest.mark.parametrize(
    ("row", "text"),
    [
        ({**LOAD_CELL, "sensitivity": 0.4e-6}, "0.0004 mV/V/N"),
        ({**HAMMER, "kind": "force_charge", "sensitivity": 4e-12, "excitation_current": 0}, "4 pC/N"),
        ({**LVDT, "unit": "m/s^2", "sensitivity": 0.0102}, "0.0102 V/(m/s^2)"),
    ],
)
def test_a_sensitivity_without_a_unit_gets_that_of_its_input(row: Row, text: str) -> None:
    assert texts_of(row)["sensitivity"] == text
    again, faults = row_of({**texts_of(row), "sensitivity": f" {text}"}, row)
    assert not faults
    assert ChannelSettings.model_validate(again).sensitivity == pytest.approx(row["sensitivity"], rel=1e-15)


@pytest.mark.parametrize("row", [HAMMER, LVDT, LOAD_CELL, {**LOAD_CELL, "calibrated_on": "2026-03-02"}])
def test_what_is_left_as_it_was_keeps_its_form(row: Row) -> None:
    again, faults = row_of(texts_of(row), row)
    assert not faults
    assert repr(sorted(again.items())) == repr(sorted(row.items()))


def test_a_new_channel_has_no_more_keys_than_are_written() -> None:
    row, faults = row_of(WRITTEN, None)
    assert not faults
    assert row == {
        "name": "displacement", "physical": "cDAQ1Mod2/ai0", "kind": "voltage", "unit": "m", "sensitivity": "2 V/mm",
        "minimum": -0.005, "maximum": 0.0071,
    }  # fmt: skip
    assert next(iter(row)) == "name"


def test_a_field_that_is_emptied_is_taken_out() -> None:
    row, faults = row_of({**texts_of(HAMMER), "noise": " ", "uncertainty": "", "excitation_current": ""}, HAMMER)
    assert not faults
    assert HAMMER.keys() - row.keys() == {"noise", "uncertainty", "excitation_current"}


def test_a_changed_value_is_in_the_unit_of_the_file() -> None:
    given = {"excitation_current": "4", "uncertainty": "1.5", "maximum": "1.8 kN", "polarity": "-1"}
    row, faults = row_of({**texts_of(HAMMER), **given, "calibrated_on": "2026-03-02"}, HAMMER)
    assert not faults
    expected = {"excitation_current": 0.004, "uncertainty": 0.015, "maximum": 1800.0, "polarity": -1}
    assert row == {**HAMMER, **expected, "calibrated_on": date(2026, 3, 2)}


def test_another_kind_of_sensor_has_other_fields() -> None:
    conditioner = {"kind": "voltage", "sensitivity": "2 mV/N"}
    row, faults = row_of({**texts_of(LOAD_CELL), **conditioner}, LOAD_CELL)
    assert not faults
    assert "bridge" not in row
    row, faults = row_of({**texts_of(HAMMER), **conditioner}, HAMMER)
    assert not faults
    assert "excitation_current" not in row
    assert [has_field(ChannelKind.VOLTAGE, name) for name in ("excitation", "excitation_current", "noise")] == [
        False, False, True,
    ]  # fmt: skip


def test_ranges_are_read_again_where_the_sensor_measures_something_else() -> None:
    _, faults = row_of({**texts_of(LVDT), "sensitivity": "2 mV/N"}, LVDT)
    said = "is in mm, but the sensor measures N; write it as -2000 N or -2 kN"
    assert faults == {"minimum": said, "maximum": said, "noise": said}


@pytest.mark.parametrize(
    ("given", "field", "said"),
    [
        ({"name": ""}, "name", "is missing"),
        ({"name": "Hammer 1"}, "name", "is 'Hammer 1'; write small letters, digits and underscores"),
        ({"physical": " "}, "physical", "is missing"),
        ({"sensitivity": "2.25"}, "sensitivity", "'2.25' is no sensitivity of this kind of sensor; write 100 mV/g"),
        ({"sensitivity": "100 mV/g"}, "sensitivity", "is of a sensor for m/s^2, but the unit of the channel is N"),
        ({"sensitivity": "0 mV/N"}, "sensitivity", "it has to be more than 0"),
        ({"minimum": "-2000"}, "minimum", "is '-2000'; write it with its unit, such as -2000 N or -2 kN"),
        ({"minimum": "-5 mm"}, "minimum", "is in mm, but the sensor measures N"),
        ({"maximum": "-3 kN"}, "maximum", "has to be more than the lowest value, -2000 N"),
        ({"maximum": "1e10 N"}, "maximum", "it has to be 1e+09 N or less"),
        ({"maximum": "1e999 N"}, "maximum", "finite"),
        ({"excitation_current": "30"}, "excitation_current", "is 30.0; it has to be 20 mA or less"),
        ({"excitation_current": "2 mA"}, "excitation_current", "which is no number such as 2 or 0.5"),
        ({"uncertainty": "150"}, "uncertainty", "is 150.0; it has to be less than 100 %"),
        ({"uncertainty": "half"}, "uncertainty", "which is no number"),
        ({"uncertainty": "0,5"}, "uncertainty", "is '0,5'; write decimals with a point"),
        ({"maximum": "2,000 N"}, "maximum", "is '2,000 N'; write decimals with a point, and thousands without a comma"),
        ({"calibrated_on": "last year"}, "calibrated_on", "which is no day such as 2026-03-31"),
        ({"noise": "-1 N"}, "noise", "is -1.0; it has to be more than 0 N"),
        ({"kind": "force_bridge", "sensitivity": "0.4 mV/V/kN"}, "excitation", "is missing"),
        ({"serial": "4" * 101}, "serial", "has more than 100 characters"),
        ({"sensitivity": "2.25 V/N"}, WHOLE, "more than any module takes"),
    ],
)
def test_what_is_wrong_is_told_at_its_field(given: dict[str, str], field: str, said: str) -> None:
    _, faults = row_of({**texts_of(HAMMER), **given}, HAMMER)
    assert list(faults) == [field]
    assert said in faults[field]


def test_what_is_wrong_with_a_displacement_is_told_in_millimetres() -> None:
    _, faults = row_of({**texts_of(LVDT), "maximum": "-6 mm"}, LVDT)
    assert faults == {"maximum": "has to be more than the lowest value, -5 mm"}
    _, faults = row_of({**texts_of(LVDT), "noise": "0 mm"}, LVDT)
    assert faults == {"noise": "is 0.0; it has to be more than 0 mm"}
    _, faults = row_of({**texts_of(LOAD_CELL), "excitation": "50"}, LOAD_CELL)
    assert faults == {"excitation": "is 50.0; it has to be 20 V or less"}


@settings(deadline=None, max_examples=200)
@given(valid_rows())
def test_any_valid_channel_comes_back_from_its_fields_with_the_same_meaning(row: dict[str, Any]) -> None:
    again, faults = row_of(texts_of(row), row)
    assert (again, faults) == (row, {})
    if not row["physical"].strip() or not row["certificate" if "certificate" in row else "name"].strip():
        return
    made, faults = row_of(texts_of(row), None)
    assert not faults
    first, second = (channel_of(ChannelSettings.model_validate(each)) for each in (row, made))
    assert second.sensitivity == pytest.approx(first.sensitivity, rel=1e-15)
    same = ("kind", "unit", "minimum", "maximum", "uncertainty", "noise", "calibrated_on", "due_on", "polarity")
    assert all(getattr(first, name) == getattr(second, name) for name in same)
