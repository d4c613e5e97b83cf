"""Directions of a node with axes of its own become those of the file, or are refused."""

from pathlib import Path

import pytest

from store.errors import StoreError
from store.exchange.uff import UffDof, read_uff, write_uff
from tests.store.exchange.test_uff import accelerance
from tests.store.exchange.uff_text import dataset

TURNED_NODE = dataset(15, *(f"{node:10d}{0:10d}{5:10d}{1:10d}{node:13.5e}{0:13.5e}{0:13.5e}" for node in (3, 11)))


def system_18(x: float, z: float, side: float = 0.0) -> bytes:
    """Coordinate system 5 by its origin, a point on x and a point in the plane of x and z."""
    points = [0.0, 0.0, 0.0, x, side, 0.0], [0.0, 0.0, z]
    numbers = ["".join(f"{each:13.5e}" for each in row) for row in points]
    return dataset(18, f"{5:10d}{0:10d}{0:10d}{8:10d}{3:10d}", "SYS5", *numbers)


def system_2420(x: float, y: float, z: float) -> bytes:
    rows = [f"{a:25.16e}{b:25.16e}{c:25.16e}" for a, b, c in ((x, 0, 0), (0, y, 0), (0, 0, z), (0, 0, 0))]
    return dataset(2420, f"{1:10d}", "part", f"{5:10d}{0:10d}{8:10d}", "SYS5", *rows)


@pytest.mark.parametrize(
    ("system", "signs"),
    [
        (system_18(1.0, 1.0), (1, 1)),
        (system_18(-1.0, -1.0), (1, -1)),
        (system_18(-1.0, 1.0), (-1, -1)),
        (system_2420(1, -1, -1), (-1, 1)),
        (system_2420(1, 1, 1), (1, 1)),
    ],
)
def test_directions_of_a_node_with_its_own_axes_are_those_of_the_file(
    tmp_path: Path, system: bytes, signs: tuple[int, int]
) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()])
    (tmp_path / "b.unv").write_bytes(TURNED_NODE + system + (tmp_path / "a.unv").read_bytes())
    (found,) = read_uff(tmp_path / "b.unv").functions
    across, along = signs
    assert (found.response, found.reference) == (UffDof(3, "y", -across), UffDof(11, "x", along))


@pytest.mark.parametrize("system", [b"", system_18(1.0, 1.0, side=0.1), system_2420(1, 1, -1), system_2420(0, 0, 0)])
def test_axes_of_a_node_that_are_turned_or_not_defined_are_refused(tmp_path: Path, system: bytes) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()])
    (tmp_path / "b.unv").write_bytes(TURNED_NODE + system + (tmp_path / "a.unv").read_bytes())
    with pytest.raises(StoreError, match="the response at node 3 is in axes of its own, coordinate system 5"):
        read_uff(tmp_path / "b.unv")
