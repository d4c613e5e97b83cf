"""Functions that a tester's controller may lack, and the consequences for people at the machine."""

from collections.abc import Collection, Mapping
from enum import StrEnum


class Lack(StrEnum):
    """A function that a controller does not have, so that the driver cannot use it."""

    WATCHDOG = "watchdog"
    EMERGENCY_STOP = "emergency_stop"
    COMMAND_NUMBERS = "command_numbers"
    VALUES_IN_FORCE = "values_in_force"
    READ_BACK = "read_back"
    STATUS_AGE = "status_age"
    CHECKSUM = "checksum"
    INTERLOCKS = "interlocks"
    DETECTORS = "detectors"
    LIMITS = "limits"
    FORCE_SWING = "force_swing"


CONSEQUENCES: Mapping[Lack, str] = {
    Lack.WATCHDOG: "it goes on moving when program, computer or line are lost; then only the red button stops it",
    Lack.EMERGENCY_STOP: "if it does not obey a stop, only hydraulics off can follow, and then the red button",
    Lack.COMMAND_NUMBERS: "a command that was delayed on the way, or is another client's, looks like the last one here",
    Lack.VALUES_IN_FORCE: (
        "amplitude and frequency are known only as they were sent; commands of another client show in the records"
    ),
    Lack.READ_BACK: "a value that changed on the line moves the actuator, within its own limits and the rig's",
    Lack.STATUS_AGE: "a status that stands still is noticed while it cycles, not at rest",
    Lack.CHECKSUM: "a bit that changes on a TCP line is noticed where the value is implausible",
    Lack.INTERLOCKS: "the program does not know what stopped it; look at its own display",
    Lack.DETECTORS: "limits and actions of its detectors are not known here; no sequence tightens them",
    Lack.LIMITS: "its own limits on commands are not known here; the rig's limits are all that is checked before",
    Lack.FORCE_SWING: "only the mean force is compared with the rig's limit while it cycles",
}
"""The meaning of each lack for people at the machine."""

NEEDS_CONSENT = frozenset({Lack.WATCHDOG, Lack.EMERGENCY_STOP})
"""Functions without which a stop may fail. `tester_without` in the configuration has to name those that are missing."""


def lack_text(lack: Lack) -> str:
    """A lack and its consequence, as the end of a sentence about the tester."""
    return f"no {lack.replace('_', ' ')}: {CONSEQUENCES[lack]}"


def unaccepted(lacks: Collection[Lack], without: Collection[Lack]) -> str:
    """Why a tester that `lacks` these functions is not driven, and what to do; empty where it is driven.

    Args:
        lacks: what the controller does not have.
        without: what it may lack by the configuration.
    """
    needed = sorted(NEEDS_CONSENT & set(lacks))
    if set(needed) <= set(without):
        return ""
    meanings = "; ".join(lack_text(each) for each in needed if each not in without)
    named = ", ".join(f'"{each}"' for each in needed)
    return f"{meanings}. Where that is acceptable, write into jointlab.toml: tester_without = [{named}]"
