"""The channel table."""

from dataclasses import replace
from datetime import date

import pytest

from daq.channels import Bridge, Channel, ChannelKind, checked_table
from daq.errors import ChannelError
from tests.channels import CHARGE_HAMMER, LOAD_CELL

HAMMER = Channel(
    "hammer", "cDAQ1Mod1/ai0", ChannelKind.FORCE_IEPE, 2.25e-3, "N", -2000, 2000, 2e-3, "LW12345", date(2026, 3, 1)
)
FORCE = Channel("force", "cDAQ1Mod2/ai1", ChannelKind.VOLTAGE, 2e-3, "N", -5000, 5000)


@pytest.mark.parametrize("sensitivity", [0.0, -1.0, float("nan"), float("inf")])
def test_a_sensitivity_must_be_positive(sensitivity: float) -> None:
    with pytest.raises(ChannelError, match=r"'hammer': sensitivity .* must be positive"):
        replace(HAMMER, sensitivity=sensitivity)


@pytest.mark.parametrize(("minimum", "maximum"), [(1.0, 1.0), (2.0, 1.0), (float("nan"), 1.0)])
def test_a_range_must_not_be_empty(minimum: float, maximum: float) -> None:
    with pytest.raises(ChannelError, match=r"'hammer': range .* N is empty"):
        replace(HAMMER, minimum=minimum, maximum=maximum)


def test_a_range_that_no_input_takes_is_refused_with_its_voltage() -> None:
    with pytest.raises(ChannelError, match=r"2\.25 V per N and -2000 to 2000 N are 4500 V at its input, more than any"):
        replace(HAMMER, sensitivity=2.25)


def test_an_excitation_is_not_negative_and_not_for_voltages() -> None:
    with pytest.raises(ChannelError, match="negative"):
        replace(HAMMER, excitation_current=-2e-3)
    with pytest.raises(ChannelError, match="takes no excitation"):
        replace(FORCE, excitation_current=2e-3)


def test_a_bridge_is_fed_and_nothing_else_has_one() -> None:
    assert LOAD_CELL.sensitivity_unit == "V/V/(N)"
    with pytest.raises(ChannelError, match=r"say how its bridge is fed, as in bridge = \{ excitation = 5 \}"):
        replace(LOAD_CELL, bridge=None)
    with pytest.raises(ChannelError, match="a voltage channel has no bridge"):
        replace(FORCE, bridge=Bridge(5.0))
    with pytest.raises(ChannelError, match="takes no excitation current"):
        replace(LOAD_CELL, excitation_current=2e-3)


@pytest.mark.parametrize(
    ("excitation", "resistance", "said"), [(0.0, 350.0, "excitation 0.0 V"), (5.0, -1.0, "-1.0 ohm")]
)
def test_supply_and_resistance_of_a_bridge_are_positive(excitation: float, resistance: float, said: str) -> None:
    with pytest.raises(ChannelError, match=f"bridge: .*{said} must be positive; see the data sheet"):
        Bridge(excitation, resistance=resistance)


@pytest.mark.parametrize(
    ("channel", "said"),
    [
        (LOAD_CELL, r"0\.4 V/V per N and -5000 to 5000 N are 2000 V/V at its input.* is the sensitivity in V/V per N"),
        (CHARGE_HAMMER, r"0\.4 C per N and -2000 to 2000 N are 800 C at its input.* is the sensitivity in C per N"),
    ],
)
def test_a_sensitivity_in_another_unit_is_noticed_by_what_no_input_takes(channel: Channel, said: str) -> None:
    with pytest.raises(ChannelError, match=said):
        replace(channel, sensitivity=0.4)


def test_a_kind_of_sensor_measures_one_quantity() -> None:
    with pytest.raises(ChannelError, match=r"a force_charge sensor measures N, not m/s\^2; correct kind or unit"):
        replace(CHARGE_HAMMER, unit="m/s^2")


@pytest.mark.parametrize("name", ["", "a, b"])
def test_a_name_can_stand_in_a_list(name: str) -> None:
    with pytest.raises(ChannelError, match="without commas"):
        replace(HAMMER, name=name)


def test_a_table_uses_each_name_and_each_input_once() -> None:
    assert checked_table([HAMMER, FORCE]) == (HAMMER, FORCE)
    with pytest.raises(ChannelError, match="name hammer occurs twice"):
        checked_table([HAMMER, replace(FORCE, name="hammer")])
    with pytest.raises(ChannelError, match="physical channel cDAQ1Mod1/ai0 occurs twice"):
        checked_table([HAMMER, replace(FORCE, physical="cDAQ1Mod1/ai0")])
    with pytest.raises(ChannelError, match="empty"):
        checked_table([])
