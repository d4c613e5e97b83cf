"""Where the instruments are, and which channels a step gets."""

from dataclasses import replace
from datetime import date

import pytest

from daq.channels import Channel
from daq.errors import ChannelError, DaqError
from rig.errors import RigError
from rig.instruments import Instruments, stored_channel
from rig.registers import State
from rig.thermometer import ThermometerError
from simlab.laboratory import Laboratory

NOWHERE = "tcp://127.0.0.1:1"


@pytest.fixture
def unconnected(channel_table: tuple[Channel, ...]) -> Instruments:
    return Instruments("local", NOWHERE, "/dev/ttyNothing", channel_table)


def test_channels_come_in_the_order_they_are_asked_for(unconnected: Instruments) -> None:
    names = [channel.name for channel in unconnected.channels_named("force", "hammer")]
    assert names == ["force", "hammer"]


def test_missing_channels_are_named_beside_those_that_are_there(unconnected: Instruments) -> None:
    with pytest.raises(ChannelError, match=r"no channel mallet, x in .*; it has hammer, accelerometer, displacement"):
        unconnected.channels_named("mallet", "hammer", "x")
    with pytest.raises(ChannelError, match="it has none"):
        replace(unconnected, channels=()).channels_named("hammer")


def test_a_stored_channel_carries_its_sensor_and_calibration(channel_table: tuple[Channel, ...]) -> None:
    hammer, _, displacement, _ = map(stored_channel, channel_table)
    assert (hammer.name, hammer.physical, hammer.kind, hammer.unit) == ("hammer", "cDAQ1Mod1/ai0", "force_iepe", "N")
    assert hammer.excitation_current == 2e-3
    assert hammer.instrument is not None
    assert (hammer.instrument.serial, hammer.instrument.calibrated_on) == ("H-01", date(2026, 3, 2))
    assert (hammer.instrument.sensitivity, hammer.instrument.sensitivity_unit) == (2.25e-3, "V/(N)")
    assert displacement.excitation_current is None


def test_acquisition_opens_chassis_and_thermometer_and_lets_them_go(instruments: Instruments) -> None:
    for _ in range(2):  # the thermometer takes one client at a time
        with instruments.acquisition() as (chassis, thermometer):
            chassis.verify(instruments.channels)
            assert 15 < thermometer.celsius() < 35


def test_an_absent_thermometer_lets_the_chassis_go_again(instruments: Instruments) -> None:
    with (
        pytest.raises(ThermometerError, match="/dev/ttyNothing"),
        replace(instruments, thermometer_url="/dev/ttyNothing").acquisition(),
    ):
        pass
    with instruments.acquisition() as (chassis, _):
        assert chassis.devices


def test_the_tester_is_left_at_rest(instruments: Instruments, whole_laboratory: Laboratory) -> None:
    with instruments.tester() as tester:
        tester.start()
        assert whole_laboratory.tester.device.status()["state"] == State.IDLE
    assert whole_laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


@pytest.mark.parametrize("address", ["local", "grpc://", "modbus://127.0.0.1:1"])
def test_an_acquisition_that_is_not_there_is_an_error_of_acquisition(unconnected: Instruments, address: str) -> None:
    with pytest.raises(DaqError, match=address), replace(unconnected, daq_address=address).acquisition():
        pass


def test_a_tester_that_is_not_there_is_an_error_of_the_rig(unconnected: Instruments) -> None:
    with pytest.raises(RigError, match=NOWHERE), unconnected.tester():
        pass
