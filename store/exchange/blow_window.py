"""The window on the records of blows, as stated in bundle and catalogue.

``none`` (or ``rectangular``, ``uniform``), ``force 0.05 s``, ``exponential 0.5 s``, or both with a comma between them.
The number of a force window is how long force counts. That of an exponential window is its time constant, or in
``exponential 5 %`` the rest of a signal at the end of the record.
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
        force_seconds: after this time from the blow, force counts as zero; None where all of it counts.
        time_constant: s in which the exponential window falls to 1/e; None without one.
    """

    force_seconds: float | None = None
    time_constant: float | None = None

    def __str__(self) -> str:
        named = {"force": self.force_seconds, "exponential": self.time_constant}
        return ", ".join(f"{name} {value!r} s" for name, value in named.items() if value is not None) or PLAIN[0]

    @property
    def decay(self) -> float:
        """Decay rate of the exponential window, 1/s; zero without one."""
        return 0.0 if self.time_constant is None else 1 / self.time_constant

    @classmethod
    def parse(cls, text: str, block_seconds: float) -> BlowWindow:
        """Read a window on records of `block_seconds`; StoreError if it cannot be corrected for."""
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


def stated_window(text: str, block_seconds: float) -> tuple[BlowWindow, str | None]:
    """The stated window of an imported record, or no window and the reason, where it cannot be corrected for."""
    try:
        return BlowWindow.parse(text, block_seconds), None
    except StoreError as error:
        return BlowWindow(), f"{error}; it is taken for none, and the damping that it adds stays"


def _part(text: str, block_seconds: float) -> tuple[str, float] | None:
    """Name of the window and its seconds; None if it cannot be corrected for."""
    match = _PART.fullmatch(text)
    if match is None:
        return None
    name, value, unit = match[1], float(match[2]), match[3]
    if unit == "s":
        return (name, value) if 0 < value < math.inf else None
    left = value / 100
    return (name, block_seconds / -math.log(left)) if name == "exponential" and 0 < left < 1 else None
