"""How long the study of Fig. 4 takes: sixty stiffness ratios on ten elements."""

from __future__ import annotations

import time

import numpy as np

from analysis.structure.beam import Beam, Mesh, assemble
from analysis.structure.conditioning import eigenvalue_study

BAR = Beam(0.914, 0.0254, 0.0507874, 207e9, 0.3, 7850.0)


def main() -> None:
    """Print seconds; below two is asked for."""
    free = assemble(BAR, Mesh.through(np.linspace(0.0, BAR.length, 11), elements_between=1))
    started = time.perf_counter()
    eigenvalue_study(free, np.geomspace(0.1, 1e4, 60))
    print(f"60 points of Fig. 4: {time.perf_counter() - started:.2f} s")


if __name__ == "__main__":
    main()
