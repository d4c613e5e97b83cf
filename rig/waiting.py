"""Steps that only wait: for a time, or until the temperature has settled. Both can be paused and stopped."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial

from rig.control import RunControl
from rig.errors import RigError
from rig.events import Observer, SoakEnded, SoakStarted, WaitStarted
from rig.thermometer import Thermometer

SLICE = 0.05  # s, so soon a request to stop is met
LOOKS = 20  # at the thermometer in the time that it has to be steady
LONGEST_LOOK = 10.0  # s
LATE = 1.0  # s that a look may be late; what is later lies behind a pause, in which nobody looked


class SoakError(RigError):
    """The temperature did not settle in the time allowed."""


@dataclass(frozen=True)
class Soak:
    """What counts as settled.

    Attributes:
        band: between the highest and the lowest reading, K.
        duration: so long within the band, s.
        limit: at most so long altogether, s.
        middle: of the band, C; None for wherever the temperature settles.
    """

    band: float
    duration: float
    limit: float
    middle: float | None = None


def wait(duration: float, observer: Observer, control: RunControl) -> None:
    """Wait for `duration` s; a pause does not prolong it.

    Raises:
        RunStoppedError: `control` asked for it.
    """
    observer(WaitStarted(duration))
    _wait_until(time.monotonic() + duration, observer, control)


def soak(settings: Soak, thermometer: Thermometer, observer: Observer, control: RunControl) -> None:
    """Wait until the temperature has settled.

    Raises:
        SoakError: it has not within the limit; what it did instead is said.
        RunStoppedError: `control` asked for it.
        ThermometerError: the thermometer does not answer.
    """
    observer(SoakStarted(settings.band, settings.duration, settings.limit))
    began = time.monotonic()
    look = min(settings.duration / LOOKS, LONGEST_LOOK)
    steady: list[tuple[float, float]] = []  # time and temperature, as far back as all fit into the band
    while True:
        now, celsius = time.monotonic(), thermometer.celsius()
        if steady and now - steady[-1][0] > look + LATE:
            steady.clear()
        steady.append((now, celsius))
        while steady and not _fits(settings, [reading for _, reading in steady]):
            steady.pop(0)
        if steady and now - steady[0][0] >= settings.duration:
            observer(SoakEnded(celsius, now - began))
            return
        if now - began >= settings.limit:
            raise SoakError(_unsettled(settings, celsius, now - steady[0][0] if steady else 0.0))
        _wait_until(min(now + look, began + settings.limit), observer, control)


def _fits(settings: Soak, readings: list[float]) -> bool:
    if settings.middle is not None:
        return all(abs(reading - settings.middle) <= settings.band / 2 for reading in readings)
    return max(readings) - min(readings) <= settings.band


def _unsettled(settings: Soak, celsius: float, steady: float) -> str:
    about = "" if settings.middle is None else f" about {settings.middle:g} C"
    return (
        f"soak: the temperature did not stay within a band of {settings.band:g} K{about} for {settings.duration:g} s "
        f"in {settings.limit:g} s; it is {celsius:.2f} C and has been within the band for {steady:.0f} s; see to the "
        "room, or allow more"
    )


def _wait_until(end: float, observer: Observer, control: RunControl) -> None:
    while (left := end - time.monotonic()) > 0:
        control.carry_out(partial(time.sleep, min(left, SLICE)), observer)
