"""Natural frequencies of a free bar with their exact derivatives by its material and dimensions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from analysis.frequency_response import Real
from analysis.structure import element
from analysis.structure.beam import DIRECTIONS, Beam, Mesh, Theory, assemble

PARAMETERS = ("youngs_modulus", "density", "length", "height", "width")
"""Of `Beam`, in the order of all arrays over parameters."""


def free_frequencies(
    beam: Beam,
    mesh: Mesh,
    places: Sequence[int],
    theory: Theory = Theory.TIMOSHENKO,
    point_masses: Mapping[int, float] | None = None,
) -> tuple[Real, Real]:
    """Frequencies of some free modes and d ln f / d ln p by every parameter p; nodes move with the length.

    d w^2 = psi^T (dK - w^2 dM) psi for a mass-normalised shape. K is proportional to E, M less the point masses to
    the density, both to the width. The height is differentiated through the element matrices. The length then follows
    from dimensions: w^2 rho L^2 / E depends on h / L, w / L and m / (rho L^3) only.

    Args:
        beam: material and dimensions.
        mesh: nodes, from 0 to the length.
        places: (modes,) of the modes among those of the free bar, the rigid ones being 0 to 2.
        theory: of the beam.
        point_masses: masses in kg by node; they stay what they are.

    Returns:
        (modes,) frequencies in Hz and (modes, 5) slopes in the order of `PARAMETERS`.

    Raises:
        AnalysisError: the mesh does not span the beam, or a mass is impossible.
    """
    free_beam = assemble(beam, mesh, theory, point_masses=point_masses)
    squared, shapes = free_beam.squared_frequency[list(places)], free_beam.shapes[:, list(places)]
    lumped = np.zeros(squared.size)  # share of the kinetic energy that is in the point masses
    for node, kilograms in (point_masses or {}).items():
        lumped += kilograms * np.sum(shapes[mesh.node_degrees(node)[:2]] ** 2, axis=0)
    by_height = _by_height(beam, mesh, theory, squared, shapes)
    half = np.full(squared.size, 0.5)
    slopes = np.stack([half, -(1 - lumped) / 2, -1 - by_height + lumped, by_height, lumped / 2], axis=1)
    return np.sqrt(squared) / (2 * np.pi), slopes


def _by_height(beam: Beam, mesh: Mesh, theory: Theory, squared: Real, shapes: Real) -> Real:
    """(modes,) d ln f / d ln h, by the height in the plane of bending. There A ~ h, I ~ h^3, and phi ~ h^2."""
    rigidity, mass_per_length = beam.flexural_rigidity, beam.density * beam.area
    energy = np.zeros(squared.size)
    for number, (start, end) in enumerate(pairwise(mesh.positions)):
        length, first = float(end - start), len(DIRECTIONS) * number
        along = shapes[[first + place for place in element.ROD]]
        energy += _doubled(element.rod_stiffness(beam.youngs_modulus * beam.area, length), along)
        energy -= squared * _doubled(element.rod_mass(mass_per_length, length), along)

        across = shapes[[first + place for place in element.BENDING]]
        phi = beam.shear_flexibility(length) if theory is Theory.TIMOSHENKO else 0.0
        stiffness, stiffness_slope = _in_phi(element.bending_stiffness, rigidity, length, phi)
        mass, mass_slope = _in_phi(element.translational_mass, mass_per_length, length, phi)
        energy += _doubled(3 * stiffness + 2 * phi * stiffness_slope, across)
        energy -= squared * _doubled(mass + 2 * phi * mass_slope, across)
        if theory is Theory.TIMOSHENKO:
            rotary, rotary_slope = _in_phi(element.rotary_mass, beam.density * beam.second_moment, length, phi)
            energy -= squared * _doubled(3 * rotary + 2 * phi * rotary_slope, across)
    return np.asarray(energy / (2 * squared))


def _doubled(matrix: Real, shapes: Real) -> Real:
    """(modes,) twice the energy that (n, n) `matrix` has in each of (n, modes) shapes."""
    return np.asarray(np.einsum("im,ij,jm->m", shapes, matrix, shapes))


def _in_phi(
    matrix: Callable[[float, float, float], Real], factor: float, length: float, phi: float
) -> tuple[Real, Real]:
    """An element matrix and its derivative by phi.

    (1 + phi)^2 times the matrix is a quadratic in phi, for which this difference formula is exact at any step.
    """
    here, once, twice = ((1 + p) ** 2 * matrix(factor, length, p) for p in (phi, phi + 1, phi + 2))
    slope = (4 * once - 3 * here - twice) / 2
    whole = here / (1 + phi) ** 2
    return whole, np.asarray(slope / (1 + phi) ** 2 - 2 * whole / (1 + phi))
