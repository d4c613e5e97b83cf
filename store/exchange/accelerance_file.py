"""The accelerances of one set in one UFF file, with checks of units and completeness.

A shaker stays and the accelerometer roves. Such a file is read and written with the two exchanged: by reciprocity it is
that of a roving hammer with the accelerometer at the place of the shaker.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.dof import StoredDof
from store.errors import StoreError
from store.exchange.uff import FunctionKind, Position, UffDof, UffFile, UffFunction, read_uff
from store.exchange.uff_units import FORCES, UffQuantity, Unit, ratio_of, unit_of
from store.states import HAMMER, SINE, Excitation

Real = NDArray[np.float64]

RESPONSES = (FunctionKind.FREQUENCY_RESPONSE, FunctionKind.COHERENCE)
"""Functions that belong to a set of accelerances."""
_UFF_AXES = {"x": "x", "y": "y", "r": "rz"}
_AXIS_DIRECTIONS = {axis: direction for direction, axis in _UFF_AXES.items()}
_DERIVATIVES = {UffQuantity.ACCELERATION: 0, UffQuantity.VELOCITY: 1, UffQuantity.DISPLACEMENT: 2}
_NAMES = {UffQuantity.VELOCITY: "mobility", UffQuantity.DISPLACEMENT: "receptance"}
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
        warnings: what was ignored, converted or read in another place, one sentence each.
        nodes: x, y, z in m of nodes, in the axes of the file; empty where it does not have them.
    """

    response: StoredDof
    inputs: tuple[StoredDof, ...]
    frequency: Real
    accelerance: NDArray[np.complex128]
    coherence: Real | None
    warnings: tuple[str, ...] = ()
    nodes: Mapping[int, Position] = field(default_factory=dict)


def read_accelerances(path: Path, excitation: Excitation = HAMMER, decay: float = 0.0) -> Accelerances:
    """Read one set: one accelerometer, or one shaker, every row on the same frequencies, coherence for all or none.

    Other units than (m/s^2)/N are converted, mobility and receptance by the angular frequency. Direction z is read as y
    where the file has no y: a beam has one plane.

    Args:
        excitation: hammer or shaker.
        decay: in 1/s, of the exponential window that the records carry.

    Raises:
        StoreError: the file is not readable as UFF, the rows are not of motion over force or do not belong together, or
            it holds no frequency response.
    """
    file = read_in_plane(path)
    return _one_set(path.name, _as_hammer_set(file.functions, excitation), file, excitation, decay)


def read_accelerance_sets(path: Path) -> tuple[Accelerances, ...]:
    """Read every set of a file: one for each accelerometer, or where it roves, one for each point of the force.

    The accelerometer or the exciter, whichever is at fewer points, counts as fixed. Where every function of it comes
    equally often, as in an export of several levels, these are sets one after the other. Errors and conversions are
    those of `read_accelerances`.
    """
    file = read_in_plane(path)
    measured = [f for f in file.functions if f.kind == FunctionKind.FREQUENCY_RESPONSE]
    if len({_point(f.response) for f in measured}) > len({_point(f.reference) for f in measured}):
        excitation, note = (
            SINE,
            f"{path.name}: the accelerometer roves; by reciprocity it is taken to be where the force is",
        )
        file = replace(file, notes=(*file.notes, note))
    else:
        excitation = HAMMER
    functions = _as_hammer_set(file.functions, excitation)
    sets: dict[tuple[int, str], list[UffFunction]] = {}
    for function in functions:
        sets.setdefault(_point(function.response), []).append(function)
    found = [repeat for each in sets.values() for repeat in _repeats(each)]
    return tuple(_one_set(path.name, each, file, excitation, 0.0) for each in found or [functions])


def _repeats(functions: Sequence[UffFunction]) -> list[list[UffFunction]]:
    """The functions of one response, apart where each comes equally often; together else."""
    found, seen = list[list[UffFunction]](), Counter[tuple[int, int, str]]()
    for function in functions:
        key = (function.kind, *_point(function.reference))
        if seen[key] == len(found):
            found.append([])
        found[seen[key]].append(function)
        seen[key] += 1
    return found if len(set(seen.values())) == 1 else [list(functions)]


def read_in_plane(path: Path, kinds: Collection[int] = RESPONSES) -> UffFile:
    """A file with functions of some `kinds` in the plane of the beam: z is y, and ry is -rz, where there is no y."""
    read = read_uff(path, kinds)
    axes = {dof.axis for each in read.functions for dof in (each.response, each.reference)}
    if not axes & {"z", "ry"} or axes & {"y", "rz"}:
        return read
    turned = tuple(replace(f, response=_turned(f.response), reference=_turned(f.reference)) for f in read.functions)
    return replace(
        read, functions=turned, notes=(*read.notes, f"{path.name}: direction z is read as y, across the beam")
    )


