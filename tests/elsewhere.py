"""The reader of `docs/examples` in a process that cannot import our packages."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from analysis.frequency_response import Complex
from tests.test_architecture import PACKAGES, ROOT

READER = ROOT / "docs" / "examples" / "read_model.py"
ALONE = """
import runpy, sys
sys.modules.update(dict.fromkeys({packages!r}))  # an import of one of them fails
sys.argv = ["read_model.py", *sys.argv[1:]]
runpy.run_path({reader!r}, run_name="__main__")
"""


def read_elsewhere(model: Path) -> Complex:
    """(rows, lines) accelerances that the reader computes from an ``.h5`` file of a corrected simulation."""
    made = model.with_suffix(".npz")
    code = ALONE.format(packages=PACKAGES, reader=str(READER))
    subprocess.run([sys.executable, "-I", "-c", code, model, made], cwd=model.parent, check=True)
    with np.load(made) as archive:
        return np.asarray(archive["accelerance"])
