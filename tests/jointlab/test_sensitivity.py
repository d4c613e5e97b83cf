"""Sensitivities are read with the units of certificates, and shown with them."""

from dataclasses import replace

import pytest

from jointlab.sensitivity import sensitivity_in_si, sensitivity_text, stored_sensitivity_text
from rig.instruments import stored_channel
from tests.channels import CHARGE_HAMMER, DISPLACEMENT, HAMMER, LOAD_CELL


@pytest.mark.parametrize(
    ("text", "unit", "volts"),
    [
        ("100 mV/g", "m/s^2", 0.0101972),
        ("10.2 mV/(m/s^2)", "m/s^2", 0.0102),
        ("10.2mV/(m/s²)", "m/s^2", 0.0102),
        ("10.2 mV/(m/s2)", "m/s^2", 0.0102),
        ("2.25 mV/N", "N", 2.25e-3),
        ("2 V/kN", "N", 2e-3),
        ("2 V/mm", "m", 2e3),
        ("1e-3 V/m", "m", 1e-3),
    ],
)
def test_a_sensitivity_is_volts_for_each_si_unit(text: str, unit: str, volts: float) -> None:
    assert sensitivity_in_si(text, unit) == pytest.approx(volts, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "unit", "at_input", "value"),
    [
        ("0.4 mV/V/kN", "N", "V/V", 0.4e-6),
        ("4e-4 mV/V/N", "N", "V/V", 0.4e-6),
        ("4 pC/N", "N", "C", 4e-12),
        ("100 pC/g", "m/s^2", "C", 10.19716e-12),
        ("10.2 pC/(m/s^2)", "m/s^2", "C", 10.2e-12),
    ],
)
def test_a_bridge_is_read_over_its_supply_and_a_charge_in_picocoulombs(
    text: str, unit: str, at_input: str, value: float
) -> None:
    assert sensitivity_in_si(text, unit, at_input) == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "at_input", "said"),
    [("2 mV/N", "V/V", "write 0.4 mV/V/kN"), ("4 pC/N", "V", "write 100 mV/g"), ("2 mV/N", "C", "write 4 pC/N")],
)
def test_a_sensitivity_of_another_kind_of_sensor_is_refused(text: str, at_input: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        sensitivity_in_si(text, "N", at_input)


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("100", "m/s^2", "write 100 mV/g"),
        ("100 pC/g", "m/s^2", "write 100 mV/g"),
        ("-100 mV/g", "m/s^2", "write 100 mV/g"),
        ("100 mV/furlong", "m", "write 100 mV/g"),
        ("100 mV/g", "N", "unit of the channel is N"),
        ("2.25 mV/N", "m/s^2", "of a sensor for N"),
    ],
)
def test_another_form_or_quantity_is_refused_with_what_to_write(text: str, unit: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        sensitivity_in_si(text, unit)


@pytest.mark.parametrize(
    ("text", "unit", "at_input"),
    [
        ("100 mV/g", "m/s^2", "V"),
        ("2.25 mV/N", "N", "V"),
        ("2 V/mm", "m", "V"),
        ("0.4 mV/V/kN", "N", "V/V"),
        ("4 pC/N", "N", "C"),
        ("100 pC/g", "m/s^2", "C"),
    ],
)
def test_what_is_shown_can_be_written(text: str, unit: str, at_input: str) -> None:
    assert sensitivity_text(sensitivity_in_si(text, unit, at_input), unit, at_input) == text


def test_a_stored_sensitivity_is_shown_as_on_a_certificate_and_in_volts_where_the_kind_came_from_elsewhere() -> None:
    stored = [stored_channel(each) for each in (HAMMER, LOAD_CELL, CHARGE_HAMMER, DISPLACEMENT)]
    said = ["2.25 mV/N", "0.4 mV/V/kN", "4 pC/N", "2 V/mm"]
    assert [stored_sensitivity_text(each) for each in stored] == said
    assert stored_sensitivity_text(replace(stored[0], kind="force")) == said[0]
    assert stored_sensitivity_text(replace(stored[0], polarity=-1)) == "2.25 mV/N, inverted"
    assert stored_sensitivity_text(replace(stored[0], unit="rad/s", kind="voltage")) == "2.25 mV/(rad/s)"
