"""Free modes of a beam on elements of no length, from two meshes of it (L. F. Richardson, Phil. Trans. A 210, 1911).

The elements' squared frequencies are too high by an error that falls with the square of their length: the strain of
shear, and that of a rod, is constant in each. Halved elements leave a quarter of it, so a third of the difference to
them is what they leave themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from analysis.errors import AnalysisError
from analysis.structure.beam import RIGID_MODES, Beam, FreeBeam, Mesh, assemble

RESOLVED = 1 / 3
"""Of the coarser mesh's modes, those whose error follows that law."""


def assemble_converged(
    beam: Beam, mesh: Mesh, damping_ratios: Sequence[float] = (), point_masses: Mapping[int, float] | None = None
) -> FreeBeam:
    """A free beam as `assemble` makes it, carried to convergence where the mesh can be halved.

    Raises:
        AnalysisError: as of `assemble`.
    """
    fine = assemble(beam, mesh, damping_ratios=damping_ratios, point_masses=point_masses)
    if mesh.coarser is None:
        return fine
    return converged(fine, assemble(beam, mesh.coarser, point_masses=point_masses))


def converged(fine: FreeBeam, coarse: FreeBeam) -> FreeBeam:
    """The finer of two free beams, its stiffness such that its modes have the frequencies of a continuous beam.

    Args:
        fine: on elements half as long as those of
        coarse: the same beam with the same masses; its damping does not matter.

    Raises:
        AnalysisError: the coarser mesh is not every other node of the finer one.
    """
    shared = fine.mesh.positions[::2]
    if shared.size != coarse.mesh.positions.size or not np.allclose(shared, coarse.mesh.positions):
        raise AnalysisError("frequencies can be extrapolated from a mesh and every other node of it only")
    modes = slice(RIGID_MODES, int(RESOLVED * coarse.mesh.degrees))
    squared, rate = fine.squared_frequency.copy(), fine.damping_rate.copy()
    squared[modes] += (fine.squared_frequency[modes] - coarse.squared_frequency[modes]) / 3
    rate[modes] *= np.sqrt(squared[modes] / fine.squared_frequency[modes])
    weighted = fine.mass @ fine.shapes
    return replace(
        fine,
        damping=np.asarray((weighted * rate) @ weighted.T),
        stiffness=np.asarray((weighted * squared) @ weighted.T),
        squared_frequency=squared,
        damping_rate=rate,
    )
