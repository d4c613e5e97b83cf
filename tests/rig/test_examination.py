"""An examination finds each planted fault by the check that is meant for it, and none where there is none."""

from dataclasses import replace

import pytest

from rig.checks import CheckState, Place
from simlab.laboratory import Laboratory
from tests.rig.conftest import CHANNELS
from tests.rig.planted_faults import PLANTED, Planted, examined, failures


@pytest.mark.parametrize("planted", PLANTED, ids=lambda planted: planted.name)
def test_a_planted_fault_is_found(whole_laboratory: Laboratory, planted: Planted) -> None:
    planted.plant(whole_laboratory)
    trip = planted.shows[0] in ("watchdog", "emergency_stop")
    found = examined(whole_laboratory, planted.change(CHANNELS), planted.place, trip=trip)
    assert planted.shows in failures(found)
    assert all(check.advice for check in found if check.state is not CheckState.PASSED)


@pytest.mark.parametrize("place", Place)
def test_a_healthy_bench_passes_every_check(whole_laboratory: Laboratory, place: Place) -> None:
    found = examined(whole_laboratory, CHANNELS, place)
    assert {check.state for check in found} == {CheckState.PASSED}


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