def _one_set(
    name: str, functions: Sequence[UffFunction], file: UffFile, excitation: Excitation, decay: float
) -> Accelerances:
    responses = [f for f in functions if f.kind == FunctionKind.FREQUENCY_RESPONSE]
    coherences = [f for f in functions if f.kind == FunctionKind.COHERENCE]
    if not responses:
        raise StoreError(f"{name} holds no frequency response (function type 4)")
    _check_axes(name, responses + coherences, "the shaker" if excitation == SINE else "response")
    inputs = tuple(to_dof(f.reference, name) for f in responses)
    if len(set(inputs)) != len(inputs):
        raise StoreError(f"{name}: an input comes twice among {', '.join(map(str, inputs))}; export each point once")
    units = [_units(f"{name}, {f.response} by {f.reference}", f) for f in responses]
    rows = [_accelerance(f, *of, decay) for f, of in zip(responses, units, strict=True)]
    converted = sorted({_NAMES[motion.quantity] for motion, _ in units if motion.quantity in _NAMES})
    return Accelerances(
        response=to_dof(responses[0].response, name),
        inputs=inputs,
        frequency=responses[0].abscissa,
        accelerance=np.stack(rows),
        coherence=_coherence(name, inputs, coherences),
        warnings=(
            *file.notes,
            *(f"{name}: {each} is converted to accelerance" for each in converted),
        ),
        nodes=file.nodes,
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
            quantity=UffQuantity.ACCELERATION,
            denominator=UffQuantity.FORCE,
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


def _as_hammer_set(functions: Sequence[UffFunction], excitation: Excitation) -> list[UffFunction]:
    """The functions with response and reference exchanged if a shaker excites; a second call undoes this."""
    if excitation == HAMMER:
        return list(functions)
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
        raise StoreError(
            f"{where}: {dof} is no point of the beam; number nodes from 1, and export directions of one plane: "
            "1 = x along the beam, 2 = y across it (or 3 = z in place of y)"
        )
    return StoredDof(dof.node, _AXIS_DIRECTIONS[dof.axis])


def to_uff(dof: StoredDof) -> UffDof:
    """Node and positive direction in UFF."""
    return UffDof(dof.node, _UFF_AXES[dof.direction])


def stated_unit(label: str, quantity: int) -> Unit | None:
    """The unit of values; without a label the quantity decides, which `read_uff` has in SI. None for an unknown one."""
    if label:
        return unit_of(label)
    return Unit(UffQuantity(quantity), 1.0) if quantity in list(UffQuantity) else None


def _units(where: str, function: UffFunction) -> tuple[Unit, Unit]:
    """The units of motion and force."""
    ratio = None if function.denominator_unit else ratio_of(function.unit)
    motion, force = ratio or (
        stated_unit(function.unit, function.quantity),
        stated_unit(function.denominator_unit, function.denominator),
    )
    if motion is None or motion.quantity not in _DERIVATIVES or force is None or force.quantity not in FORCES:
        found = (
            f"{function.unit or f'type {function.quantity}'} per {function.denominator_unit or function.denominator}"
        )
        raise StoreError(
            f"{where}: unit is {found}; export acceleration, velocity or displacement over force, such as (m/s^2)/N"
        )
    if function.quantity in _DERIVATIVES and function.quantity != motion.quantity:
        raise StoreError(
            f"{where}: unit {function.unit} contradicts data type {function.quantity} "
            f"({UffQuantity(function.quantity).name.lower()}); correct one of them"
        )
    if not np.iscomplexobj(function.values):
        raise StoreError(f"{where}: the frequency response is real; export complex values")
    if np.any(function.values) and not np.any(function.values.imag):  # a magnitude or a real part, stored as complex
        raise StoreError(f"{where}: the imaginary part is zero on all lines; export complex values")
    return motion, force


def _accelerance(function: UffFunction, motion: Unit, force: Unit, decay: float) -> NDArray[np.complex128]:
    """(lines,) in (m/s^2)/N along positive directions."""
    sign = function.response.sign * function.reference.sign
    derivative = (decay + 2j * np.pi * function.abscissa) ** _DERIVATIVES[motion.quantity]
    return np.asarray(sign * (motion.factor / force.factor) * derivative * function.values, dtype=np.complex128)


def _point(dof: UffDof) -> tuple[int, str]:
    return dof.node, dof.axis


def _turned(dof: UffDof) -> UffDof:
    """In axes that are turned about the beam, so that z becomes y, and ry becomes -rz."""
    axis = {"z": "y", "ry": "rz"}.get(dof.axis, dof.axis)
    return replace(dof, axis=axis, sign=-dof.sign if dof.axis == "ry" else dof.sign)


def _check_axes(name: str, functions: list[UffFunction], fixed: str) -> None:
    first = functions[0]
    for function in functions:
        where = f"{name}, {function.response} by {function.reference}"
        if function.abscissa_unit.lower() not in ("", "hz", "hertz"):
            raise StoreError(f"{where}: frequency is in {function.abscissa_unit!r}; export it in Hz")
        if function.values.size != first.values.size:
            raise StoreError(f"{where}: {function.values.size} lines, the first function has {first.values.size}")
        if (function.start, function.step) != (first.start, first.step):
            raise StoreError(f"{where}: frequencies differ from those of the first function")
        if function.start < 0:
            raise StoreError(f"{where}: frequencies begin at {function.start} Hz")
        if to_dof(function.response, where) != to_dof(first.response, where):
            raise StoreError(
                f"{where}: {fixed} is at {function.response}, the first function's at {first.response}; write a file "
                "for each, with a set for each in setup.json"
            )


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
    return np.asarray(np.clip(coherence, 0.0, 1.0), dtype=np.float64)
