"""Names of the laws of frequency that joints may follow; apart from `frequency_laws`, so that options load no numpy."""

from enum import StrEnum


class FrequencyLaw(StrEnum):
    """How the k + i h of every joint depends on frequency."""

    AUTO = "auto"
    """The law of most evidence; constant joints win where they are true."""
    CONSTANT = "constant"
    POWER = "power"
    ZENER = "zener"
