"""Names of the laws of time-temperature shifts; apart from `time_temperature`, so that options load no numpy."""

from enum import StrEnum


class ShiftLaw(StrEnum):
    """How frequencies shift with temperature."""

    WLF = "wlf"
    ARRHENIUS = "arrhenius"
