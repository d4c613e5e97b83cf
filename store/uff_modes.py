"""Dataset 55 of the Universal File Format: shapes of modes, with frequency and hysteretic damping."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from store.dof import StoredDof

_AXES = ("x", "y", "z")
_WIDTH = 80


@dataclass(frozen=True)
class UffMode:
    """One mode.

    Attributes:
        number: from 1.
        frequency: Hz; loss_factor: written as hysteretic damping.
        shape: complex, by degree of freedom. Translations are written, others of a node as zero: programs read complex
            shapes with three values a node.
        texts: up to five lines for people.
    """

    number: int
    frequency: float
    loss_factor: float
    shape: Mapping[StoredDof, complex]
    texts: Sequence[str]


def mode_dataset(mode: UffMode) -> bytes:
    """A dataset of a complex mode (analysis type 2); numbers have 6 to 11 digits, as fit into their 13 columns."""
    texts = [*map(_plain, mode.texts), *["NONE"] * 5][:5]
    fields = (1, 2, 2, 8, 5, 3)  # structural, normal mode, translations, displacement, complex, three values a node
    lines = ["    -1", "    55", *texts, "".join(f"{each:10d}" for each in fields)]
    lines += [f"{2:10d}{4:10d}{1:10d}{mode.number:10d}", _row((mode.frequency, 1.0, 0.0, mode.loss_factor))]
    shape = {(dof.node, dof.direction): value for dof, value in mode.shape.items()}
    for node in sorted({dof.node for dof in mode.shape if dof.direction in _AXES}):
        vector = [shape.get((node, axis), 0j) for axis in _AXES]
        lines += [f"{node:10d}", _row([part for value in vector for part in (value.real, value.imag)])]
    return "\n".join([*lines, "    -1", ""]).encode()


def number_field(value: float) -> str:
    """A number in 13 columns, one of them blank, with as many digits as fit.

    It always has a decimal point: without one a Fortran reader of E13.5 assumes it five digits from the right.
    """
    texts = (f"{value:#.{digits}g}" for digits in range(17, 3, -1))
    return next(text for text in texts if len(text) <= 12).rjust(13)


def _row(values: Sequence[float]) -> str:
    return "".join(number_field(each if math.isfinite(each) else 0.0) for each in values)


def _plain(text: str) -> str:
    return "".join(each if each.isascii() and each.isprintable() else "?" for each in text)[:_WIDTH] or "NONE"
