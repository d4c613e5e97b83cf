"""Units of Universal File Format data: labels of functions, and dataset 164."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

GRAVITY = 9.80665
"""Standard acceleration of free fall, m/s^2 (ISO 80000-3)."""


class UffQuantity(IntEnum):
    """Specific data types of dataset 58 with a name."""

    UNKNOWN = 0
    GENERAL = 1
    DISPLACEMENT = 8
    REACTION_FORCE = 9
    VELOCITY = 11
    ACCELERATION = 12
    FORCE = 13
    TIME = 17
    FREQUENCY = 18


MOTIONS = (UffQuantity.DISPLACEMENT, UffQuantity.VELOCITY, UffQuantity.ACCELERATION)
FORCES = (UffQuantity.FORCE, UffQuantity.REACTION_FORCE)
"""Data types that mean a force; programs differ in which they write."""


@dataclass(frozen=True)
class Unit:
    """The meaning of a label: the quantity, and the factor to its SI unit."""

    quantity: UffQuantity
    factor: float


@dataclass(frozen=True)
class FileUnits:
    """Units that dataset 164 states: m and N of one unit of length and of force.

    `doubt` is set where its code and its factors contradict each other; it then states no unit.
    """

    length: float = 1.0
    force: float = 1.0
    doubt: str = ""

    def factor(self, quantity: int, *, turning: bool = False) -> float | None:
        """To SI; None for a quantity that is neither motion nor force. If `turning`, to rad and N m."""
        if quantity in MOTIONS:
            return 1.0 if turning else self.length
        return (self.length if turning else 1.0) * self.force if quantity in FORCES else None


_FOOT, _INCH, _KILOGRAM_FORCE = 0.3048, 0.0254, GRAVITY
_POUND_FORCE = 0.45359237 * GRAVITY
_POUNDAL = 0.45359237 * _FOOT
_LENGTHS = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "micron": 1e-6,
    "in": _INCH,
    "inch": _INCH,
    "mil": 1e-3 * _INCH,
    "ft": _FOOT,
}
_UNITS: Mapping[str, Unit] = {
    **{name: Unit(UffQuantity.DISPLACEMENT, factor) for name, factor in _LENGTHS.items()},
    **{f"{name}/s": Unit(UffQuantity.VELOCITY, factor) for name, factor in _LENGTHS.items()},
    **{f"{name}/s^2": Unit(UffQuantity.ACCELERATION, factor) for name, factor in _LENGTHS.items()},
    **{name: Unit(UffQuantity.ACCELERATION, GRAVITY) for name in ("g", "gn", "g_n")},
    "mg": Unit(UffQuantity.ACCELERATION, 1e-3 * GRAVITY),
    **{name: Unit(UffQuantity.FORCE, 1.0) for name in ("N", "newton", "newtons")},
    **{f"{prefix}N": Unit(UffQuantity.FORCE, factor) for prefix, factor in (("m", 1e-3), ("da", 10.0), ("k", 1e3))},
    "MN": Unit(UffQuantity.FORCE, 1e6),
    **{name: Unit(UffQuantity.FORCE, _POUND_FORCE) for name in ("lbf", "lb", "lbs", "poundf")},
    **{name: Unit(UffQuantity.FORCE, _KILOGRAM_FORCE) for name in ("kgf", "kp")},
}
_LOWER = {name.lower(): unit for name, unit in _UNITS.items() if name not in ("mN", "MN")}
_PER_MASS = ("1/kg", "kg^-1")
_CODES = {
    1: (1.0, 1.0),
    2: (_FOOT, _POUND_FORCE),
    3: (1.0, _KILOGRAM_FORCE),
    4: (_FOOT, _POUNDAL),
    5: (1e-3, 1e-3),
    6: (1e-2, 1e-2),
    7: (_INCH, _POUND_FORCE),
    8: (1e-3, _KILOGRAM_FORCE),
    10: (1e-3, 1.0),
}
"""m and N of one unit of length and force, by the units code of dataset 164; of other codes the factors count."""


def unit_of(label: str) -> Unit | None:
    """The unit that a label names, in the spellings of various programs; None where it is not known."""
    text = _plain(label)
    return _UNITS.get(text) or _LOWER.get(text.lower())


def ratio_of(label: str) -> tuple[Unit, Unit] | None:
    """Numerator and denominator of a label such as ``(m/s^2)/N``; None where it is no such ratio."""
    text = _plain(label)
    if text.lower() in _PER_MASS:
        return _UNITS["m/s^2"], _UNITS["N"]
    top, _, bottom = text.rpartition("/")
    over, under = unit_of(top), unit_of(bottom)
    return (over, under) if over and under and over.quantity in MOTIONS and under.quantity in FORCES else None


def file_units(dataset: Mapping[str, Any]) -> FileUnits:
    """The units of dataset 164 as pyuff reads it; its factors divide values of the file to give SI."""
    code, factors = dataset["units_code"], (float(dataset["length"]), float(dataset["force"]))
    if not all(math.isfinite(factor) and factor > 0 for factor in factors):
        return FileUnits(doubt=f"dataset 164 has the factors {factors[0]:g} and {factors[1]:g}")
    length, force = (1 / factor for factor in factors)
    stated = _CODES.get(code, (length, force))
    if not (math.isclose(length, stated[0], rel_tol=1e-3) and math.isclose(force, stated[1], rel_tol=1e-3)):
        return FileUnits(
            doubt=f"units code {code} of dataset 164 contradicts its factors {factors[0]:g}, {factors[1]:g}"
        )
    return FileUnits(length, force)


def units_by_dataset(datasets: Sequence[Mapping[str, Any]]) -> list[FileUnits | None]:
    """The units that dataset 164 states for each dataset of a file; None where the file has no dataset 164.

    One holds for the whole file, as programs write it before the data or after. Of several that differ, each holds for
    what follows it, and what comes before the first is in doubt.
    """
    stated = [file_units(each) for each in datasets if each["type"] == 164]
    now = stated[0] if stated else None
    if len(set(stated)) > 1:
        now = FileUnits(doubt="the datasets 164 of the file differ, and none comes before")
    found = []
    for each in datasets:
        now = file_units(each) if each["type"] == 164 else now
        found.append(now)
    return found


def _per_second(power: re.Match[str]) -> str:
    return "/s" if power[1] == "1" else "/s^2"


def _plain(label: str) -> str:
    """Without blanks and brackets around, in one spelling; a superscript or mu that was no UTF-8 arrives as U+FFFD.

    A product with a negative power, such as ``m s^-2``, becomes a quotient while its blanks still part it.
    """
    text = re.sub(r"(?<=\w)[ *.]+[sS](?:ec)?(?:\^|\*\*)?-([12])(?!\d)", _per_second, label)
    text = re.sub(r"\s", "", text).replace("**", "^").replace("sec", "s")
    text = re.sub("[µμ\ufffd](?=m)", "u", text)
    text = re.sub("/[sS](/[sS]|[2²\ufffd])", "/s^2", text)
    while text[:1] + text[-1:] in ("()", "[]") and not set("()[]") & set(text[1:-1]):
        text = text[1:-1]
    return text
