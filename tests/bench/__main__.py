"""`make bench`: measurements of speed and accuracy, printed as tables; figures worth keeping go to docs/.

    python -m tests.bench                 # all of them
    python -m tests.bench bench_wires     # one

A benchmark is a module ``bench_*.py`` here with a function ``main()``. None of them decides whether a change lands:
these machines are noisy, and some figures take minutes.
"""

import importlib
import os
import sys
from pathlib import Path

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before numpy is loaded


def main(names: list[str]) -> None:
    """Run the benchmarks of these names, or all."""
    known = sorted(path.stem for path in Path(__file__).parent.glob("bench_*.py"))
    if unknown := [name for name in names if name not in known]:
        sys.exit(f"no benchmark {unknown[0]}; there are {', '.join(known)}\noptions go to python -m tests.bench.NAME")
    for name in names or known:
        print(f"== {name}", flush=True)
        importlib.import_module(f"tests.bench.{name}").main()


if __name__ == "__main__":
    main(sys.argv[1:])
