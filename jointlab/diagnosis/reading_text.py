"""Readings of instruments in words, for the people who read them; data and commands have their ids."""

from jointlab.diagnosis.parameter_words import words_of

UNITS = {"1": "a ratio", "deg": "°"}
"""Units as people write them, where the data have them otherwise."""


def reading_words(name: str) -> str:
    """A reading in words; its name where there are none for it.

    Args:
        name: effect and parameter, joined by a point, such as channel_delay.tau or joint_mass.m_II.
    """
    effect, _, parameter = name.partition(".")
    return words_of(effect, parameter) or name


def unit_words(unit: str) -> str:
    """A unit as people write it."""
    return UNITS.get(unit, unit)


def reading_label(name: str, unit: str) -> str:
    """A reading in words with its unit in brackets."""
    return f"{reading_words(name)} ({unit_words(unit)})"
