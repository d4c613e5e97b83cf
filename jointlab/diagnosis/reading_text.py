"""Readings of instruments in words, for the people who read them; data and commands have their ids."""

from analysis.gap.experiments.catalogue import CHECKS
from analysis.gap.experiments.expected_data import reading_of
from jointlab.diagnosis.parameter_words import words_of

UNITS = {"1": "a ratio", "deg": "°"}
"""Units as people write them, where the data have them otherwise."""


def reading_words(name: str) -> str:
    """A reading in words; its name where there are none for it.

    Args:
        name: effect and parameter, joined by a point, such as channel_delay.tau or joint_mass.m_II.
    """
    effect, _, parameter = name.partition(".")
    words = words_of(effect, parameter)
    if words is None:
        return name
    return f"1 over the {words}" if _is_reciprocal(name) else words


def reading_unit(name: str, unit: str) -> str:
    """The unit of a reading.

    Args:
        name: effect and parameter, joined by a point.
        unit: of the parameter, such as Hz or N/m; a reading of 1 over it is in 1/Hz or m/N.
    """
    if not _is_reciprocal(name):
        return unit
    numerator, _, denominator = unit.partition("/")
    return f"{denominator or '1'}/{numerator}"


def _is_reciprocal(name: str) -> bool:
    """Whether an instrument reads 1 over the parameter, which is zero where the effect is not there."""
    found = (reading_of(name, check.readings) for check in CHECKS.values())
    return any(each is not None and each.reciprocal for each in found)


def unit_words(unit: str) -> str:
    """A unit as people write it."""
    return UNITS.get(unit, unit)


def reading_label(name: str, unit: str) -> str:
    """A reading in words with its unit in brackets."""
    return f"{reading_words(name)} ({unit_words(unit)})"
