"""The work of a trial's process: read the measurement, diagnose, answer. It does not know the true values."""

import io
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
from threadpoolctl import threadpool_limits

from analysis.gap.fitting.fit import Fit
from jointlab.diagnosis.load import subject_of_run
from jointlab.diagnosis.pipeline import Diagnosed, diagnose_bundle, diagnosed
from jointlab.errors import EXPECTED
from store.catalogue import Catalogue
from store.version import software_version

DATABASE = "jointlab.db"
FAILURES: tuple[type[Exception], ...] = (*EXPECTED, ArithmeticError, ValueError, LookupError)


def packed(folder: Path) -> bytes:
    """The files of a folder as a ZIP archive, for a worker that may be on another computer."""
    archive = io.BytesIO()
    with ZipFile(archive, "w", ZIP_DEFLATED) as file:
        for path in sorted(each for each in folder.rglob("*") if each.is_file()):
            file.write(path, path.relative_to(folder))
    return archive.getvalue()


def answer_packed(measured: bytes) -> dict[str, Any]:
    """The answer to what was measured as `packed` made it."""
    with TemporaryDirectory() as folder:
        with ZipFile(io.BytesIO(measured)) as archive:
            archive.extractall(folder)
        return answer(Path(folder))


def answer(measured: Path) -> dict[str, Any]:
    """The diagnosis document of a bundle, or of the only run of a catalogue, with what was predicted.

    If a diagnosis fails, its answer is the error, which is scored and not hidden.

    Args:
        measured: a bundle, or a folder with the database of one run.
    """
    started = time.perf_counter()
    try:
        with threadpool_limits(limits=1):
            found = _diagnosed(measured)
    except FAILURES as error:
        return {"error": f"{type(error).__name__}: {error}"} | _made(started)
    document = found.document | {"curves": []} | _made(started)
    predicted = found.diagnosis.predicted
    if predicted is not None:
        document["predicted"] = {
            "frequency": predicted.frequency,
            "before": predicted.before,
            "after": predicted.after,
            "input": [str(struck) for _, struck in found.subject.measurement.predict],
        }
    corrected = found.diagnosis.corrected
    if corrected is not None and corrected.fit.likelihood.measurement.sets:
        document["fitted"] = _fitted_accelerances(corrected.fit)
    return document


def _fitted_accelerances(found: Fit) -> dict[str, Any]:
    """What a fit gives for the rows that were measured: (values,) set, input, frequency in Hz and accelerance."""
    sets, accelerances = found.likelihood.measurement.sets, found.likelihood.predict(found.scores, ()).accelerances
    shapes = [each.accelerance.shape for each in sets]
    return {
        "set": np.concatenate([np.full(rows * lines, number) for number, (rows, lines) in enumerate(shapes)]),
        "input": np.concatenate([np.repeat(list(map(str, each.inputs)), each.frequency.size) for each in sets]),
        "frequency": np.concatenate([np.tile(each.frequency, len(each.inputs)) for each in sets]),
        "accelerance": np.concatenate([each.ravel() for each in accelerances]),
    }


def _made(started: float) -> dict[str, Any]:
    return {"seconds": round(time.perf_counter() - started, 3), "version": software_version()}


def _diagnosed(measured: Path) -> Diagnosed:
    if not (measured / DATABASE).exists():
        return diagnose_bundle(measured, workers=1)
    with Catalogue.open(f"sqlite:///{measured / DATABASE}") as catalogue:
        return diagnosed(subject_of_run(catalogue, 1), workers=1)
