"""Whether a tester behaves as this program needs: checks that its maker can run, too.

The first checks move nothing and leave hydraulics off. The others switch them on, move the actuator to 0.2 mm, cycle it
there with up to 0.1 mm peak to peak, stop it, and trip its watchdog and its emergency stop.
"""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager

from rig.checks.check import Check, CheckState, failed, judged, not_done
from rig.checks.tester_checks import TRIPS, checks_of_tester, checks_of_trips
from rig.errors import RigError
from rig.registers import Action, Interlock
from rig.tester.driver import Tester
from rig.tester.limits import HARD_CAPS, TesterLimits
from rig.tester.missing_functions import CONSEQUENCES, Lack
from rig.tester.monitor import monitored
from rig.tester.rest_judge import LONGEST_RAMP, POWERLESS, REST_PP
from rig.tester.status import CYCLING, TesterRefusedError, TesterStatus
from rig.tester.wire import URGENT_TIMEOUT

SUBJECT = "tester"
STATUSES, STATUS_INTERVAL = 20, 0.02  # number of statuses that a check reads, and s between two
PRESET = 2e-4  # m
PRESET_WITHIN = 2e-5  # m
SMALLEST_PP, SMALL_PP, LARGE_PP = 1e-5, 5e-5, 1e-4  # m
FREQUENCY = 20.0  # Hz
CYCLES = 20  # cycles by which the frequency is measured
SETTLING = 10.0  # s that an amplitude may take
RATIO_WITHIN, FREQUENCY_WITHIN = 0.2, 0.05
"""Largest relative difference of the ratio of two amplitudes, and of the frequency, from what was commanded."""
REST_TIME = 0.5  # s for which the actuator has to stay at rest
MOVE = "it moves the actuator; clear the machine, then allow it (--move)"
MOTIONS = ("refusal_in_motion", "preset", "amplitude", "frequency", "halt", "rest", *TRIPS)
Connect = Callable[[TesterLimits], AbstractContextManager[Tester]]


def check_tester(connect: Connect, *, move: bool = False) -> tuple[Check, ...]:
    """Run every check. After one that cannot be done the rest is left out; after a failed one nothing moves.

    Args:
        connect: to the tester, for motion within these limits; called twice.
        move: whether the actuator may move.
    """
    checks = list[Check]()
    try:
        with connect(TesterLimits()) as tester:
            serial = tester.identity.serial
            checks += checks_of_tester(tester, {}, {})
            for check in (_replies, _status, _loosened, _hold):
                checks.append(check(tester))
        began = time.monotonic()
        with connect(TesterLimits(highest_frequency=HARD_CAPS["highest_frequency"][1])) as tester:
            same, took = tester.identity.serial == serial, time.monotonic() - began
            advice = "after a lost connection it has to be the same tester, and answer again"
            checks.append(judged("reconnect", SUBJECT, same, advice, took, unit="s"))
            if move and all(each.state is not CheckState.FAILED for each in checks):
                _motion(tester, checks)
    except RigError as error:
        checks.append(failed("tester" if checks else "identity", SUBJECT, error))
    done, why = {check.id for check in checks}, "an earlier check failed" if move else MOVE
    return (*checks, *(not_done(each, SUBJECT, why) for each in MOTIONS if each not in done))


def _replies(tester: Tester) -> Check:
    slowest = 0.0
    for _ in range(STATUSES):
        began = time.monotonic()
        tester.status()
        slowest = max(slowest, time.monotonic() - began)
    advice = "a stop waits for the reply to one status: make it quicker, or the line"
    return judged("reply", SUBJECT, slowest <= URGENT_TIMEOUT, advice, slowest, URGENT_TIMEOUT, "s")


def _status(tester: Tester) -> Check:
    try:
        for _ in range(STATUSES):
            tester.measured()
            time.sleep(STATUS_INTERVAL)
    except RigError as error:
        return failed("status", SUBJECT, error)
    shown = "plausible" if Lack.STATUS_AGE in tester.identity.lacks else "plausible, and shows the latest heartbeat"
    return judged("status", SUBJECT, True, "", shown)


