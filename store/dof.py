"""A degree of freedom as it is stored: a node number and a direction."""

from __future__ import annotations

import re
from dataclasses import dataclass

from store.errors import StoreError

DIRECTIONS = ("x", "y", "r")


@dataclass(frozen=True, order=True)
class StoredDof:
    """Node, numbered from 1, and direction: x along the beam, y transverse, r the rotation. Written ``3y``."""

    node: int
    direction: str

    def __post_init__(self) -> None:
        if self.node < 1 or self.direction not in DIRECTIONS:
            raise StoreError(f"node {self.node}, direction {self.direction!r} is not a degree of freedom such as 3y")

    def __str__(self) -> str:
        return f"{self.node}{self.direction}"

    @classmethod
    def parse(cls, text: str) -> StoredDof:
        """Read ``3y``; StoreError if the text is not a node number followed by x, y or r."""
        match = re.fullmatch(r"([1-9]\d*)([xyr])", text)
        if match is None:
            raise StoreError(f"{text!r} is not a degree of freedom; write node and direction, such as 3y")
        return cls(int(match[1]), match[2])
