"""Free modes of a beam on elements of no length, from meshes of it (L. F. Richardson, Phil. Trans. A 210, 1911).

The elements' squared frequencies and shapes are off by an error that falls with the square of their length, for the
strain of shear, and that of a rod, is constant in each. From one mesh to the next finer one it falls to a quarter, what
extrapolation leaves of it to a sixteenth, and so on (W. Romberg, Det Kongelige Norske Videnskabers Selskab 28, 1955).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.structure.beam import DIRECTIONS, RIGID_MODES, Beam, FreeBeam, Mesh, assemble

MESHES = 3
RESOLVED = 1 / 3
"""Of a mesh's modes, those whose error follows that law."""
ALIKE = 0.9
"""Product of inertia of two meshes' shapes of one mode, at least; bending and stretching change places high up."""


def assemble_converged(
    beam: Beam, mesh: Mesh, damping_ratios: Sequence[float] = (), point_masses: Mapping[int, float] | None = None
) -> FreeBeam:
    """A free beam as `assemble` makes it, carried to convergence as often as the mesh can be halved, twice at most.

    Raises:
        AnalysisError: as of `assemble`.
    """
    coarser, halved = list[FreeBeam](), mesh.coarser
    while halved is not None and len(coarser) < MESHES - 1:
        coarser.append(assemble(beam, halved, point_masses=point_masses))
        halved = halved.coarser
    return converged(assemble(beam, mesh, damping_ratios=damping_ratios, point_masses=point_masses), *coarser)


def converged(fine: FreeBeam, *coarser: FreeBeam) -> FreeBeam:
    """The finest of some free beams, its modes as those of a continuous beam as far as the others resolve them.

    Args:
        fine: on elements half as long as those of the first of
        coarser: the same beam with the same masses, each on half as many elements as the one before; their damping
            does not matter.

    Raises:
        AnalysisError: a coarser mesh is not every other node of the finer one.
    """
    beams = (fine, *coarser)
    for one, other in pairwise(beams):
        every_other = one.mesh.positions[::2]
        if every_other.size != other.mesh.positions.size or not np.allclose(every_other, other.mesh.positions):
            raise AnalysisError("modes can be extrapolated from a mesh and every other node of it only")
    if not coarser:
        return fine
    table = [_aligned(fine, beam, len(coarser) - level, 2**level) for level, beam in enumerate(beams)]
    best = table[0]
    for order in range(1, len(beams)):
        table = [finer + (finer - other) / (4**order - 1) for finer, other in pairwise(table)]
        best = np.where(np.isnan(table[0]), best, table[0])
    squared, moved = best[0], best[1:].reshape(-1, len(DIRECTIONS), fine.mesh.degrees)
    moved = moved - fine.shapes.reshape(-1, len(DIRECTIONS), fine.mesh.degrees)[:: 2 ** len(coarser)]
    shapes = fine.shapes + _between(moved, len(coarser)).reshape(fine.shapes.shape)
    rate = fine.damping_rate.copy()
    rate[RIGID_MODES:] *= np.sqrt(squared[RIGID_MODES:] / fine.squared_frequency[RIGID_MODES:])
    weighted = np.linalg.inv(shapes).T
    return replace(
        fine,
        mass=np.asarray(weighted @ weighted.T),
        damping=np.asarray((weighted * rate) @ weighted.T),
        stiffness=np.asarray((weighted * squared) @ weighted.T),
        squared_frequency=squared,
        damping_rate=rate,
        shapes=shapes,
    )


def _aligned(fine: FreeBeam, beam: FreeBeam, halvings: int, stride: int) -> Real:
    """Squared frequencies, and shapes at the nodes left after `halvings`, of a beam's modes as the finest has them.

    Returns:
        (1 + coarsest freedoms, fine's modes); NaN where the beam does not resolve a mode.
    """
    shown = _freedoms(beam, 2**halvings)
    if beam is fine:
        return np.vstack([fine.squared_frequency, fine.shapes[shown]])
    modes = np.arange(RIGID_MODES, int(RESOLVED * beam.mesh.degrees))
    alike = beam.shapes.T @ beam.mass @ fine.shapes[np.ix_(_freedoms(fine, stride), modes)]
    partner = np.argmax(np.abs(alike), axis=0)
    product = alike[partner, np.arange(modes.size)]
    found = np.abs(product) > ALIKE
    result = np.full((1 + shown.size, fine.mesh.degrees), np.nan)
    result[0, modes[found]] = beam.squared_frequency[partner[found]]
    result[1:, modes[found]] = (beam.shapes[shown][:, partner] * np.sign(product))[:, found]
    return result


def _freedoms(beam: FreeBeam, stride: int) -> NDArray[np.intp]:
    """Those of every `stride`-th node."""
    return np.arange(beam.mesh.degrees).reshape(-1, len(DIRECTIONS))[::stride].ravel()


def _between(values: Real, halvings: int) -> Real:
    """Values at nodes (nodes, ...), and halfway between neighbours, `halvings` times."""
    for _ in range(halvings):
        found = np.empty((2 * len(values) - 1, *values.shape[1:]))
        found[::2], found[1::2] = values, (values[1:] + values[:-1]) / 2
        values = found
    return values
