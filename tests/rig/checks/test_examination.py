"""An examination finds each planted fault by the check that is meant for it, and none where there is none."""

from dataclasses import replace

import pytest

from daq.instrument import Teds
from rig.checks.channel_checks import check_of_sensor
from rig.checks.check import CheckState, Place
from rig.checks.examination import Examination, examine
from rig.control import RunControl
from rig.events import Event, ExaminationStep, InterlockReset
from rig.instruments import Instruments
from rig.registers import CommandCode
from rig.tester.stop_latch import LeaseLostError
from simlab.laboratory import Laboratory
from tests.channels import CHARGE_ACCELEROMETER, CHARGE_HAMMER, LOAD_CELL
from tests.rig.conftest import CHANNELS
from tests.rig.planted_faults import PLANTED, Planted, examined, failures


@pytest.mark.parametrize("planted", PLANTED, ids=lambda planted: planted.name)
def test_a_planted_fault_is_found(whole_laboratory: Laboratory, planted: Planted) -> None:
    planted.plant(whole_laboratory)
    trip = planted.shows[0] in ("watchdog", "emergency_stop")
    found = examined(whole_laboratory, planted.change(CHANNELS), planted.place, trip=trip)
    assert planted.shows in failures(found)
    assert all(check.advice for check in found if check.state is not CheckState.PASSED)


@pytest.mark.parametrize(
    ("taken_at", "trips_before"),
    [(ExaminationStep, 0), (InterlockReset, 1)],
    ids=["before the trips", "during the trip of the watchdog"],
)
def test_nothing_is_tripped_once_another_client_has_taken_the_rig(
    whole_laboratory: Laboratory, instruments: Instruments, taken_at: type[Event], trips_before: int
) -> None:
    latch = instruments.latch
    latch.let_drive(1)
    applied = whole_laboratory.tester.device.applied
    before = applied.count(CommandCode.HYDRAULICS_ON)

    def take_the_rig(event: Event) -> None:
        if isinstance(event, taken_at):
            latch.let_drive(2)

    with pytest.raises(LeaseLostError, match="another client has taken the rig"):
        examine(instruments, Examination(trip=True), take_the_rig, RunControl(latch, 1))
    assert applied.count(CommandCode.HYDRAULICS_ON) == before + trips_before


@pytest.mark.parametrize("place", Place)
def test_a_healthy_bench_passes_every_check(whole_laboratory: Laboratory, place: Place) -> None:
    found = examined(whole_laboratory, CHANNELS, place)
    assert {check.state for check in found} == {CheckState.PASSED}


BRIDGE_AND_CHARGE = (CHARGE_HAMMER, CHARGE_ACCELEROMETER, CHANNELS[2], LOAD_CELL)


@pytest.mark.parametrize("place", Place)
def test_a_bench_with_bridge_and_charge_inputs_passes_every_check(whole_laboratory: Laboratory, place: Place) -> None:
    found = examined(whole_laboratory, BRIDGE_AND_CHARGE, place)
    assert {check.state for check in found} == {CheckState.PASSED}
    assert (("zero", "force") in {(check.id, check.subject) for check in found}) == (place is Place.BENCH)


@pytest.mark.parametrize(
    ("fault", "id_", "advice"),
    [
        ("cable_open", "overload", "look for an open wire of the bridge, and whether the sensor is a full bridge"),
        ("offset", "zero", "the load cell was overloaded"),
        ("exchanged", "sensor", "another sensor is connected"),
    ],
)
def test_a_fault_of_a_load_cell_is_told_as_one_of_a_bridge(
    whole_laboratory: Laboratory, fault: str, id_: str, advice: str
) -> None:
    whole_laboratory.daq.faults.set(fault, LOAD_CELL.physical)
    found = examined(whole_laboratory, BRIDGE_AND_CHARGE, Place.BENCH)
    said = {check.id: check.advice for check in found if check.subject == "force" and check.state is CheckState.FAILED}
    assert advice in said[id_]


def test_a_sensor_of_another_channel_is_named_and_one_without_a_serial_number_is_asked_for() -> None:
    hammer, accelerometer = CHANNELS[:2]
    teds = Teds(61, 352, 22)
    table = (replace(hammer, serial="H-22"), accelerometer)
    found = check_of_sensor(teds, accelerometer, table)
    assert found.state is CheckState.FAILED
    assert "the sensor of hammer is connected here: cables or rows of the channel table are swapped" in found.advice
    unknown = check_of_sensor(teds, replace(accelerometer, serial=""), table)
    assert unknown.state is CheckState.NOT_DONE
    assert "serial number 22 of maker 61, model 352: write serial into the channel table" in unknown.advice


def test_the_polarity_of_the_channel_table_turns_a_sensor_back(whole_laboratory: Laboratory) -> None:
    whole_laboratory.daq.faults.set("inverted", "cDAQ1Mod1/ai1")
    turned = tuple(replace(row, polarity=-1) if row.name == "accelerometer" else row for row in CHANNELS)
    assert failures(examined(whole_laboratory, turned, Place.MASS)) == set()


def test_without_consent_nothing_is_commanded(whole_laboratory: Laboratory) -> None:
    before = list(whole_laboratory.tester.device.applied)
    found = examined(whole_laboratory, CHANNELS, Place.BENCH, trip=False)
    undone = {check.id for check in found if check.state is CheckState.NOT_DONE}
    assert undone == {"watchdog", "emergency_stop"}
    added = whole_laboratory.tester.device.applied[len(before) :]
    assert {command.name for command in added} <= {"HOLD", "HYDRAULICS_OFF"}
