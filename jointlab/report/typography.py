"""Text as it is set for people: signs in place of what a keyboard has, and no number parted from its unit."""

import re

from jointlab.report.section import NO_BREAK, THIN

NO_BREAK_HYPHEN = "\u2011"
JOINER = "\u2060"
"""Word joiner, a character without width: without it a line may break after a dash, even before a no-break space."""
_SIGNS = (
    (re.compile(r"(?<=[\d)]) ?\+- ?"), " ± "),
    (re.compile(r"\+- ?"), "±"),
    (re.compile(r"(?<=\d) ?\.\. ?(?=-?\d)"), f"{THIN}–{THIN}"),
    (re.compile(r"(?<=\w)\^3\b"), "³"),
    (re.compile(r"(?<=\w)\^2\b"), "²"),
)
_UNITS = (
    "%", "°C", "K", "Hz", "kHz", "MN/m", "kN/m", "N/m", "kN", "N", "mm", "µm", "m", "µs", "ms", "s", "min", "h",
    "kg/m³", "kg", "g", "GPa", "Pa", "dB", "mV", "V", "(m/s²)/N", "m/s²", "EI/L",
)  # fmt: skip
_BEFORE_UNIT = re.compile(rf"(?<=[\d\]]) (?=(?:{'|'.join(map(re.escape, _UNITS))})(?!\w))")
_IN_UNIT = re.compile(r"(?<=\bN) (?=m\b)")
_AT_SIGN = re.compile(r" (?=[…±] )|(?<=[…±]) (?=[^\[\]]*\])")
_AFTER_COMMA = re.compile(r"(?<=,) (?=%)")
_BESIDE_EQUALS = re.compile(r"(?<=\b\w) (?== \d)|(?<=\b\w\s=) (?=\d)")
_HYPHEN = re.compile(r"(?<=\bp)-(?=p\b)|(?<=\b\d{4})-(?=\d\d-\d\d)|(?<=\d{4}[-\u2011]\d\d)-(?=\d\d)")
_IN_TIME = re.compile(r"(?<=\d\d-\d\d) (?=\d\d:\d\d)")


def with_signs(text: str) -> str:
    """A text of the analysis with ± for "+-", a dash for ".." between two numbers, and ², ³ for "^2", "^3"."""
    for pattern, sign in _SIGNS:
        text = pattern.sub(sign, text)
    return text


def kept_together(text: str) -> str:
    """The text with spaces and hyphens that do not break inside a quantity, a date and a time.

    An interval breaks behind its sign, where no brackets hold it: both of its numbers on one line would make columns
    too wide.
    """
    for pattern in (_BEFORE_UNIT, _IN_UNIT, _AT_SIGN, _AFTER_COMMA, _BESIDE_EQUALS, _IN_TIME):
        text = pattern.sub(NO_BREAK, text)
    return _HYPHEN.sub(NO_BREAK_HYPHEN, text).replace(f"–{THIN}", f"–{JOINER}{THIN}")
