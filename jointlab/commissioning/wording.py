"""Checks, verdicts and warnings in words."""

from collections.abc import Callable, Mapping
from typing import Any, cast

from jointlab.commissioning.warnings import RigWarning, WarningKind
from rig.checks.check import Check, CheckState, Measured
from store.states import Verdict

TITLES = {
    "identity": "connected",
    "input": "input",
    "sensor": "sensor by its TEDS",
    "overload": "largest value",
    "noise": "noise at rest",
    "hum": "mains hum",
    "zero": "zero",
    "reading": "reading",
    "capabilities": "offers",
    "interlocks": "interlocks",
    "tester_reading": "difference from the tester's own reading",
    "tester": "answers",
    "watchdog": "watchdog without heartbeat",
    "emergency_stop": "emergency stop",
    "tone": "calibrator tone",
    "sensitivity": "sensitivity",
    "blow": "force and acceleration together",
    "polarity": "polarity",
    "ratio": "apparent mass",
    "cables": "cables",
    "writable": "writable",
    "refusals": "refuses what it cannot do",
    "record": "shape of records",
    "rate": "samples a second",
    "reply": "slowest reply",
    "timestamps": "time of a record",
    "trigger": "end without a trigger",
    "trigger_index": "trigger index",
    "cancel": "end of a cancelled record",
    "volts": "known voltage",
    "sine": "known sine",
    "reconnect": "connected again",
    "status": "status",
    "hold": "hold at rest",
    "refusal_in_motion": "refuses what is beyond its limits",
    "preset": "preset",
    "amplitude": "ratio of two amplitudes",
    "frequency": "cycles a second",
    "halt": "STOP to rest",
    "rest": "motion after that",
}
"""The quantity that each check measures."""
NOMINAL = frozenset({
    "sensor", "tone", "sensitivity", "ratio", "polarity", "record", "rate", "trigger_index", "volts", "sine", "preset",
    "amplitude", "frequency",
})  # fmt: skip
"""Checks whose limit is the value that is expected."""
MM = 1e-3  # m
COLOURS = {CheckState.PASSED: "green", CheckState.FAILED: "red", CheckState.NOT_DONE: "yellow"}
WARNINGS = {
    WarningKind.CALIBRATION_OVER: "the calibration of {name} {serial} was valid until {due_on}; have it calibrated",
    WarningKind.NEVER_EXAMINED: "this rig was never examined",
    WarningKind.EXAMINED_LONG_AGO: "the rig was examined {days} days ago; an examination is valid for "
    "{valid_days:g} days",
    WarningKind.FAULTS_FOUND: "examination {examination} found faults: {faults}; correct them, then examine "
    "the rig again",
    WarningKind.INSTRUMENT_CHANGED: "the rig was not examined with {instrument} as it is now",
}
BY_EXAMINATION = frozenset({WarningKind.NEVER_EXAMINED, WarningKind.EXAMINED_LONG_AGO, WarningKind.INSTRUMENT_CHANGED})
"""Warnings for which a new examination is the remedy."""
VERDICTS = {
    Verdict.PASSED: "every check passed",
    Verdict.INCOMPLETE: "no check failed, some were not done",
    Verdict.FAILED: "the rig is not in order",
}


def with_unit(value: Measured, unit: str) -> str:
    """A measured value or limit as a text, lengths in um or mm; empty where there is none."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    scale, name = (1.0, unit) if unit != "m" else (1e6, "um") if abs(value) < MM else (1e3, "mm")
    return f"{scale * value:.3g} {name}".strip()


def limit_text(check: Check, write: Callable[[Measured, str], str] = with_unit) -> str:
    """The value that a check was compared with, and whether it is a limit; empty if there is none."""
    kind = "expected" if check.id in NOMINAL else "limit"
    return "" if check.limit is None else f"{kind} {write(check.limit, check.unit)}"


def check_text(check: Check) -> str:
    """One line: state, subject, what was measured and its limit, and what to do."""
    measured, limit = with_unit(check.measured, check.unit), limit_text(check)
    value = f" {measured}{f' ({limit})' if limit and measured else ''}" if measured else ""
    advice = f": {check.advice}" if check.advice else ""
    state = check.state.upper() if check.state is CheckState.FAILED else check.state
    return f"{state:<9} {check.subject}, {TITLES[check.id]}{value}{advice}"


def check_of(stored: Mapping[str, Any]) -> Check:
    """A check as a record has it."""
    return Check(**{**stored, "state": CheckState(stored["state"])})


def verdict_text(verdict: Verdict) -> str:
    """A verdict as a clause."""
    return VERDICTS[verdict]


def warning_text(warning: RigWarning) -> str:
    """Why the rig should be examined, or a sensor calibrated, before a run."""
    values = dict(warning.values)
    if warning.kind is WarningKind.FAULTS_FOUND:
        checks = cast("list[tuple[str, str]]", values.pop("checks"))
        values["faults"] = ", ".join(f"{subject}, {TITLES[check]}" for subject, check in checks)
    return WARNINGS[warning.kind].format(**values)
