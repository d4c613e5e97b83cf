"""Universal File Format: functions (datasets 58, 58b) in the units of dataset 164, nodes (15, 2411), and modes (55).

Only this module and `store.exchange.uff_datasets` use pyuff.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import IntEnum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyuff
from numpy.typing import NDArray

from store.errors import StoreError
from store.exchange.uff_axes import AXIS_DATASETS, NodeAxes, axes_of_nodes
from store.exchange.uff_datasets import AXES, UNREADABLE, read_datasets
from store.exchange.uff_modes import UffMode, mode_dataset, number_field, plain_line
from store.exchange.uff_units import FileUnits, UffQuantity, ratio_of, unit_of, units_by_dataset

Position = tuple[float, float, float]

# Single precision in 13 columns: an axis that is even but for this rounding is even.
_ROUNDING = 5e-6
_MOMENTS = ("db_created", "db_saved", "file_written")
_COMPLEX_TYPES, _REAL_TYPES = (5, 6), (2, 4)
_MOST_PADDING = 5
"""Values that a last line of six may have beyond the stated number; some programs fill it with zeros."""
_NUMBERS = {axis: number for number, axis in AXES.items()}


class FunctionKind(IntEnum):
    """Function types of dataset 58 with a name; others have their number only."""

    GENERAL = 0
    TIME_RESPONSE = 1
    FREQUENCY_RESPONSE = 4
    COHERENCE = 6


@dataclass(frozen=True)
class UffDof:
    """Node and signed direction; axis is x, y, z, rx, ry, rz, or empty for a scalar. Written ``3+y``."""

    node: int
    axis: str = ""
    sign: int = 1

    def __str__(self) -> str:
        return f"{self.node}{'-' if self.sign < 0 else '+'}{self.axis or 'scalar'}"


@dataclass(frozen=True, eq=False)
class UffFunction:
    """One function on an evenly spaced axis.

    Attributes:
        kind: function type; a `FunctionKind` where it has a name.
        response, reference: degrees of freedom.
        start, step: of the abscissa, in s or Hz.
        values: (samples,) float64 or complex128.
        abscissa_unit, unit, denominator_unit: labels of the file, empty for NONE: then values are in SI.
        quantity, denominator: specific data types of ordinate and denominator; a `UffQuantity` where it has a name.
        name: first identification line.
    """

    kind: int
    response: UffDof
    reference: UffDof
    start: float
    step: float
    values: NDArray[Any]
    abscissa_unit: str = ""
    unit: str = ""
    denominator_unit: str = ""
    quantity: int = UffQuantity.UNKNOWN
    denominator: int = UffQuantity.UNKNOWN
    name: str = ""

    @property
    def abscissa(self) -> NDArray[np.float64]:
        """(samples,) in s or Hz."""
        return np.asarray(self.start + np.arange(self.values.size) * self.step)


@dataclass(frozen=True, eq=False)
class UffFile:
    """The content of a file.

    Attributes:
        functions: in the order of the file.
        nodes: x, y, z of each node in m.
        notes: what was passed over or contradicts itself, one sentence each.
    """

    functions: tuple[UffFunction, ...]
    nodes: Mapping[int, Position]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class UffModel:
    """The beam as other programs draw it: nodes in m along a line, in the order of `positions`."""

    name: str
    positions: Sequence[float]
    created: datetime


def read_uff(path: Path, kinds: Collection[int] = tuple(FunctionKind)) -> UffFile:
    """Read the functions of some `kinds` of a file, text or binary; others are passed over with a note.

    A label of a unit says what values are in; where there is none, dataset 164 does, wherever it stands, and values are
    converted to SI. Directions of a node with axes of its own become those of the file.

    Raises StoreError if the file is missing, no UFF, cut short, unevenly spaced, in units that contradict each other,
    turned in a node's own axes, or holds no function, NaN or an unknown direction; the message names the file and the
    dataset.
    """
    functions, nodes, passed, passed_kinds = list[UffFunction](), dict[int, Position](), set[int](), set[int]()
    contradicted, datasets = False, read_datasets(path, AXIS_DATASETS)
    axes, elsewhere = axes_of_nodes(datasets), axes_of_nodes(datasets, "def_cs").keys()
    components = dict[int, str]()
    for index, (dataset, stated) in enumerate(zip(datasets, units_by_dataset(datasets), strict=True), start=1):
        units = stated or FileUnits()
        match int(dataset["type"]):
            case 58 if dataset["func_type"] not in kinds:
                passed_kinds.add(int(dataset["func_type"]))
            case 58:
                function = _function(dataset, where := f"{path.name}, dataset {index}")
                contradicted |= stated is not None and _contradicts(function, units)
                _check_component(dataset, components, where)
                functions.append(_along_the_file(_in_si(function, units, where), axes, where))
            case 15 | 2411 if (found := _nodes(dataset, units)) is not None:
                nodes |= {node: place for node, place in found.items() if node not in elsewhere}
            case 82 | 151 | 164:  # trace lines and the header hold nothing that was measured, and units are known
                continue
            case 18 | 2420 if UNREADABLE not in dataset:
                continue
            case other:
                passed.add(other)
    if not functions and not passed_kinds:
        raise StoreError(f"{path.name} holds no function (dataset 58)")
    notes = [f"{path.name}: function type {kind} is passed over" for kind in sorted(passed_kinds)]
    if passed:
        notes.append(f"{path.name}: dataset {', '.join(map(str, sorted(passed)))} is passed over")
    if contradicted:
        notes.append(f"{path.name}: dataset 164 has other units than the labels of the functions; the labels are taken")
    return UffFile(tuple(functions), nodes, tuple(notes))


def write_uff(
    path: Path,
    functions: Sequence[UffFunction],
    model: UffModel | None = None,
    modes: Sequence[UffMode] = (),
    *,
    binary: bool = True,
) -> None:
    """Write functions in double precision; text keeps twelve digits, binary every value. Then modes (55).

    Where a model is given, a header (151), units (164), nodes (15) and a trace line (82) come first.

    Raises StoreError if a value is not finite, a name does not fit, or the file cannot be written.
    """
    parts = [] if model is None else [_bytes_of(dataset) for dataset in _model_datasets(model)]
    parts += [_dataset_bytes(function, binary) for function in functions]
    parts += map(mode_dataset, modes)
    try:
        path.write_bytes(b"".join(parts))
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def _nodes(dataset: dict[str, Any], units: FileUnits) -> dict[int, Position] | None:
    """Positions in m; None where pyuff did not find whole rows of numbers, or the unit of length is in doubt."""
    columns = [np.asarray(dataset.get(each, ()), float) for each in ("node_nums", "x", "y", "z")]
    whole = columns[0].size > 0 and len({column.size for column in columns}) == 1
    if units.doubt or not whole or not all(np.isfinite(column).all() for column in columns):
        return None
    numbers, x, y, z = columns[0], *(units.length * column for column in columns[1:])
    if np.any(numbers != np.round(numbers)):
        return None
    places = zip(x.tolist(), y.tolist(), z.tolist(), strict=True)
    return dict(zip(numbers.astype(int).tolist(), places, strict=True))


def _contradicts(function: UffFunction, units: FileUnits) -> bool:
    found = (unit_of(function.unit), unit_of(function.denominator_unit))
    return any(unit and units.factor(unit.quantity) not in (None, unit.factor) for unit in found)


def _in_si(function: UffFunction, units: FileUnits, where: str) -> UffFunction:
    """The function in SI units: those of the file apply where no label states the unit of the values."""
    if function.kind == FunctionKind.COHERENCE:  # a ratio, also where its header repeats the types of its accelerance
        return function
    top = None if function.unit else units.factor(function.quantity, turning=_turns(function.response))
    stated = function.denominator_unit or ratio_of(function.unit)
    bottom = None if stated else units.factor(function.denominator, turning=_turns(function.reference))
    if (top, bottom) != (None, None) and units.doubt:
        raise StoreError(
            f"{where}: {units.doubt}, and the function has no label of its unit; state the unit in one place"
        )
    return replace(function, values=function.values * ((top or 1.0) / (bottom or 1.0)))


def _turns(dof: UffDof) -> bool:
    return dof.axis.startswith("r")


def _along_the_file(function: UffFunction, axes: Mapping[int, NodeAxes], where: str) -> UffFunction:
    """The function with its directions along the axes of the file."""

    def turned(dof: UffDof, what: str) -> UffDof:
        if not dof.axis or dof.node not in axes:
            return dof
        sign = axes[dof.node].sign(_NUMBERS[dof.axis], f"{where}: the {what} at node {dof.node}")
        return replace(dof, sign=dof.sign * sign)

    return replace(
        function, response=turned(function.response, "response"), reference=turned(function.reference, "reference")
    )


def _check_component(dataset: dict[str, Any], components: dict[int, str], where: str) -> None:
    """Refuse a node number that two components of a structure share; `components` has the name of each node's."""
    for side in ("rsp", "ref"):
        node, name = int(dataset[f"{side}_node"]), _label(str(dataset[f"{side}_ent_name"]).strip())
        if name and components.setdefault(node, name) != name:
            raise StoreError(
                f"{where}: node {node} belongs to {components[node]} and to {name}; export one component, or give its "
                "nodes numbers of their own"
            )


