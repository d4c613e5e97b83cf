"""A beam with anything attached to it, without mesh, modes or series: transfer matrices of Timoshenko's beam and a rod.

State and signs: deflection w, rotation of the section r, shear force Q = kappa G A (w' - r), moment M = E I r'; so
Q' = rho A lambda^2 w and M' = rho I lambda^2 r - Q (S. P. Timoshenko, Phil. Mag. 41, 1921). Between two places forces
follow from motions, which is the dynamic stiffness that is assembled and solved, line by line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.structure.beam import Beam


@dataclass(frozen=True, eq=False)
class Attached:
    """Something at `place`, m, of dynamic stiffness (lines, 3, 3) over x, y, rotation."""

    place: float
    stiffness: Complex


@dataclass(frozen=True)
class Blow:
    """A unit force at `place`, m, with components along and across the beam, and its moment, m."""

    place: float
    x: float = 0.0
    y: float = 0.0
    r: float = 0.0


def exact_accelerance(
    beam: Beam, modulus: Complex, frequency: Real, sensor: float, blows: Sequence[Blow], attached: Sequence[Attached]
) -> Complex:
    """(rows, lines) acceleration across the beam at `sensor`, m, (m/s^2)/N, for a complex `modulus` (lines,) in Pa."""
    omega = 2 * np.pi * frequency
    places = np.unique([0.0, beam.length, sensor, *(each.place for each in blows), *(each.place for each in attached)])
    system = np.zeros((frequency.size, 3 * places.size, 3 * places.size), dtype=complex)
    bending = _transfer(beam, modulus, omega)
    for number, (left, right) in enumerate(pairwise(places.tolist())):
        first = 3 * number
        rod, across = [first, first + 3], [first + 1, first + 2, first + 4, first + 5]
        system[:, np.array(rod)[:, None], rod] += _rod(beam, modulus, omega, right - left)
        system[:, np.array(across)[:, None], across] += _stiffness(*bending, right - left)
    for each in attached:
        at = 3 * int(np.searchsorted(places, each.place)) + np.arange(3)
        system[:, at[:, None], at] += each.stiffness
    force = np.zeros((frequency.size, 3 * places.size, 1))
    force[:, 3 * int(np.searchsorted(places, sensor)) + 1] = 1.0
    motion = np.linalg.solve(system, force).reshape(frequency.size, places.size, 3)  # reciprocity: as under each blow
    struck = [(int(np.searchsorted(places, blow.place)), (blow.x, blow.y, blow.r)) for blow in blows]
    return np.array([-(omega**2) * (motion[:, at] @ np.array(load)) for at, load in struck])


def _transfer(beam: Beam, modulus: Complex, omega: Real) -> tuple[Complex, Complex]:
    """(lines, 4) exponents of the state (w, r, Q, M) along the beam, 1/m, and (lines, 4, 4) their states in columns."""
    shear = beam.shear_correction * beam.area * modulus / (2 * (1 + beam.poisson_ratio))
    along = np.zeros((omega.size, 4, 4), dtype=complex)
    along[:, 0, 1] = 1.0
    along[:, 0, 2] = 1 / shear
    along[:, 1, 3] = 1 / (modulus * beam.second_moment)
    along[:, 2, 0] = -beam.density * beam.area * omega**2
    along[:, 3, 1] = -beam.density * beam.second_moment * omega**2
    along[:, 3, 2] = -1.0
    exponents, states = np.linalg.eig(along)
    return exponents, states


def _stiffness(exponents: Complex, states: Complex, length: float) -> Complex:
    """(lines, 4, 4) forces and moments at both ends of a piece from deflections and rotations there."""
    over = (states * np.exp(exponents * length)[:, None]) @ np.linalg.inv(states)
    inverse = np.linalg.inv(over[:, :2, 2:])
    left = inverse @ np.concatenate([-over[:, :2, :2], np.broadcast_to(np.eye(2), (len(over), 2, 2))], axis=2)
    right = over[:, 2:, 2:] @ left
    right[:, :, :2] += over[:, 2:, :2]
    return np.concatenate([-left, right], axis=1)


def _rod(beam: Beam, modulus: Complex, omega: Real, length: float) -> Complex:
    """(lines, 2, 2) forces along the beam at both ends of a piece from the motions there."""
    number = omega * np.sqrt(beam.density / modulus)
    turned = modulus * beam.area * number
    own, other = turned / np.tan(number * length), -turned / np.sin(number * length)
    return np.moveaxis(np.array([[own, other], [other, own]]), -1, 0)
