"""A degree of freedom of the beam: a node, numbered from 1, and a direction."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

from analysis.errors import AnalysisError


class Direction(StrEnum):
    """Direction at a node: x along the beam, y transverse, rotation about the third axis."""

    X = "x"
    Y = "y"
    ROTATION = "r"


@dataclass(frozen=True, order=True)
class Dof:
    """Node and direction, written ``3y`` as the paper names its measurement points."""

    node: int
    direction: Direction

    def __str__(self) -> str:
        return f"{self.node}{self.direction}"

    @classmethod
    def parse(cls, text: str) -> Dof:
        """Read ``3y``.

        Raises:
            AnalysisError: the text is not a node number followed by x, y or r.
        """
        match = re.fullmatch(r"([1-9]\d*)([xyr])", text)
        if match is None:
            raise AnalysisError(f"{text!r} is not a degree of freedom; write node and direction, such as 3y")
        return cls(int(match[1]), Direction(match[2]))