def _function(dataset: dict[str, Any], where: str) -> UffFunction:
    values = np.asarray(dataset["data"])
    count = int(dataset["num_pts"])
    if dataset["ord_data_type"] not in _COMPLEX_TYPES + _REAL_TYPES:
        raise StoreError(f"{where}: ordinate data type {dataset['ord_data_type']} is none of 2, 4, 5, 6")
    if count == 0:
        raise StoreError(f"{where}: holds no values; leave it out of the file")
    if values.size < count:
        raise StoreError(f"{where}: {values.size} values, the header says {count}; the file is cut short")
    if values.size > count + _MOST_PADDING or np.any(values[count:]):
        raise StoreError(f"{where}: {values.size} values, the header says {count}; correct the number")
    values = values[:count]
    if not np.all(np.isfinite(values)):
        raise StoreError(f"{where}: value {int(np.argmin(np.isfinite(values))) + 1} is not a finite number")
    start, step = float(dataset["abscissa_min"]), float(dataset["abscissa_inc"])
    if dataset["abscissa_spacing"] != 1:
        start, step = _even(np.asarray(dataset["x"], float)[:count], where)
    if not (np.isfinite(start) and np.isfinite(step) and step > 0):
        raise StoreError(f"{where}: abscissa begins at {start} with step {step}; expected finite and rising")
    over, label = int(dataset["abscissa_spec_data_type"]), _label(dataset["abscissa_axis_units_lab"])
    wanted = UffQuantity.TIME if dataset["func_type"] == FunctionKind.TIME_RESPONSE else UffQuantity.FREQUENCY
    if not label and over not in (UffQuantity.UNKNOWN, UffQuantity.GENERAL, wanted):
        raise StoreError(f"{where}: abscissa is of data type {over}; export it over {wanted.name.lower()} ({wanted:d})")
    return UffFunction(
        kind=dataset["func_type"],
        response=_dof(dataset["rsp_node"], dataset["rsp_dir"], f"{where}: response"),
        reference=_dof(dataset["ref_node"], dataset["ref_dir"], f"{where}: reference"),
        start=start,
        step=step,
        values=values,
        abscissa_unit=label,
        unit=_label(dataset["ordinate_axis_units_lab"]),
        denominator_unit=_label(dataset["orddenom_axis_units_lab"]),
        quantity=dataset["ordinate_spec_data_type"],
        denominator=dataset["orddenom_spec_data_type"],
        name=_label(dataset["id1"]),
    )


