"""Sensitivities are read with the units of certificates, and shown with them."""

import pytest

from jointlab.sensitivity import sensitivity_in_si, sensitivity_text


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


@pytest.mark.parametrize(("text", "unit"), [("100 mV/g", "m/s^2"), ("2.25 mV/N", "N"), ("2 V/mm", "m")])
def test_what_is_shown_can_be_written(text: str, unit: str) -> None:
    assert sensitivity_text(sensitivity_in_si(text, unit), unit) == text