def _loosened(tester: Tester) -> Check:
    detector = tester.identity.detectors.get(Interlock.FORCE)
    if detector is None:
        return not_done("refusals", SUBJECT, f"it shows no detectors: {CONSEQUENCES[Lack.DETECTORS]}")
    answer: RigError | None = None
    try:
        tester.set_detector(Interlock.FORCE, 1.01 * detector.limit, Action.INDICATE)
    except RigError as error:  # such as that another limit than was sent is in force
        answer = error
    finally:
        kept = tester.detectors()[Interlock.FORCE] == detector
        if not kept:
            tester.set_detector(Interlock.FORCE, detector.limit, detector.action)
    refused = isinstance(answer, TesterRefusedError)
    if answer is not None and kept and not refused:
        return failed("refusals", SUBJECT, answer)
    advice = "the network loosened its force detector: it may tighten detectors only"
    return judged("refusals", SUBJECT, refused and kept, advice, "accepted" if answer is None else str(answer))


def _hold(tester: Tester) -> Check:
    before = tester.status().state
    tester.stop()
    tester.check_obeys()
    after = tester.status().state
    advice = "a hold at rest must not switch hydraulics on"
    return judged("hold", SUBJECT, before not in POWERLESS or after in POWERLESS, advice, after.name.lower())


def _motion(tester: Tester, checks: list[Check]) -> None:
    with monitored(tester):
        tester.start()
        tester.preset(PRESET)
        mean = tester.status().displacement_mean
        advice = "it says that it holds the preset and measures another position: check its zero and its unit, m"
        checks.append(judged("preset", SUBJECT, abs(mean - PRESET) <= PRESET_WITHIN, advice, mean, PRESET, "m"))
        checks.append(_refused_frequency(tester))
        checks += _cycling(tester)
        tester.cycle(LARGE_PP, FREQUENCY)
        tester.wait(lambda status: status.state in CYCLING and status.cycles > 2, "cycle", SETTLING)
        began = time.monotonic()
        tester.halt()
        tester.check_obeys()
        took, cycles = time.monotonic() - began, tester.status().cycles
        checks.append(judged("halt", SUBJECT, took <= LONGEST_RAMP, "a stop takes too long", took, LONGEST_RAMP, "s"))
        time.sleep(REST_TIME)
        status = tester.status()
        latest_pp = max(status.displacement_pp[:1], default=0.0) if status.cycles != cycles else 0.0
        advice = "it moves on after it was at rest"
        checks.append(judged("rest", SUBJECT, latest_pp <= REST_PP, advice, latest_pp, REST_PP, "m"))
    tester.release()
    checks += checks_of_trips(tester)


def _refused_frequency(tester: Tester) -> Check:
    limit = tester.identity.limits.get("frequency_limit")
    if limit is None or 1.01 * limit > tester.limits.highest_frequency:
        return not_done("refusal_in_motion", SUBJECT, "its limit on frequency is not known, or as high as any may be")
    refused = ""
    try:
        tester.cycle(SMALLEST_PP, 1.01 * limit)
    except TesterRefusedError as error:
        refused = str(error)
    still = tester.status().state not in CYCLING
    tester.stop()
    advice = f"{1.01 * limit:g} Hz is beyond its limit and was not refused"
    return judged("refusal_in_motion", SUBJECT, bool(refused) and still, advice, refused or "accepted")


def _cycling(tester: Tester) -> list[Check]:
    """Cycle with two amplitudes, and count."""
    measured, frequency = list[float](), 0.0
    for amplitude in (SMALL_PP, LARGE_PP):
        tester.cycle(amplitude, FREQUENCY)
        first = _after(tester, CYCLES)
        began = time.monotonic()
        last = _after(tester, first.cycles + CYCLES)
        frequency = (last.cycles - first.cycles) / (time.monotonic() - began)
        measured.append(max(last.displacement_pp[:1], default=0.0))
    ratio = measured[1] / measured[0] if measured[0] else 0.0
    wanted = LARGE_PP / SMALL_PP
    return [
        judged(
            "amplitude", SUBJECT, abs(ratio / wanted - 1) <= RATIO_WITHIN,
            "twice the amplitude was commanded and not measured: does it take amplitudes over, and measure them?",
            ratio, wanted,
        ),
        judged(
            "frequency", SUBJECT, abs(frequency / FREQUENCY - 1) <= FREQUENCY_WITHIN,
            "cycles are counted at another rate than was commanded", frequency, FREQUENCY, "Hz",
        ),
    ]  # fmt: skip


def _after(tester: Tester, cycles: int) -> TesterStatus:
    return tester.wait(lambda status: status.cycles >= cycles, f"count {cycles} cycles", SETTLING)
