"""Random smooth functions, whose coefficients are numbers among the values of a law."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from simlab.beam import Real

TERMS = 5
GRID = np.linspace(0.0, 1.0, 401)


def draw_curve(rng: np.random.Generator, name: str) -> dict[str, float]:
    """Coefficients of a smooth function; rougher components have smaller coefficients."""
    return {f"{name}_{k}": float(rng.standard_normal() / k) for k in range(1, TERMS + 1)}


def curve(values: Mapping[str, float | str], name: str, u: ArrayLike) -> Real:
    """The function at `u` (...), 0 to 1; its size is about one."""
    place = np.clip(np.asarray(u, dtype=np.float64), 0.0, 1.0)
    return np.asarray(sum(float(values[f"{name}_{k}"]) * np.cos(np.pi * k * place) for k in range(1, TERMS + 1)))


def rising(density: Real, u: ArrayLike) -> Real:
    """The integral of a positive `density` on `GRID` at `u` (...), from 0 at 0 to 1 at 1."""
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.asarray(np.interp(np.clip(u, 0.0, 1.0), GRID, whole / whole[-1]))


def logarithmic(x: ArrayLike, low: float, high: float) -> Real:
    """Position of `x` (...) between `low` and `high` on a logarithmic scale, 0 to 1."""
    return np.asarray(np.log(np.asarray(x) / low) / np.log(high / low))
