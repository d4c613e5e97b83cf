"""Sections of paragraphs, tables and pictures; terminal, report and page show them, each in its own way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from analysis.frequency_response import Real


@dataclass(frozen=True)
class Unknown:
    """A cell that is greyed, because `why`."""

    text: str
    why: str


@dataclass(frozen=True)
class Share:
    """A share from 0 to 1 with its text; the page draws it as a bar."""

    value: float
    text: str

    @classmethod
    def of(cls, value: float, decimals: int = 0) -> Share:
        """The share, written in per cent."""
        return cls(value, f"{100 * value:.{decimals}f} %")


Cell = str | Unknown | Share


@dataclass(frozen=True)
class Table:
    """A table; a row's cells are texts, numbers already written as people read them."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Picture:
    """An inline SVG element with its caption."""

    caption: str
    svg: str


@dataclass(frozen=True)
class Notice:
    """A paragraph that a reader must not miss; `failed` where results are not to be relied on."""

    text: str
    failed: bool = False


Item = str | Notice | Table | Picture


@dataclass(frozen=True)
class Section:
    """A heading and the items under it, in order; a text is a paragraph."""

    title: str
    content: tuple[Item, ...]


_MOST_DIGITS = 15  # of a float
NO_BREAK = "\u00a0"
THIN = "\u202f"
"""A thin space at which no line breaks."""


def number(value: float, digits: int = 3) -> str:
    """A number with `digits` significant digits and thin spaces between thousands; a dash where it is not known."""
    if math.isnan(value):
        return "–"
    magnitude = abs(value)
    if magnitude >= 10 ** (digits + 4) or (0 < magnitude < 1e-4):
        return f"{value:.{digits - 1}e}"
    decimals = max(0, digits - 1 - _exponent(magnitude))
    return f"{value:,.{decimals}f}".replace(",", THIN)


def ends(interval: Sequence[float] | Real, digits: int = 3) -> str:
    """Both ends of an interval, or a dash where one is not known; with more digits where they would look alike."""
    low, high = (float(end) for end in interval)
    if math.isnan(low) or math.isnan(high):
        return "–"
    digits = _digits(low, high, digits)
    return f"{number(low, digits)} … {number(high, digits)}"


def with_ends(value: float, interval: Sequence[float] | Real) -> str:
    """A value with the ends of its interval in brackets, to the same digits; a line breaks between the two only."""
    low, high = (float(end) for end in interval)
    digits = 3 if math.isnan(low) or math.isnan(high) else _digits(low, high, 3)
    return f"{number(value, digits)} [{ends(interval, digits).replace(' ', NO_BREAK)}]"


def _digits(low: float, high: float, digits: int) -> int:
    """Number of significant digits that tell both ends apart, at least `digits`."""
    if high <= low:
        return digits
    return max(digits, min(_exponent(max(abs(low), abs(high))) - _exponent(high - low) + 2, _MOST_DIGITS))


def _exponent(magnitude: float) -> int:
    return int(f"{magnitude:e}".partition("e")[2])
