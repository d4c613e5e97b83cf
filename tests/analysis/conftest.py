"""The paper's beam, and a bench of it on two joints, for the tests of everything that needs a beam."""

from dataclasses import dataclass

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.modes import Modes
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders

HIGHEST_FREQUENCY = 1024.0


@dataclass(frozen=True)
class Bench:
    """A beam, its joints, and what a roving hammer would find."""

    free_beam: FreeBeam
    joints: tuple[Joint, Joint]
    inputs: tuple[Dof, ...]
    modes: Modes

    @property
    def joint_nodes(self) -> dict[str, int]:
        return {joint.name: joint.node for joint in self.joints}


@pytest.fixture(scope="session")
def paper_beam() -> Beam:
    return Beam(
        length=0.914, height=0.0254, width=1290e-6 / 0.0254, youngs_modulus=207e9, poisson_ratio=0.3, density=7850.0
    )


@pytest.fixture(scope="session")
def bench(paper_beam: Beam) -> Bench:
    """Joints 55 mm from the ends, cylinders as in the paper's Table 2, finer mesh."""
    positions = [0.0, *np.linspace(0.055, paper_beam.length - 0.055, 9), paper_beam.length]
    free_beam = assemble(paper_beam, Mesh.through(positions), damping_ratios=(0.004, 0.001, 0.001))
    joints = (
        joint("I", 2, shear=0.36e6, compression=2.30e6, inclinations_deg=(-45, 135)),
        joint("II", 10, shear=0.49e6, compression=2.70e6, inclinations_deg=(45, -135)),
    )
    inputs = tuple(map(Dof.parse, ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x"]))
    return Bench(free_beam, joints, inputs, eigensolution(free_beam, joints, HIGHEST_FREQUENCY, inputs))


def joint(name: str, node: int, shear: float, compression: float, inclinations_deg: tuple[float, float]) -> Joint:
    cylinder = Cylinder(shear=shear * (1 + 0.12j), compression=compression * (1 + 0.11j), rotation=20.0 * (1 + 0.1j))
    return joint_from_cylinders(name, node, (cylinder, cylinder), np.radians(inclinations_deg), eccentricity=0.006)
