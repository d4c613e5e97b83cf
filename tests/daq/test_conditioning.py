"""Strain bridges, charge outputs and data sheets of sensors, through NI's client and a server on loopback."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from nidaqmx._stubs import nidaqmx_pb2 as pb

from daq.channels import Bridge, BridgeConfiguration, Channel
from daq.device import Chassis
from daq.errors import ChannelError, DaqError
from daq.instrument import EdgeTrigger, Teds
from simlab.daq_server import DaqServer
from simlab.daq_service import EXCHANGED, NiDaqmx
from tests.channels import (
    ACCELEROMETER,
    CHARGE_ACCELEROMETER,
    CHARGE_HAMMER,
    DISPLACEMENT,
    FORCE,
    HAMMER,
    LOAD_CELL,
)
from tests.daq.conftest import Plant
from tests.waiting import LONG

HALF_BRIDGE = replace(LOAD_CELL, bridge=Bridge(2.5, BridgeConfiguration.HALF, 120.0))
COUNT = 25e-3 / 2**23  # V/V


@pytest.mark.parametrize(("cell", "seen"), [(LOAD_CELL, 1.0), (HALF_BRIDGE, 0.5)])  # of a cell with a full bridge
def test_a_load_cell_with_a_bridge_reads_newtons_beside_a_conditioner_with_a_voltage(
    chassis: Chassis, cell: Channel, seen: float
) -> None:
    with chassis.record((cell, replace(FORCE, name="conditioner")), 5000.0, 0.5) as recorder:
        block = recorder.record()
        assert recorder.input_range("force") == (-25e-3, 25e-3)
    assert np.ptp(block.value("conditioner")) == pytest.approx(240.0, rel=1e-3)
    resolution = COUNT / cell.sensitivity
    np.testing.assert_allclose(block.value("force"), seen * block.value("conditioner"), rtol=0, atol=resolution)
    np.testing.assert_allclose(block.at_input("force"), 0.4e-6 * block.value("force"))


def test_a_hammer_with_charge_output_triggers_at_its_force(chassis: Chassis, plant: Plant) -> None:
    with chassis.triggered((CHARGE_HAMMER, CHARGE_ACCELEROMETER), 5120, 0.5, EdgeTrigger("hammer", 10.0, 0.05)) as task:
        task.arm()
        plant.strike()
        block = task.wait(LONG)
    signals = plant.hammer_signals(*plant.served[-1])
    for channel in block.channels:
        np.testing.assert_allclose(block.value(channel.name), signals[channel.name], atol=1e-2)
    at = block.trigger_index or 0
    assert block.value("hammer")[at - 1] < 10.0 <= block.value("hammer")[at]


def with_attributes(monkeypatch: pytest.MonkeyPatch, change: Mapping[int, Callable[[Any], Any]]) -> None:
    """Let the server answer for some attributes of channels what `change` makes of the true value."""
    original = NiDaqmx._attributes

    def changed(service: NiDaqmx, owner: str, request: Any) -> Mapping[int, Callable[[], Any]]:
        found = dict(original(service, owner, request))
        for number, by in change.items() if owner == "Chan" else ():
            found[number] = after(by, found[number])
        return found

    def after(by: Callable[[Any], Any], true: Callable[[], Any]) -> Callable[[], Any]:
        return lambda: by(true())

    monkeypatch.setattr(NiDaqmx, "_attributes", changed)


@pytest.mark.parametrize("polarity", [1, -1])
def test_a_driver_that_scales_a_bridge_to_volts_is_divided_by_the_supply(
    chassis: Chassis, server: DaqServer, monkeypatch: pytest.MonkeyPatch, polarity: int
) -> None:
    volts = {pb.CHANNEL_ATTRIBUTE_AI_DEV_SCALING_COEFF: lambda true: [5.0 * each for each in true]}
    with_attributes(monkeypatch, volts)
    if polarity < 0:
        server.faults.set("inverted", LOAD_CELL.physical)
    with chassis.record((replace(LOAD_CELL, polarity=polarity),), 5000.0, 0.1) as recorder:
        assert np.mean(recorder.record().value("force")) == pytest.approx(1000.0, rel=1e-3)


def test_a_scaling_in_an_unknown_unit_is_refused_and_the_module_is_free(
    chassis: Chassis, server: DaqServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_attributes(
        monkeypatch, {pb.CHANNEL_ATTRIBUTE_AI_DEV_SCALING_COEFF: lambda true: [2.0 * each for each in true]}
    )
    with pytest.raises(DaqError, match=r"ends at 0\.05 by .* 0\.025 V/V by its range, so that the unit .* not known"):
        chassis.record((LOAD_CELL,), 5000.0, 0.1)
    assert server.tasks == ()


def test_a_bridge_that_changed_on_the_network_is_found_by_reading_back(
    chassis: Chassis, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_attributes(monkeypatch, {pb.CHANNEL_ATTRIBUTE_AI_BRIDGE_CFG: lambda _: 10187})
    with pytest.raises(DaqError, match=r"bridge of 'force': .*FULL_BRIDGE was asked for, .*HALF_BRIDGE"):
        chassis.record((LOAD_CELL,), 5000.0, 0.1)


@pytest.mark.parametrize(
    ("channel", "code"),
    [
        (replace(LOAD_CELL, physical="cDAQ1Mod1/ai2"), -200431),  # a bridge at an IEPE module
        (replace(HAMMER, physical="cDAQ1Mod3/ai0"), -200431),  # an IEPE sensor at a bridge module
        (replace(CHARGE_HAMMER, physical="cDAQ1Mod2/ai2"), -200431),
        (replace(LOAD_CELL, bridge=Bridge(4.0)), -200077),  # V that the module does not supply
        (replace(LOAD_CELL, maximum=70e3), -200077),  # 28 mV/V
        (replace(CHARGE_ACCELEROMETER, maximum=2.1e3), -200077),  # 21 nC
    ],
)
def test_what_a_module_cannot_measure_is_an_error_of_its_channel(chassis: Chassis, channel: Channel, code: int) -> None:
    with pytest.raises(ChannelError, match=f"channel '{channel.name}' on {channel.physical}") as error:
        chassis.verify([channel])
    assert error.value.code == code


def test_the_data_sheet_of_a_sensor_is_read_again_each_time(chassis: Chassis, server: DaqServer) -> None:
    assert chassis.teds(ACCELEROMETER) == Teds(61, 352, 1)
    server.faults.set("exchanged", ACCELEROMETER.physical)
    assert chassis.teds(ACCELEROMETER) == Teds(61, 352, EXCHANGED)
    server.faults.set("cable_open", ACCELEROMETER.physical)
    assert chassis.teds(ACCELEROMETER) is None


@pytest.mark.parametrize("channel", [HAMMER, DISPLACEMENT])  # a sensor without, and a module that reads none
def test_no_data_sheet_is_no_error(chassis: Chassis, channel: Channel) -> None:
    assert chassis.teds(channel) is None


def test_a_data_sheet_that_cannot_be_read_is_an_error(chassis: Chassis, server: DaqServer) -> None:
    server.faults.script("ConfigureTEDS", -200742)
    with pytest.raises(DaqError, match="TEDS of channel 'accelerometer' on cDAQ1Mod1/ai1") as error:
        chassis.teds(ACCELEROMETER)
    assert error.value.code == -200742


@pytest.mark.parametrize("serial", ["LW12345", "12345", "LW-012345", "123-45", "SN 12345 A"])
def test_a_serial_number_of_a_certificate_is_that_of_the_data_sheet_by_its_digits(serial: str) -> None:
    assert Teds(61, 352, 12345).is_of(serial)
    assert not Teds(61, 352, 1234).is_of(serial)
    assert not Teds(61, 352, 12345).is_of("LW")
