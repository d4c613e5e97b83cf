"""Universal file format, dataset 58b: functions of frequency or time in single precision, as analysers write them.

After the published layout of SDRC's dataset 58: eleven header lines, then the values as they are in memory.
"""

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simlab.case.campaign import Row


class AxisQuantity(Enum):
    """Specific data type, label and unit of an axis."""

    NONE = (0, "NONE", "NONE")
    ACCELERATION = (12, "acceleration", "m/s^2")
    FORCE = (13, "force", "N")
    TIME = (17, "time", "s")
    FREQUENCY = (18, "frequency", "Hz")


@dataclass(frozen=True, eq=False)
class Function:
    """One function on an even axis that begins at zero.

    Attributes:
        kind: function type: 1 time history, 4 frequency response, 6 coherence.
        name: first identification line.
        response, reference: degrees of freedom of the response and of the blow.
        axis, ordinate, denominator: quantity of each axis.
        step: of the axis, s or Hz.
        values: (samples,) real or complex.
    """

    kind: int
    name: str
    response: Row
    reference: Row
    axis: AxisQuantity
    step: float
    values: NDArray[np.float64] | NDArray[np.complex128]
    ordinate: AxisQuantity = AxisQuantity.NONE
    denominator: AxisQuantity = AxisQuantity.NONE


def write_universal_file(path: Path, functions: list[Function]) -> None:
    """Write functions one after the other; an existing file is replaced."""
    path.write_bytes(b"".join(_dataset(function) for function in functions))


def _dataset(function: Function) -> bytes:
    is_complex = np.iscomplexobj(function.values)
    data = function.values.astype("<c8" if is_complex else "<f4").tobytes()
    places = "".join(
        f" {'NONE':<10s}{place.node:10d}{' xyz'.index(place.direction):4d}"
        for place in (function.response, function.reference)
    )
    header = [
        f"{-1:6d}",
        f"    58b{1:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}",
        f"{function.name:<80s}",
        *(f"{'NONE':<80s}" for _ in range(4)),
        f"{function.kind:5d}{0:10d}{0:5d}{0:10d}{places}",
        f"{5 if is_complex else 2:10d}{function.values.size:10d}{1:10d}{0:13.5e}{function.step:13.5e}{0:13.5e}",
        *map(_axis, (function.axis, function.ordinate, function.denominator, AxisQuantity.NONE)),
    ]
    return "\n".join([*header, ""]).encode("ascii") + data + f"\n{-1:6d}\n".encode("ascii")


def _axis(quantity: AxisQuantity) -> str:
    code, label, unit = quantity.value
    return f"{code:10d}{0:5d}{0:5d}{0:5d} {label:<20s} {unit:<20s}"
