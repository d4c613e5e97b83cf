"""The window on the records of blows, as bundle and catalogue state it.

``none`` (or ``rectangular``, ``uniform``), ``force 0.05 s``, ``exponential 0.5 s``, or both with a comma between them.
A force window says how long force counts; an exponential window its time constant, or as ``exponential 5 %`` what is
left of a signal at the end of the record.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from store.errors import StoreError

PLAIN = ("none", "rectangular", "uniform")
_PART = re.compile(r"(force|exponential) (\d+(?:\.\d+)?(?:e-?\d+)?) ?(s|%)")


@dataclass(frozen=True)
class BlowWindow:
    """A window; by default none.

    Attributes:
        force_seconds: from the blow on, after which force counts as nil; None where all of it counts.
        time_constant: s in which the exponential window falls to 1/e; None without one.
    """

    force_seconds: float | None = None
    time_constant: float | None = None

    def __str__(self) -> str:
        named = {"force": self.force_seconds, "exponential": self.time_constant}
        return ", ".join(f"{name} {value!r} s" for name, value in named.items() if value is not None) or PLAIN[0]

    @property
    def decay(self) -> float:
        """Of the exponential window, 1/s; nought without one."""
        return 0.0 if self.time_constant is None else 1 / self.time_constant

    @classmethod
    def parse(cls, text: str, block_seconds: float) -> BlowWindow:
        """Read a window on records of `block_seconds`.

        Raises:
            StoreError: it is no window, or one that nobody can correct for.
        """
        if text.strip().lower() in PLAIN:
            return cls()
        parts = [_part(each.strip(), block_seconds) for each in text.lower().split(",")]
        found = dict(part for part in parts if part is not None)
        if len(found) < len(parts):
            raise StoreError(
                f"{text!r} is not a window that can be corrected for; write none, force 0.05 s, exponential 0.5 s "
                "(its time constant), exponential 5 % (what it leaves at the end), or both with a comma"
            )
        return cls(found.get("force"), found.get("exponential"))


NO_WINDOW = BlowWindow()
"""Plain records."""


def stated_window(text: str, block_seconds: float) -> tuple[BlowWindow, str | None]:
    """The window that somebody else's record is stated to have; where nobody could correct for it, none, and why."""
    try:
        return BlowWindow.parse(text, block_seconds), None
    except StoreError as error:
        return NO_WINDOW, f"{error}; it is taken for none, and what it adds to the damping stays"


def _part(text: str, block_seconds: float) -> tuple[str, float] | None:
    """Which window it is, and its seconds; None where it is none that can be corrected for."""
    match = _PART.fullmatch(text)
    if match is None:
        return None
    name, value, unit = match[1], float(match[2]), match[3]
    if unit == "s":
        return (name, value) if 0 < value < math.inf else None
    left = value / 100
    return (name, block_seconds / -math.log(left)) if name == "exponential" and 0 < left < 1 else None
