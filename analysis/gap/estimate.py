"""A parameter that was estimated."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A parameter of an effect with its 90 % interval."""

    value: float
    ci90: tuple[float, float]
    unit: str
