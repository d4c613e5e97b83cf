"""Free modes of a beam for infinitely short elements, from several meshes (L. F. Richardson, Phil. Trans. A 210, 1911).

The elements' squared frequencies and shapes are off by an error that falls with the square of their length, for the
strain of shear, and that of a rod, is constant in each. From one mesh to the next finer one it falls to a quarter, what
extrapolation leaves of it to a sixteenth, and so on (W. Romberg, Det Kongelige Norske Videnskabers Selskab 28, 1955).

Only the lower modes can be followed from mesh to mesh. Higher modes act by their static flexibility alone. That of all
modes together is extrapolated in the same way, and the higher modes get the part that the lower ones do not have.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.structure.beam import DIRECTIONS, Beam, FreeBeam, Mesh, assemble
from analysis.structure.setup import RIGID_MODES

MESHES = 3
RESOLVED = 1 / 3
"""Share of a mesh's modes whose error follows that law."""
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
    """The beam `fine` with the modes of a continuous beam, for those modes that the coarser meshes resolve.

    Args:
        fine: on the finest mesh; its elements are half as long as those of the first beam in `coarser`.
        coarser: the same beam with the same masses, each on half as many elements as the beam before it. Their damping
            has no effect.

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
    best, resolved = _extrapolated(table), ~np.isnan(table[1][0])
    squared, moved = best[0], best[1:].reshape(-1, len(DIRECTIONS), fine.mesh.degrees)
    moved = moved - fine.shapes.reshape(-1, len(DIRECTIONS), fine.mesh.degrees)[:: 2 ** len(coarser)]
    shapes = fine.shapes + _between(moved, len(coarser)).reshape(fine.shapes.shape)
    flexibility = _extrapolated([_flexibility(beam.mesh, beam.shapes, beam.squared_frequency) for beam in beams])
    resolved[:RIGID_MODES] = True
    shapes += _flexibility_correction(fine.mesh, shapes, squared, ~resolved, flexibility)
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


def _extrapolated(levels: Sequence[Real]) -> Real:
    """Limit of the values on the finest mesh, the next one and so on; with fewer meshes where a coarser one has NaN."""
    table, best = list(levels), levels[0]
    for order in range(1, len(levels)):
        table = [finer + (finer - other) / (4**order - 1) for finer, other in pairwise(table)]
        best = np.where(np.isnan(table[0]), best, table[0])
    return best


def _flexibility(mesh: Mesh, shapes: Real, squared: Real) -> Real:
    """(3 named nodes, the same) by how much elastic modes yield there to static forces, m/N and so on."""
    elastic = shapes[_named(mesh), RIGID_MODES:]
    return np.asarray(elastic / squared[RIGID_MODES:] @ elastic.T)


def _flexibility_correction(
    mesh: Mesh, shapes: Real, squared: Real, unresolved: NDArray[np.bool_], flexibility: Real
) -> Real:
    """(N, modes) to add to the shapes of modes that no mesh resolves, for the static flexibility at named nodes.

    So high a mode acts by its flexibility alone, and that of all of them together is known, as `flexibility` less what
    the others have. Of the ways to bring them to it this changes them least (I. Olkin, F. Pukelsheim, Linear Algebra
    Appl. 48, 1982), and nothing where what is left to them is no flexibility.
    """
    named = _named(mesh)
    scale = np.sqrt(np.diag(flexibility))[:, None]
    high = shapes[np.ix_(named, unresolved)] / scale
    has = high / squared[unresolved] @ high.T
    wanted = has + (flexibility - _flexibility(mesh, shapes, squared)) / (scale * scale.T)
    change = np.zeros_like(shapes)
    if min(np.linalg.eigvalsh(has)[0], np.linalg.eigvalsh(wanted)[0]) <= 0:
        return change
    root = _root(has)
    inverse = np.linalg.inv(root)
    brought = inverse @ _root(root @ wanted @ root) @ inverse
    at_named = (scale * (brought @ high - high)).reshape(-1, len(DIRECTIONS) * high.shape[1])
    places = mesh.positions[list(mesh.named)]
    spread = np.array([np.interp(mesh.positions, places, column) for column in at_named.T]).T
    change[:, unresolved] = spread.reshape(len(shapes), -1)
    return change


def _root(matrix: Real) -> Real:
    """Symmetric square root of a symmetric positive matrix."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.sqrt(values)) @ vectors.T)


def _named(mesh: Mesh) -> NDArray[np.intp]:
    """Freedoms of the named nodes."""
    return np.concatenate([mesh.node_degrees(node) for node in range(1, len(mesh.named) + 1)])


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
    """The freedoms of every `stride`-th node."""
    return np.arange(beam.mesh.degrees).reshape(-1, len(DIRECTIONS))[::stride].ravel()


def _between(values: Real, halvings: int) -> Real:
    """Values at nodes (nodes, ...), and halfway between neighbours, `halvings` times."""
    for _ in range(halvings):
        found = np.empty((2 * len(values) - 1, *values.shape[1:]))
        found[::2], found[1::2] = values, (values[1:] + values[:-1]) / 2
        values = found
    return values
