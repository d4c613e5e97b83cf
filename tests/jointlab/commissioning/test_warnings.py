"""A run is warned of an examination that is missing, old, failed, or made with other instruments."""

from dataclasses import asdict, replace
from datetime import UTC, date, datetime, timedelta
from typing import Any

import pytest

from jointlab.commissioning.examination import identity, verdict_of
from jointlab.commissioning.warnings import RigWarning, WarningKind, changes, warnings_of
from jointlab.commissioning.wording import BY_EXAMINATION, WARNINGS, warning_text
from rig.checks.check import Check, CheckState, judged, not_done
from rig.instruments import stored_channel
from store.instrument import Instrument
from store.service.commissioning import CommissioningRecord
from store.states import Verdict
from tests.rig.conftest import CHANNELS

NOW = datetime(2026, 5, 1, tzinfo=UTC)
TESTER = Instrument("tester", "elastomer tester", "ET-7")
GOOD = judged("noise", "hammer", True, "", 0.02, 0.04, "N")
BAD = judged("hum", "accelerometer", False, "look for a ground loop", 1.0, 0.004, "m/s^2")


def record(*checks: Check, days: float = 1.0) -> CommissioningRecord:
    instruments = [*(stored_channel(channel).instrument for channel in CHANNELS), TESTER]
    return CommissioningRecord(
        7, "rig", "bench", "ann", verdict_of(checks), tuple(asdict(check) for check in checks),
        tuple(identity(each) for each in instruments), NOW - timedelta(days=days), "w0",
    )  # fmt: skip


def test_nothing_is_said_of_a_recent_examination_that_passed_with_the_same_sensors() -> None:
    assert warnings_of(record(GOOD), CHANNELS, 30.0, NOW) == []
    assert changes(record(GOOD), [TESTER]) == []


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (None, "never examined"),
        (record(GOOD, days=31), "examined 31 days ago"),
        (record(GOOD, BAD), "examination 7 found faults: accelerometer, mains hum"),
    ],
)
def test_what_speaks_for_an_examination_is_said(found: CommissioningRecord | None, said: str) -> None:
    (warning,) = warnings_of(found, CHANNELS, 30.0, NOW)
    assert said in warning_text(warning)


@pytest.mark.parametrize("changed", [{"serial": "A-02"}, {"sensitivity": 0.1}])
def test_another_sensor_or_sensitivity_than_examined_is_said(changed: dict[str, Any]) -> None:
    table = tuple(replace(each, **changed) if each.name == "accelerometer" else each for each in CHANNELS)
    (warning,) = warnings_of(record(GOOD), table, 30.0, NOW)
    assert "not examined with accelerometer" in warning_text(warning)


def test_a_calibration_that_is_over_is_said() -> None:
    table = tuple(replace(each, due_on=date(2026, 4, 30)) if each.name == "hammer" else each for each in CHANNELS)
    (warning,) = warnings_of(record(GOOD), table, 30.0, NOW)
    assert warning_text(warning) == "the calibration of hammer H-01 was valid until 2026-04-30; have it calibrated"


def test_another_tester_than_examined_is_said() -> None:
    (warning,) = changes(record(GOOD), [replace(TESTER, serial="ET-8")])
    assert warning == RigWarning(WarningKind.INSTRUMENT_CHANGED, {"instrument": "elastomer tester ET-8"})
    assert warning_text(warning) == "the rig was not examined with elastomer tester ET-8 as it is now"


def test_every_kind_has_words_and_all_but_faults_and_calibrations_end_with_an_examination() -> None:
    assert set(WARNINGS) == set(WarningKind)
    assert set(WarningKind) - BY_EXAMINATION == {WarningKind.CALIBRATION_OVER, WarningKind.FAULTS_FOUND}


def test_a_verdict_is_as_bad_as_the_worst_check() -> None:
    undone = not_done("watchdog", "tester", "allow it")
    assert verdict_of((GOOD,)) is Verdict.PASSED
    assert verdict_of((GOOD, undone)) is Verdict.INCOMPLETE
    assert verdict_of((GOOD, undone, BAD)) is Verdict.FAILED
    assert {GOOD.state, BAD.state, undone.state} == set(CheckState)
