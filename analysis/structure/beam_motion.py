"""The beam's motion between nodes, by the shape functions of the finite elements.

A hammer strikes beside its node, and joints and accelerometer sit beside theirs, by a millimetre or three. The elements
on either side of the node each say how the beam moves there; the mean of the two, each continued beyond the node, is
smooth in the distance. One element alone would turn sharply at the node, where a joint's force makes the shear
strain jump, and a fit would be caught there.
"""

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Real
from analysis.structure import element
from analysis.structure.beam import DIRECTIONS, FreeBeam, Theory


def modes_near(free_beam: FreeBeam, dof: Dof, distance: float) -> tuple[Real, Real]:
    """(N,) the free modes' motion at `distance` to the right of `dof`, m, and (N,) its derivative there, 1/m.

    Good for distances up to about the length of an element.
    """
    mesh = free_beam.mesh
    place = mesh.named[dof.node - 1]
    sides = [side for side in (place - 1, place) if 0 <= side < mesh.positions.size - 1]
    start = mesh.positions[place]
    found = [_continued(free_beam, side, float(start - mesh.positions[side]) + distance, dof) for side in sides]
    value, slope = np.mean(found, axis=0)
    return value, slope


def modes_under_blow(free_beam: FreeBeam, dof: Dof, distance: float, lean: float = 0.0) -> tuple[Real, Real, Real]:
    """(N,) force on each free mode by a unit blow aimed at `dof`, and its derivatives in `distance`, 1/m, and
    in `lean`, 1/rad.

    Args:
        free_beam: the beam without joints.
        dof: the mark.
        distance: of the blow from it, m: to the right; on an end face, struck along the beam, above the middle, from
            where the force bends the beam as well.
        lean: of a blow across the beam towards x, of one along it towards y, rad; small.
    """
    if dof.direction is Direction.X:
        along, _ = modes_near(free_beam, dof, 0.0)
        turning, _ = modes_near(free_beam, Dof(dof.node, Direction.ROTATION), 0.0)
        across, _ = modes_near(free_beam, Dof(dof.node, Direction.Y), 0.0)
        return along - distance * turning + lean * across, -turning, across
    straight, slope = modes_near(free_beam, dof, distance)
    along, along_slope = modes_near(free_beam, Dof(dof.node, Direction.X), distance)
    return straight + lean * along, slope + lean * along_slope, along


def _continued(free_beam: FreeBeam, number: int, along: float, dof: Dof) -> Real:
    """(2, N) motion and slope `along` m from the left end of element `number`, be it inside or not."""
    length = float(np.diff(free_beam.mesh.positions[number : number + 2])[0])
    freedoms: tuple[int, ...]
    if dof.direction is Direction.X:
        freedoms, weights = element.ROD, element.rod_shape(along / length, length)
    else:
        phi = free_beam.beam.shear_flexibility(length) if free_beam.theory is Theory.TIMOSHENKO else 0.0
        shape = element.transverse_shape if dof.direction is Direction.Y else element.rotation_shape
        freedoms, weights = element.BENDING, shape(along / length, length, phi)
    rows = [len(DIRECTIONS) * number + freedom for freedom in freedoms]
    return np.asarray(weights @ free_beam.shapes[rows])
