"""Steps that only wait: for a time, or until the temperature is steady. Both can be paused and stopped."""

import time
from functools import partial

from rig.control import RunControl
from rig.errors import RigError
from rig.events import Observer, SoakEnded, SoakStarted, WaitStarted
from rig.sequences.sequence import SoakStep
from rig.thermometer import Thermometer

SLICE = 0.05  # s, the longest delay of a request to stop
READINGS = 20  # of the thermometer in the time for which it has to be steady
LONGEST_INTERVAL = 10.0  # s between two readings
LATE = 1.0  # s that a reading may be late; a later one comes after a pause, in which there were none


class SoakError(RigError):
    """The temperature did not settle in the time allowed."""


def wait(duration: float, observer: Observer, control: RunControl) -> None:
    """Wait for `duration` s; a pause does not prolong it. Raises RunStoppedError where `control` asked for it."""
    observer(WaitStarted(duration))
    _wait_until(time.monotonic() + duration, observer, control)


def soak(step: SoakStep, thermometer: Thermometer, observer: Observer, control: RunControl) -> None:
    """Wait until the temperature has stayed within the band for the time that `step` asks for.

    Raises:
        SoakError: it has not within the limit; the message says how it was.
        RunStoppedError: `control` asked for it.
        ThermometerError: the thermometer does not answer.
    """
    observer(SoakStarted(step.band_celsius, step.seconds, step.limit_seconds))
    began = time.monotonic()
    interval = min(step.seconds / READINGS, LONGEST_INTERVAL)
    steady: list[tuple[float, float]] = []  # time and temperature, as far back as all are within the band
    while True:
        now, celsius = time.monotonic(), thermometer.celsius()
        if steady and now - steady[-1][0] > interval + LATE:
            steady.clear()
        steady.append((now, celsius))
        while steady and not _fits(step, [reading for _, reading in steady]):
            steady.pop(0)
        if steady and now - steady[0][0] >= step.seconds:
            observer(SoakEnded(celsius, now - began))
            return
        if now - began >= step.limit_seconds:
            raise SoakError(_unsettled(step, celsius, now - steady[0][0] if steady else 0.0))
        _wait_until(min(now + interval, began + step.limit_seconds), observer, control)


def _fits(step: SoakStep, readings: list[float]) -> bool:
    if step.celsius is not None:
        return all(abs(reading - step.celsius) <= step.band_celsius / 2 for reading in readings)
    return max(readings) - min(readings) <= step.band_celsius


def _unsettled(step: SoakStep, celsius: float, steady: float) -> str:
    about = "" if step.celsius is None else f" about {step.celsius:g} C"
    return (
        f"soak: the temperature did not stay within a band of {step.band_celsius:g} K{about} for {step.seconds:g} s "
        f"in {step.limit_seconds:g} s; it is {celsius:.2f} C and has been within the band for {steady:.0f} s; check "
        "the air conditioning, or allow more time"
    )


def _wait_until(end: float, observer: Observer, control: RunControl) -> None:
    while (left := end - time.monotonic()) > 0:
        control.carry_out(partial(time.sleep, min(left, SLICE)), observer)
