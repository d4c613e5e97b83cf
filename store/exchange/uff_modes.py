"""Dataset 55 of the Universal File Format, read and written: shapes of modes with frequency and damping."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.dof import StoredDof
from store.errors import StoreError
from store.exchange.uff_axes import AXIS_DATASETS, NodeAxes, axes_of_nodes
from store.exchange.uff_datasets import AXES, UNREADABLE, read_datasets
from store.exchange.uff_units import FileUnits, units_by_dataset

_TRANSLATIONS = ("x", "y", "z")
_WIDTH = 80
_DISPLACEMENTS = (0, 1, 8)
"""Specific data types of a shape: not stated, general and displacement."""


@dataclass(frozen=True)
class UffMode:
    """One mode.

    Attributes:
        number: from 1.
        frequency: Hz; loss_factor: written as hysteretic damping.
        shape: complex, by degree of freedom. Translations are written, others of a node as zero: programs read complex
            shapes with three values a node.
        texts: up to five lines for people.
        modal_mass: of this shape, kg; zero where it is not known.
    """

    number: int
    frequency: float
    loss_factor: float
    shape: Mapping[StoredDof, complex]
    texts: Sequence[str]
    modal_mass: float = 1.0


@dataclass(frozen=True, eq=False)
class UffShapes:
    """Modes of a file, by frequency.

    Attributes:
        dofs: such as ``3y`` or ``3rz``; those at which no mode moves are left out.
        shapes: (dofs, modes) complex, scaled to unit modal mass, kg^-1/2 (kg^-1/2/m for rotations).
        frequencies: (modes,) Hz.
        loss_factors: (modes,), twice a viscous damping ratio.
    """

    dofs: tuple[str, ...]
    shapes: NDArray[np.complex128]
    frequencies: NDArray[np.float64]
    loss_factors: NDArray[np.float64]


def read_uff_modes(path: Path) -> UffShapes:
    """Read the modes of a file (dataset 55, real or complex), in the units of dataset 164, wherever that stands.

    Of two poles that are complex conjugates the one above the real axis counts. Shapes at a node with axes of its own
    are along those of the file.

    Raises StoreError if the file is missing, no UFF or cut short, holds no mode, or one of other nodes than the first,
    of another quantity than displacement, without a modal mass or with a negative one, frequency or damping below zero,
    or NaN, or if no mode moves any node.
    """
    datasets = read_datasets(path, (55, *AXIS_DATASETS))
    axes = axes_of_nodes(datasets)
    found = [
        _mode(dataset, units or FileUnits(), axes, f"{path.name}, dataset {index}")
        for index, (dataset, units) in enumerate(zip(datasets, units_by_dataset(datasets), strict=True), start=1)
        if dataset["type"] == 55 and complex(dataset.get("eig", 0)).imag >= 0
    ]
    if not found:
        raise StoreError(f"{path.name} holds no mode (dataset 55)")
    found.sort(key=lambda each: each[0])
    every = found[0][2].keys()
    if any(shape.keys() != every for *_, shape in found):
        raise StoreError(f"{path.name}: its modes have different nodes; export all modes at the same nodes")
    moving = sorted(dof for dof in every if any(shape[dof] for *_, shape in found))
    if not moving:
        raise StoreError(f"{path.name}: the shapes of all modes are zero at all nodes; export shapes with their values")
    return UffShapes(
        dofs=tuple(f"{node}{AXES[axis]}" for node, axis in moving),
        shapes=np.array([[shape[dof] for *_, shape in found] for dof in moving], complex).reshape(-1, len(found)),
        frequencies=np.array([frequency for frequency, *_ in found]),
        loss_factors=np.array([loss for _, loss, _ in found]),
    )


def _mode(
    dataset: dict[str, Any], units: FileUnits, axes: Mapping[int, NodeAxes], where: str
) -> tuple[float, float, dict[tuple[int, int], complex]]:
    """Frequency, loss factor and shape by node and axis, for unit modal mass in kg."""
    if units.doubt:
        raise StoreError(f"{where}: {units.doubt}")
    if UNREADABLE in dataset:
        raise StoreError(
            f"{where}: no mode can be read ({dataset[UNREADABLE]}); export real shapes with three or six values a "
            "node, or complex ones with three"
        )
    match dataset.get("analysis_type"):
        case 2:
            frequency, mass = float(dataset["freq"]), complex(dataset["modal_m"])
            loss = float(dataset["modal_damp_his"]) or 2 * float(dataset["modal_damp_vis"])
            if mass.real < 0:  # modal A of the other types has any phase, as the phase of their shapes is free
                raise StoreError(f"{where}: the modal mass {mass.real:g} is below zero; export modes with their masses")
        case 3 | 7:  # eigenvalue and modal A, which is 2 i w m of a mode that is all but real
            root = complex(dataset["eig"])
            frequency, loss = abs(root) / (2 * np.pi), -2 * root.real / (abs(root) or 1.0)
            mass = complex(dataset["modal_a"]) / (2j * (root.imag or 1.0))
        case other:
            raise StoreError(f"{where}: no mode can be read (analysis type {other}); types 2, 3 and 7 can")
    if not mass:
        raise StoreError(f"{where}: the mode has no modal mass; export shapes with their modal masses")
    scale = 1 / np.sqrt(mass * units.force / units.length)
    shape = {
        (node, axis): value * scale / (units.length if axis > 3 else 1.0)
        for (node, axis), value in _values(dataset, axes, where).items()
    }
    if not np.all(np.isfinite([frequency, loss, *shape.values()])):
        raise StoreError(f"{where}: holds values that are not finite")
    if frequency < 0:  # zero is that of a body that is free to move
        raise StoreError(f"{where}: the frequency {frequency:g} Hz is below zero; no mode has such a frequency")
    if loss < 0:
        raise StoreError(f"{where}: the loss factor {loss:g} is below zero; leave out modes without a physical damping")
    return frequency, loss, shape


def _values(dataset: dict[str, Any], axes: Mapping[int, NodeAxes], where: str) -> dict[tuple[int, int], complex]:
    """The shape as the file has it, by node and axis, along the axes of the file."""
    quantity, count = int(dataset["spec_data_type"]), int(dataset["n_data_per_node"])
    if quantity not in _DISPLACEMENTS:
        raise StoreError(f"{where}: the shape is of data type {quantity}; export shapes of displacement (8)")
    nodes = [int(node) for node in dataset["node_nums"]]
    columns = {axis: dataset[f"r{axis}"] for axis in AXES if f"r{axis}" in dataset}
    if count not in (3, 6) or any(len(column) != len(nodes) for column in columns.values()):
        raise StoreError(f"{where}: {count} values a node; export shapes with three or six, zero where nothing moves")
    if len(set(nodes)) != len(nodes):
        raise StoreError(f"{where}: a node comes twice; export each node once")
    found = {(node, axis): complex(value) for axis in columns for node, value in zip(nodes, columns[axis], strict=True)}
    turned = [key for key, value in found.items() if value and key[0] in axes]
    return found | {key: found[key] * axes[key[0]].sign(key[1], f"{where}: node {key[0]}") for key in turned}


def mode_dataset(mode: UffMode) -> bytes:
    """A dataset of a complex mode (analysis type 2); numbers have 6 to 11 digits, as fit into their 13 columns."""
    texts = [*map(plain_line, mode.texts), *["NONE"] * 5][:5]
    fields = (1, 2, 2, 8, 5, 3)  # structural, normal mode, translations, displacement, complex, three values a node
    lines = ["    -1", "    55", *texts, "".join(f"{each:10d}" for each in fields)]
    lines += [f"{2:10d}{4:10d}{1:10d}{mode.number:10d}", _row((mode.frequency, mode.modal_mass, 0.0, mode.loss_factor))]
    shape = {(dof.node, dof.direction): value for dof, value in mode.shape.items()}
    for node in sorted({dof.node for dof in mode.shape if dof.direction in _TRANSLATIONS}):
        vector = [shape.get((node, axis), 0j) for axis in _TRANSLATIONS]
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


def plain_line(text: str) -> str:
    """A line of text that people gave, with a ? for each letter that the format cannot hold."""
    return "".join(each if each.isascii() and each.isprintable() else "?" for each in text)[:_WIDTH] or "NONE"