def _even(abscissa: NDArray[np.float64], where: str) -> tuple[float, float]:
    """Start and step of an axis that is written out; some programs do so where it is even."""
    start, steps = float(abscissa[0]), max(1, abscissa.size - 1)
    step = (float(abscissa[-1]) - start) / steps
    off = np.max(np.abs(start + step * np.arange(abscissa.size) - abscissa))
    if not off <= min(2 * _ROUNDING * np.max(np.abs(abscissa)), 0.1 * abs(step)):
        raise StoreError(f"{where}: abscissa is unevenly spaced; export it with even spacing")
    return start, step


def _dof(node: int, direction: int, where: str) -> UffDof:
    if direction == 0:
        return UffDof(node)
    if abs(direction) not in AXES:
        raise StoreError(f"{where} direction {direction} is unknown; UFF has -6 to 6")
    return UffDof(node, AXES[abs(direction)], -1 if direction < 0 else 1)


def _label(text: str) -> str:
    return "" if text == "NONE" else text


def _dataset_bytes(function: UffFunction, binary: bool) -> bytes:
    if not np.all(np.isfinite(function.values)):
        # pyuff would write zeros.
        raise StoreError(f"{function.name or 'function'} at {function.response}: holds values that are not finite")
    header = {
        "type": 58,
        "binary": 0,
        "func_type": int(function.kind),
        "id1": _fitting(function.name, 80),
        "rsp_node": function.response.node,
        "rsp_dir": _direction(function.response),
        "ref_node": function.reference.node,
        "ref_dir": _direction(function.reference),
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": int(
            UffQuantity.TIME if function.kind == FunctionKind.TIME_RESPONSE else UffQuantity.FREQUENCY
        ),
        "abscissa_axis_lab": "time" if function.kind == FunctionKind.TIME_RESPONSE else "frequency",
        "abscissa_axis_units_lab": _fitting(function.abscissa_unit, 20),
        "ordinate_spec_data_type": int(function.quantity),
        "ordinate_axis_lab": _fitting(function.name, 20),
        "ordinate_axis_units_lab": _fitting(function.unit, 20),
        "orddenom_spec_data_type": int(function.denominator),
        "orddenom_axis_units_lab": _fitting(function.denominator_unit, 20),
        "x": np.array([function.start, function.start + function.step]),
        # For binary data pyuff miscounts the bytes and leaves files open: there it writes the header only.
        "data": function.values[:1] if binary else function.values,
    }
    lines = _bytes_of(header).split(b"\n", 13)
    is_complex = np.iscomplexobj(function.values)
    # pyuff gives the abscissa six digits where twelve fit.
    axis = f"{number_field(function.start)}{number_field(function.step)}{0.0:13.5e}"
    lines[8] = f"{6 if is_complex else 4:10d}{function.values.size:10d}{1:10d}{axis}".encode()
    if binary:
        data = function.values.astype("<c16" if is_complex else "<f8").tobytes()
        lines[1] = f"    58b{1:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}".encode()
        lines[13] = data + b"    -1\n"
    return b"\n".join(lines)


