"""Examining the rig of a drive process and signing the result."""

from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

from analysis.chain import Calibrator, FoundSensitivity
from daq.channels import Channel
from jointlab.documents.commissioning import ExaminationRequest
from jointlab.drive.protocol import EXAMINED, DriveRequest, Examine, Reply
from jointlab.settings import CommissioningSettings
from rig.checks.check import Check, CheckState, judged
from rig.checks.examination import Examination, Examined
from rig.instruments import stored_channel
from store.catalogue import Catalogue
from store.instrument import Instrument
from store.measurements.instruments import calibration_id
from store.service.commissioning import CommissioningRecord, add_commissioning_record
from store.states import Verdict

TIMEOUT = 60.0  # s that an examination may take; one with trips takes 12 s
Send = Callable[[DriveRequest, float], Reply]
"""Sends a request to a drive process, and waits at most the given time in s for its reply."""


def calibrator_of(given: CommissioningSettings) -> Calibrator:
    """The hand-held calibrator of the laboratory."""
    return Calibrator(given.calibrator_frequency, given.calibrator_acceleration, given.calibrator_uncertainty)


def asked_of(given: ExaminationRequest, settings: CommissioningSettings) -> Examination:
    """The request of a client, with the calibrator of the laboratory."""
    return Examination(**given.model_dump(), calibrator=calibrator_of(settings))


def examine_rig(ask: Send, asked: Examination, lease: int) -> Examined:
    """Examine the rig.

    Raises:
        ConflictError: a run is carried out.
        RunStoppedError, LeaseLostError: STOP is in force, or another client drives.
        RigError, DaqError: what `asked` needs is missing.
    """
    return EXAMINED.validate_python(ask(Examine(asked=asked, lease=lease), TIMEOUT).value)


def verdict_of(checks: tuple[Check, ...]) -> Verdict:
    """Failed where one check is; incomplete where one was not done; else passed."""
    states = {check.state for check in checks}
    if CheckState.FAILED in states:
        return Verdict.FAILED
    return Verdict.INCOMPLETE if CheckState.NOT_DONE in states else Verdict.PASSED


def sign(
    catalogue: Catalogue, rig: str, asked: Examination, examined: Examined, channels: tuple[Channel, ...], who: str
) -> CommissioningRecord:
    """Store what was found as a record that `who` answers for, with the sensitivity that a calibrator showed.

    Raises StoreError where it cannot be stored.
    """
    sensors = [stored_channel(channel).instrument for channel in channels]
    checks = [*examined.checks, judged("writable", "database", True, "")]
    with catalogue.writing() as session:
        if examined.sensitivity is not None:
            sensor = next(each for each in sensors if each.model == asked.accelerometer)
            calibration_id(session, _calibrated(sensor, examined.sensitivity))
        return add_commissioning_record(
            session,
            rig=rig,
            place=asked.place.value,
            who=who,
            verdict=verdict_of(tuple(checks)),
            checks=[asdict(check) for check in checks],
            instruments=[identity(each) for each in (*sensors, *examined.instruments)],
        )


def identity(instrument: Instrument) -> dict[str, Any]:
    """The identity of an instrument in a record: kind, model, serial number and sensitivity."""
    return {
        "kind": instrument.kind,
        "model": instrument.model,
        "serial": instrument.serial,
        "sensitivity": instrument.sensitivity,
    }


def _calibrated(sensor: Instrument, found: FoundSensitivity) -> Instrument:
    return Instrument(
        sensor.kind, sensor.model, sensor.serial, datetime.now(UTC).date(), found.sensitivity,
        sensor.sensitivity_unit, uncertainty=found.uncertainty, certificate="hand-held calibrator",
    )  # fmt: skip
