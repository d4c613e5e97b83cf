"""Units of a size that people read easily, such as 29 µm for 2.9e-5 m: one choice for the page and for all
texts of a diagnosis.
"""

import math

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"))
"""Prefixes of the SI, the largest first."""
TAKING_A_PREFIX = frozenset({"N", "m", "s", "V", "A", "V/V", "C"})
"""Units that people read with any prefix."""
MASSES = ((1.0, "kg"), (1e-3, "g"), (1e-6, "mg"))
"""Units of mass in kg, the largest first."""


def prefix_of(size: float) -> tuple[float, str]:
    """The prefix that suits a size, as (factor, text); none for zero."""
    if not size:
        return 1.0, ""
    return next(((factor, text) for factor, text in PREFIXES if abs(size) >= factor), PREFIXES[-1])


def suited(unit: str, *values: float | None) -> tuple[float, str]:
    """The multiple of an SI unit that suits the largest of some values, as (its value in that unit, its text).

    A unit that nobody reads with a prefix stays as it is.
    """
    size = max((abs(each) for each in values if each is not None and math.isfinite(each)), default=0.0)
    if unit == "kg":
        return next(((factor, text) for factor, text in MASSES if size >= factor), MASSES[-1]) if size else MASSES[0]
    if unit not in TAKING_A_PREFIX:
        return 1.0, unit
    factor, text = prefix_of(size)
    return factor, f"{text}{unit}"
