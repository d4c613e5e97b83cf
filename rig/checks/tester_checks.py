"""Checks of the tester: identity, interlocks, and where it is allowed, whether watchdog and emergency stop trip."""

import time
from collections.abc import Callable, Mapping

from daq.channels import Channel
from rig.checks.check import Check, judged, not_done
from rig.registers import Interlock
from rig.sequences.sequence import DISPLACEMENT, FORCE
from rig.tester.driver import Tester
from rig.tester.missing_functions import CONSEQUENCES, Lack
from rig.tester.status import stopping_text

WATCHDOG_MARGIN = 1.0  # s beyond its time until which a watchdog may trip
STOP_WITHIN = 0.5  # s until an emergency stop shows
POLL = 0.02  # s
AGREES = 0.01
"""Difference of a channel from the tester's own reading, over its range."""
BY_OPTION = " (--trip)"
"""End of an advice at the terminal; the page has a box in its place."""
CONSENT = f"it switches hydraulics on; clear the machine, then allow it{BY_OPTION}"
TRIPS = ("watchdog", "emergency_stop")


def checks_of_tester(tester: Tester, readings: Mapping[str, float], channels: Mapping[str, Channel]) -> list[Check]:
    """Checks that command nothing.

    Args:
        tester: connected.
        readings: mean of displacement and force by name of their channel, m and N, as acquired at rest.
        channels: the channel table by name.
    """
    identity, status = tester.identity, tester.status()
    own = {DISPLACEMENT: status.displacement_mean, FORCE: status.force_mean}
    held = stopping_text(status.stopped_by) if status.is_stopped else ""
    lacks = ", ".join(each.replace("_", " ") for each in sorted(identity.lacks))
    found = [
        judged("capabilities", "tester", True, "", f"without {lacks}" if lacks else "all that this driver uses"),
        judged("identity", "tester", True, "", f"{identity.serial}, {identity.map_name}"),
        judged("interlocks", "tester", not held, "remove the cause, then reset the tester", held or "none"),
    ]
    for name, reading in readings.items():
        most = AGREES * max(abs(channels[name].minimum), abs(channels[name].maximum))
        difference = reading - own[name]
        advice = f"the tester itself reads {own[name]:g} {channels[name].unit}: check cable, sensitivity and zero"
        good = abs(difference) <= most
        found.append(judged("tester_reading", name, good, advice, difference, most, channels[name].unit))
    return found


def checks_of_trips(tester: Tester, check_may_drive: Callable[[], None] = lambda: None) -> list[Check]:
    """Trip the watchdog and the emergency stop with hydraulics on and the actuator at rest, and reset both.

    Args:
        check_may_drive: called before hydraulics are switched on; raises what forbids it.

    Raises:
        RunStoppedError: STOP is in force.
        RigError: the tester does not answer.
    """
    status = tester.status()
    if status.is_stopped:
        return [not_done(each, "tester", "remove the cause of its trip, then reset the tester") for each in TRIPS]
    time_set, lacks = tester.identity.watchdog_time, tester.identity.lacks
    return [
        not_done("watchdog", "tester", f"it has none: {CONSEQUENCES[Lack.WATCHDOG]}")
        if time_set is None
        else _watchdog(tester, time_set, check_may_drive),
        not_done("emergency_stop", "tester", f"the network has none: {CONSEQUENCES[Lack.EMERGENCY_STOP]}")
        if Lack.EMERGENCY_STOP in lacks
        else _emergency_stop(tester, check_may_drive),
    ]


def _watchdog(tester: Tester, time_set: float, check_may_drive: Callable[[], None]) -> Check:
    check_may_drive()
    tester.start()
    waited = tester.withhold_heartbeat(time_set + WATCHDOG_MARGIN)
    if waited is None:
        advice = "it did not trip without heartbeats: do not drive this tester, a lost program would not stop it"
        return judged("watchdog", "tester", False, advice, "no trip", time_set + WATCHDOG_MARGIN, "s")
    tester.reset()
    return judged("watchdog", "tester", True, "", waited, time_set + WATCHDOG_MARGIN, "s")


def _emergency_stop(tester: Tester, check_may_drive: Callable[[], None]) -> Check:
    check_may_drive()
    tester.start()
    began = time.monotonic()
    tester.emergency_stop()
    tripped = _within(STOP_WITHIN, lambda: tester.has_tripped(Interlock.EMERGENCY_STOP))
    waited = time.monotonic() - began
    if tripped:
        tester.reset()
    advice = "its coil was written and nothing happened: do not drive this tester; the red button has to be at hand"
    measured = waited if tripped else "no trip"
    return judged("emergency_stop", "tester", tripped, advice, measured, STOP_WITHIN, "s")


def _within(seconds: float, happens: Callable[[], bool]) -> bool:
    end = time.monotonic() + seconds
    while not (seen := happens()) and time.monotonic() < end:
        time.sleep(POLL)
    return seen
