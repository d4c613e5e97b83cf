"""Universal File Format, dataset 58 and 58b: functions at nodal degrees of freedom. Only this module uses pyuff."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyuff
from numpy.typing import NDArray

from store.errors import StoreError

# How pyuff finds the delimiters of a dataset: in a binary file they follow the data without a new line.
_DELIMITER = re.compile(rb"    -1(?=[\r\n]|\Z| {74})")
_DATASET_58, _DATASET_UNITS, _SI = 58, 164, 1
_AXES = {1: "x", 2: "y", 3: "z", 4: "rx", 5: "ry", 6: "rz"}
_COMPLEX_TYPES, _REAL_TYPES = (5, 6), (2, 4)


class FunctionKind(IntEnum):
    """Function types of dataset 58 with a name; others have their number only."""

    TIME_RESPONSE = 1
    FREQUENCY_RESPONSE = 4
    COHERENCE = 6


class Quantity(IntEnum):
    """Specific data types of dataset 58 with a name."""

    UNKNOWN = 0
    DISPLACEMENT = 8
    ACCELERATION = 12
    FORCE = 13
    TIME = 17
    FREQUENCY = 18


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
        abscissa_unit, unit, denominator_unit: labels of the file, empty for NONE.
        quantity, denominator: specific data types of ordinate and denominator; a `Quantity` where it has a name.
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
    quantity: int = Quantity.UNKNOWN
    denominator: int = Quantity.UNKNOWN
    name: str = ""

    @property
    def abscissa(self) -> NDArray[np.float64]:
        """(samples,) in s or Hz."""
        return np.asarray(self.start + np.arange(self.values.size) * self.step)


def read_uff(path: Path) -> list[UffFunction]:
    """Every function of a file, text or binary, in its order; datasets other than 58 are ignored.

    Raises StoreError if the file is missing, no UFF, cut short, in other units than SI, unevenly spaced, or holds NaN
    or an unknown direction; the message names the file and the dataset.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise StoreError(f"{path.name} cannot be read: {error.strerror or error}") from error
    delimiters = len(_DELIMITER.findall(content))
    if delimiters == 0:
        raise StoreError(f"{path.name} is not a UFF file: it has no dataset between lines of -1")
    if delimiters % 2:
        raise StoreError(f"{path.name} is cut short: its last dataset has no end")
    functions = []
    for index, dataset in enumerate(_datasets(path, delimiters // 2), start=1):
        where = f"{path.name}, dataset {index}"
        if dataset.get("type") == _DATASET_UNITS and dataset.get("units_code") != _SI:
            raise StoreError(f"{where}: the file is in units code {dataset.get('units_code')}, expected 1 (SI)")
        if dataset.get("type") == _DATASET_58:
            functions.append(_function(dataset, where))
    if not functions:
        raise StoreError(f"{path.name} holds no function (dataset 58)")
    return functions


def write_uff(path: Path, functions: Sequence[UffFunction], *, binary: bool = True) -> None:
    """Write functions in double precision; text keeps twelve digits, binary every value.

    Raises StoreError if a value is not finite, a name does not fit, or the file cannot be written.
    """
    try:
        path.write_bytes(b"".join(_dataset_bytes(function, binary) for function in functions))
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def _datasets(path: Path, expected: int) -> list[dict[str, Any]]:
    try:
        file = pyuff.UFF(str(path))
        if int(file.get_n_sets()) != expected:
            raise StoreError(f"{path.name} is damaged: {expected} datasets begin, {file.get_n_sets()} are whole")
        return [dict(file.read_sets(index)) for index in range(expected)]
    except StoreError:
        raise
    except Exception as error:
        # pyuff raises bare Exception, and any error of its parser.
        raise StoreError(f"{path.name} is damaged or not a UFF file: {str(error) or type(error).__name__}") from error


def _function(dataset: dict[str, Any], where: str) -> UffFunction:
    values = np.asarray(dataset["data"])
    if dataset["abscissa_spacing"] != 1:
        raise StoreError(f"{where}: abscissa is unevenly spaced; export it with even spacing")
    if dataset["ord_data_type"] not in _COMPLEX_TYPES + _REAL_TYPES:
        raise StoreError(f"{where}: ordinate data type {dataset['ord_data_type']} is none of 2, 4, 5, 6")
    if values.size != dataset["num_pts"] or values.size == 0:
        raise StoreError(f"{where}: {values.size} values, the header says {dataset['num_pts']}; the file is cut short")
    if not np.all(np.isfinite(values)):
        raise StoreError(f"{where}: value {int(np.argmin(np.isfinite(values))) + 1} is not a finite number")
    start, step = float(dataset["abscissa_min"]), float(dataset["abscissa_inc"])
    if not (np.isfinite(start) and np.isfinite(step) and step > 0):
        raise StoreError(f"{where}: abscissa begins at {start} with step {step}; expected finite and rising")
    return UffFunction(
        kind=dataset["func_type"],
        response=_dof(dataset["rsp_node"], dataset["rsp_dir"], f"{where}: response"),
        reference=_dof(dataset["ref_node"], dataset["ref_dir"], f"{where}: reference"),
        start=start,
        step=step,
        values=values,
        abscissa_unit=_label(dataset["abscissa_axis_units_lab"]),
        unit=_label(dataset["ordinate_axis_units_lab"]),
        denominator_unit=_label(dataset["orddenom_axis_units_lab"]),
        quantity=dataset["ordinate_spec_data_type"],
        denominator=dataset["orddenom_spec_data_type"],
        name=_label(dataset["id1"]),
    )


def _dof(node: int, direction: int, where: str) -> UffDof:
    if direction == 0:
        return UffDof(node)
    if abs(direction) not in _AXES:
        raise StoreError(f"{where} direction {direction} is unknown; UFF has -6 to 6")
    return UffDof(node, _AXES[abs(direction)], -1 if direction < 0 else 1)


def _label(text: str) -> str:
    return "" if text == "NONE" else text


def _dataset_bytes(function: UffFunction, binary: bool) -> bytes:
    if not np.all(np.isfinite(function.values)):
        # pyuff would write zeros.
        raise StoreError(f"{function.name or 'function'} at {function.response}: holds values that are not finite")
    header = {
        "type": _DATASET_58,
        "binary": 0,
        "func_type": int(function.kind),
        "id1": _fitting(function.name, 80),
        "rsp_node": function.response.node,
        "rsp_dir": _direction(function.response),
        "ref_node": function.reference.node,
        "ref_dir": _direction(function.reference),
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": int(
            Quantity.TIME if function.kind == FunctionKind.TIME_RESPONSE else Quantity.FREQUENCY
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
    with TemporaryDirectory() as folder:
        path = Path(folder) / "dataset.unv"
        pyuff.UFF(str(path)).write_sets(header, mode="overwrite")
        lines = path.read_bytes().split(b"\n", 13)
    is_complex = np.iscomplexobj(function.values)
    # pyuff gives the abscissa six digits where twelve fit.
    axis = f"{_field(function.start)}{_field(function.step)}{0.0:13.5e}"
    lines[8] = f"{6 if is_complex else 4:10d}{function.values.size:10d}{1:10d}{axis}".encode()
    if binary:
        data = function.values.astype("<c16" if is_complex else "<f8").tobytes()
        lines[1] = f"    58b{1:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}".encode()
        lines[13] = data + b"    -1\n"
    return b"\n".join(lines)


def _direction(dof: UffDof) -> int:
    numbers = {axis: number for number, axis in _AXES.items()}
    return dof.sign * numbers[dof.axis] if dof.axis else 0


def _fitting(text: str, width: int) -> str:
    if len(text) > width or not text.isascii() or not (text.isprintable()):
        raise StoreError(f"{text!r} does not fit a UFF header; use up to {width} plain characters")
    return text or "NONE"


def _field(value: float) -> str:
    """A number in 13 columns, one of them blank, with as many digits as fit.

    It always has a decimal point: without one a Fortran reader of E13.5 assumes it five digits from the right.
    """
    texts = (f"{value:#.{digits}g}" for digits in range(17, 3, -1))
    return next(text for text in texts if len(text) <= 12).rjust(13)
