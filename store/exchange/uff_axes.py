"""Axes of nodes: those of the whole file, or of a coordinate system of the node's own (datasets 15, 2411, 18, 2420)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.errors import StoreError

AXIS_DATASETS = (15, 18, 2411, 2420)
"""Types of datasets that say in which axes a node is."""
Signs = tuple[int, int, int]
_OF_FILE: Signs = (1, 1, 1)
_LARGEST_GLOBAL = 1
"""Largest number of a coordinate system that is that of the file where no dataset defines it."""
_ALONG = 1e-4
"""Largest component across a global axis of a vector that counts as along it; files have six digits."""


@dataclass(frozen=True)
class NodeAxes:
    """Axes in which the directions of a node are.

    Attributes:
        system: number of the coordinate system.
        signs: of x, y and z along the axes of the file; None where the file does not define it, or it is turned.
    """

    system: int
    signs: Signs | None

    def sign(self, axis: int, where: str) -> int:
        """Of a direction 1 to 6 along the axes of the file; StoreError where it is along none of them."""
        if self.signs is None:
            raise StoreError(
                f"{where} is in axes of its own, coordinate system {self.system}, which the file does not define or "
                "which is turned; export directions along the axes of the whole structure"
            )
        return self.signs[(axis - 1) % 3]


def axes_of_nodes(datasets: Sequence[Mapping[str, Any]], column: str = "disp_cs") -> dict[int, NodeAxes]:
    """Axes of the nodes whose coordinate system, by a `column` of their dataset, is not that of the file."""
    systems = dict(pair for each in datasets for pair in _systems(each))
    found = dict[int, NodeAxes]()
    for each in datasets:
        if each["type"] in (15, 2411):
            for node, number in zip(each.get("node_nums", ()), each.get(column, ()), strict=False):
                signs = systems.get(int(number), _OF_FILE if 0 <= number <= _LARGEST_GLOBAL else None)
                found[int(node)] = NodeAxes(int(number), signs)
    return {node: axes for node, axes in found.items() if axes.signs != _OF_FILE}


def _systems(dataset: Mapping[str, Any]) -> Iterator[tuple[int, Signs | None]]:
    """Number of each coordinate system, and the signs of its axes; None where it is turned or not Cartesian."""
    if dataset["type"] == 18 and "xz_point" in dataset:
        every = zip(*(dataset[key] for key in ("cs_num", "cs_type", "ref_cs_num", "ref_o", "x_point", "xz_point")),
                    strict=True)  # fmt: skip
        for number, kind, reference, origin, on_x, on_xz in every:
            x = on_x - origin
            y = np.cross(on_xz - origin, x)
            axes = np.array([x, y, np.cross(x, y)])
            yield int(number), _signs(axes) if not kind and reference <= _LARGEST_GLOBAL else None
    if dataset["type"] == 2420 and "CS_matrices" in dataset:
        pairs = zip(dataset["CS_sys_labels"], dataset["CS_types"], dataset["CS_matrices"], strict=True)
        for number, kind, matrix in pairs:
            yield int(number), _signs(np.asarray(matrix)[:3]) if not kind else None


def _signs(axes: NDArray[np.float64]) -> Signs | None:
    """Signs of three axes, the rows, that are along x, y and z; None where one is not, or they are left-handed."""
    length = np.linalg.norm(axes, axis=1)
    if not np.all(np.isfinite(length)) or not np.all(length > 0):
        return None
    unit = axes / length[:, None]
    along = np.diag(unit)
    if np.max(np.abs(unit - np.diag(np.sign(along)))) > _ALONG or np.prod(along) < 0:
        return None
    x, y, z = (1 if each > 0 else -1 for each in along)
    return x, y, z