def _model_datasets(model: UffModel) -> list[dict[str, Any]]:
    day, time = model.created.strftime("%d-%b-%y"), model.created.strftime("%H:%M:%S")
    numbers, along = np.arange(1, len(model.positions) + 1), np.asarray(model.positions, float)
    zeros = np.zeros(along.size)
    moments = {f"{what}_{each}": value for what, value in (("date", day), ("time", time)) for each in _MOMENTS}
    texts = {"model_name": plain_line(model.name), "description": "NONE", "db_app": "Jointlab", "program": "Jointlab"}
    return [
        {"type": 151, **texts, **moments},
        {"type": 164, "units_code": 1, "units_description": "SI", "length": 1, "force": 1, "temp": 1, "temp_offset": 0},
        {"type": 15, "node_nums": numbers, "x": along, "y": zeros, "z": zeros},
        {"type": 82, "trace_num": 1, "id": "beam", "nodes": numbers},
    ]


def _bytes_of(dataset: dict[str, Any]) -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "dataset.unv"
        pyuff.UFF(str(path)).write_sets(dataset, mode="overwrite")
        return path.read_bytes()


def _direction(dof: UffDof) -> int:
    return dof.sign * _NUMBERS[dof.axis] if dof.axis else 0


def _fitting(text: str, width: int) -> str:
    if len(text) > width or not text.isascii() or not (text.isprintable()):
        raise StoreError(f"{text!r} does not fit a UFF header; use up to {width} plain characters")
    return text or "NONE"
