"""The accelerances of one set in one UFF file, with checks of units and completeness.

A shaker stays and the accelerometer roves. Such a file is read and written with the two exchanged: by reciprocity it is
that of a roving hammer with the accelerometer at the place of the shaker.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.dof import StoredDof
from store.errors import StoreError
from store.states import HAMMER, SINE, Excitation
from store.uff import FunctionKind, Quantity, UffDof, UffFunction, read_uff

Real = NDArray[np.float64]

# Units as various programs write them, in lower case and without blanks.
ACCELERATION_LABELS = ("m/s^2", "m/s2", "m/s**2", "m/s²", "m/s/s", "m/sec^2")
FORCE_LABELS = ("n", "newton")
_RATIO_LABELS = tuple(f"{left}{unit}{right}/n" for unit in ACCELERATION_LABELS for left, right in (("", ""), "()"))
_UFF_AXES = {"x": "x", "y": "y", "r": "rz"}
_AXIS_DIRECTIONS = {axis: direction for direction, axis in _UFF_AXES.items()}
# Rounding may carry a coherence of one past it.
_COHERENCE_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class Accelerances:
    """The content of a file.

    Attributes:
        response: of the accelerometer, or of the shaker.
        inputs: (rows,) of the hammer, or of the roving accelerometer.
        frequency: (lines,) Hz, evenly spaced.
        accelerance: (rows, lines) complex128, (m/s^2)/N, along positive directions.
        coherence: (rows, lines), or None where the file has none.
        warnings: of other functions in the file, which are ignored.
    """

    response: StoredDof
    inputs: tuple[StoredDof, ...]
    frequency: Real
    accelerance: NDArray[np.complex128]
    coherence: Real | None
    warnings: tuple[str, ...] = ()


def read_accelerances(path: Path, excitation: Excitation = HAMMER) -> Accelerances:
    """Read one set: one accelerometer, or one shaker, every row on the same frequencies, coherence for all or none.

    Raises StoreError if the file is not readable as UFF, the units are not (m/s^2)/N, the rows do not belong together,
    or it holds no frequency response.
    """
    functions = _as_hammer_set(read_uff(path), excitation)
    responses = [f for f in functions if f.kind == FunctionKind.FREQUENCY_RESPONSE]
    coherences = [f for f in functions if f.kind == FunctionKind.COHERENCE]
    others = sorted({f.kind for f in functions} - {FunctionKind.FREQUENCY_RESPONSE, FunctionKind.COHERENCE})
    if not responses:
        raise StoreError(f"{path.name} holds no frequency response (function type 4)")
    _check_axes(path.name, responses + coherences, "the shaker" if excitation == SINE else "response")
    for function in responses:
        _check_accelerance(f"{path.name}, {function.response} by {function.reference}", function)
    inputs = tuple(to_dof(f.reference, path.name) for f in responses)
    if len(set(inputs)) != len(inputs):
        raise StoreError(f"{path.name}: an input comes twice among {', '.join(map(str, inputs))}")
    signs = np.array([f.response.sign * f.reference.sign for f in responses])
    return Accelerances(
        response=to_dof(responses[0].response, path.name),
        inputs=inputs,
        frequency=responses[0].abscissa,
        accelerance=signs[:, np.newaxis] * np.stack([f.values.astype(np.complex128) for f in responses]),
        coherence=_coherence(path.name, inputs, coherences),
        warnings=tuple(f"{path.name}: function type {kind} is passed over" for kind in others),
    )


def accelerance_functions(
    response: StoredDof,
    inputs: Sequence[StoredDof],
    frequency: Real,
    accelerance: NDArray[Any],
    coherence: Real | None = None,
    excitation: Excitation = HAMMER,
) -> list[UffFunction]:
    """The functions to write for one set, accelerances first.

    Args:
        response: of the accelerometer, or of the shaker.
        inputs: (rows,) of the hammer, or of the roving accelerometer.
        frequency: (lines,) Hz, evenly spaced.
        accelerance: (rows, lines) complex, (m/s^2)/N.
        coherence: (rows, lines), or None.
        excitation: of the set.

    Raises:
        StoreError: the frequencies are not evenly spaced.
    """
    start, step = even_spacing(frequency)
    axis: dict[str, Any] = {"response": to_uff(response), "start": start, "step": step, "abscissa_unit": "Hz"}
    functions = [
        UffFunction(
            kind=FunctionKind.FREQUENCY_RESPONSE,
            reference=to_uff(dof),
            values=row.astype(np.complex128),
            unit="m/s^2",
            denominator_unit="N",
            quantity=Quantity.ACCELERATION,
            denominator=Quantity.FORCE,
            name="accelerance",
            **axis,
        )
        for dof, row in zip(inputs, accelerance, strict=True)
    ]
    if coherence is not None:
        functions += [
            UffFunction(kind=FunctionKind.COHERENCE, reference=to_uff(dof), values=row, name="coherence", **axis)
            for dof, row in zip(inputs, coherence, strict=True)
        ]
    return _as_hammer_set(functions, excitation)


def _as_hammer_set(functions: list[UffFunction], excitation: Excitation) -> list[UffFunction]:
    """With response and reference exchanged for a shaker; a second time undoes it."""
    if excitation == HAMMER:
        return functions
    return [replace(each, response=each.reference, reference=each.response) for each in functions]


def even_spacing(abscissa: Real) -> tuple[float, float]:
    """Start and step of an axis; StoreError if it has fewer than two values, or uneven spacing."""
    if abscissa.size < 2:
        raise StoreError("an axis of fewer than two values has no spacing")
    start = float(abscissa[0])
    # The first step is that of the file; the mean has less rounding error where the axis was computed.
    for step in (float(abscissa[1] - abscissa[0]), float((abscissa[-1] - abscissa[0]) / (abscissa.size - 1))):
        if step > 0 and np.allclose(start + np.arange(abscissa.size) * step, abscissa, rtol=1e-12, atol=1e-9 * step):
            return start, step
    raise StoreError("the frequencies are not evenly spaced, as UFF has them")


def to_dof(dof: UffDof, where: str) -> StoredDof:
    """Node and direction on the beam, without the sign; StoreError for a point that a plane beam does not have."""
    if dof.node < 1 or dof.axis not in _AXIS_DIRECTIONS:
        raise StoreError(f"{where}: {dof} is no point of the beam; it has nodes from 1 and directions 1 = x, 2 = y")
    return StoredDof(dof.node, _AXIS_DIRECTIONS[dof.axis])


def to_uff(dof: StoredDof) -> UffDof:
    """Node and positive direction in UFF."""
    return UffDof(dof.node, _UFF_AXES[dof.direction])


def has_unit(label: str, quantity: int, labels: tuple[str, ...], expected: Quantity) -> bool:
    """Whether a unit is the expected SI unit; without a label the quantity decides, because UFF has it in SI."""
    return label.replace(" ", "").lower() in labels if label else quantity == expected


def _check_accelerance(where: str, function: UffFunction) -> None:
    ratio = function.unit.replace(" ", "").lower() in _RATIO_LABELS and not function.denominator_unit
    acceleration = has_unit(function.unit, function.quantity, ACCELERATION_LABELS, Quantity.ACCELERATION)
    force = has_unit(function.denominator_unit, function.denominator, FORCE_LABELS, Quantity.FORCE)
    if not (ratio or (acceleration and force)):
        found = (
            f"{function.unit or f'type {function.quantity}'} per {function.denominator_unit or function.denominator}"
        )
        raise StoreError(f"{where}: unit is {found}, expected accelerance in (m/s^2)/N")
    if not np.iscomplexobj(function.values):
        raise StoreError(f"{where}: the frequency response is real, expected complex values")


def _check_axes(name: str, functions: list[UffFunction], fixed: str) -> None:
    first = functions[0]
    for function in functions:
        where = f"{name}, {function.response} by {function.reference}"
        if function.abscissa_unit.lower() not in ("", "hz"):
            raise StoreError(f"{where}: frequency is in {function.abscissa_unit!r}, expected Hz")
        if function.values.size != first.values.size:
            raise StoreError(f"{where}: {function.values.size} lines, the first function has {first.values.size}")
        if (function.start, function.step) != (first.start, first.step):
            raise StoreError(f"{where}: frequencies differ from those of the first function")
        if function.start < 0:
            raise StoreError(f"{where}: frequencies begin at {function.start} Hz")
        if to_dof(function.response, where) != to_dof(first.response, where):
            raise StoreError(f"{where}: {fixed} is at {function.response}, the first function's at {first.response}")


def _coherence(name: str, inputs: tuple[StoredDof, ...], functions: list[UffFunction]) -> Real | None:
    if not functions:
        return None
    rows = {to_dof(function.reference, name): function for function in functions}
    if len(rows) != len(functions) or set(rows) != set(inputs):
        have = ", ".join(str(to_dof(function.reference, name)) for function in functions)
        raise StoreError(
            f"{name}: coherence is there for {have}; expected once for each of {', '.join(map(str, inputs))}"
        )
    coherence = np.stack([rows[dof].values for dof in inputs])
    if np.iscomplexobj(coherence):
        raise StoreError(f"{name}: coherence is complex, expected real values")
    if coherence.min() < -_COHERENCE_ROUNDING or coherence.max() > 1 + _COHERENCE_ROUNDING:
        raise StoreError(f"{name}: coherence ranges from {coherence.min():g} to {coherence.max():g}, expected 0 to 1")
    return coherence
