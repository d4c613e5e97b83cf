"""How long a sealed case takes to draw, write and tell, kind by kind."""

from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from simlab.case.bundle import truth, write_case
from simlab.case.draw import CaseKind, draw_case

CASES = 12


def main() -> None:
    """Print the median and the longest of each kind."""
    print(f"{'kind':8s} {'draw and write (s)':>20s} {'truth (s)':>16s}")
    for kind in CaseKind:
        seconds = np.array([_seconds(seed, kind) for seed in range(CASES)])
        written, told = (f"{np.median(column):.2f}, {column.max():.2f} most" for column in seconds.T)
        print(f"{kind:8s} {written:>20s} {told:>16s}")


def _seconds(seed: int, kind: CaseKind) -> tuple[float, float]:
    with TemporaryDirectory() as folder:
        started = perf_counter()
        case = draw_case(seed, kind)
        write_case(case, Path(folder))
        written = perf_counter()
        truth(case)
        return written - started, perf_counter() - written
