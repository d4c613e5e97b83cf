"""How long forward studies take: sixty stiffness ratios of Fig. 4 on ten elements, and the FRFs of one test."""

import time

import numpy as np

from analysis.dof import Direction, Dof
from analysis.structure.beam import Beam, Mesh, assemble
from analysis.structure.bench_design import eigenvalue_study
from analysis.structure.forward import accelerance
from tests.bench.bench_joint_likelihood import joints

BEAM = Beam(0.914, 0.0254, 0.0507874, 207e9, 0.3, 7850.0)


def main() -> None:
    """Print seconds; below two is asked for the study."""
    nodes = np.linspace(0.0, BEAM.length, 11)
    free = assemble(BEAM, Mesh.through(nodes, elements_between=1))
    started = time.perf_counter()
    eigenvalue_study(free, np.geomspace(0.1, 1e4, 60))
    print(f"60 points of Fig. 4: {time.perf_counter() - started:.2f} s")

    finer = assemble(BEAM, Mesh.through(nodes, elements_between=8))
    inputs = [Dof(node, Direction.Y) for node in range(1, 12)]
    lines = np.linspace(0.0, 1024.0, 2049)
    started = time.perf_counter()
    accelerance(finer, joints(), lines, Dof.parse("3y"), inputs)
    print(f"11 accelerances over 2,049 lines: {time.perf_counter() - started:.2f} s")


if __name__ == "__main__":
    main()
