"""The way from a bundle or a run to its diagnosis and the document of it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from analysis.gap.catalogue import effect_ids
from analysis.gap.diagnosis import Diagnosis, diagnose
from analysis.gap.diagnosis_step import DiagnosisStep
from jointlab.diagnosis.catalogue import title_of
from jointlab.diagnosis.curves import curves_of, split_predictions, with_rows_predicted
from jointlab.diagnosis.document import diagnosis_document
from jointlab.diagnosis.load import Subject, subject_of_bundle, subject_of_run
from jointlab.diagnosis.process_pool import processes
from jointlab.diagnosis.rig_time import rig_time
from jointlab.diagnosis.step_text import step_text
from jointlab.errors import JointlabError
from store.catalogue import Catalogue
from store.exchange.bundle import read_bundle
from store.progress import Advance, Progress, silent

PARTS = 100
"""Steps of the progress bar of a diagnosis."""


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A diagnosis with its subject.

    Attributes:
        subject: the measurement.
        diagnosis: what was found.
        document: the diagnosis as JSON, with the curves of `jointlab.diagnosis.curves`.
    """

    subject: Subject
    diagnosis: Diagnosis
    document: dict[str, Any]


def diagnosed(
    subject: Subject, without: Iterable[str] = (), progress: Progress = silent, workers: int | None = None
) -> Diagnosed:
    """Diagnose a subject.

    Args:
        subject: a bundle or a run.
        without: ids of effects to leave out of the catalogue.
        progress: shows how far the work is.
        workers: processes that share the work; by default as many as there are processors.

    Raises:
        JointlabError: the catalogue has no such effect.
        AnalysisError: the measurement cannot be simulated.
    """
    left_out, known = frozenset(without), effect_ids()
    for effect in sorted(left_out):
        if effect not in known:
            raise JointlabError(f"the catalogue has no effect {effect!r}; it has {', '.join(known)}")
    with progress("diagnosis", PARTS) as advance, processes(workers) as parallel_map:
        show = progress_callback(advance, title_of)
        whole = with_rows_predicted(subject.measurement)
        found = diagnose(whole, left_out, show, parallel_map, time_of_rig=rig_time())
    found = replace(found, missing_evidence=(*found.missing_evidence, *subject.left_out))
    rows = None
    if found.predicted is not None:
        asked, rows = split_predictions(found.predicted, len(subject.measurement.predict))
        found = replace(found, predicted=asked)
    document = diagnosis_document(found) | {"curves": curves_of(subject.measurement, rows, found.readings)}
    return Diagnosed(subject, found, {"title": subject.title} | document)


def diagnose_bundle(
    path: Path, without: Iterable[str] = (), progress: Progress = silent, workers: int | None = None
) -> Diagnosed:
    """Diagnose a bundle: a folder, or a zip of it.

    Raises:
        StoreError: the bundle is refused.
        JointlabError, AnalysisError: as of `diagnosed`.
    """
    return diagnosed(subject_of_bundle(read_bundle(path)), without, progress, workers)


def diagnose_run(catalogue: Catalogue, run_id: int, progress: Progress = silent) -> dict[str, Any]:
    """The document of a run's diagnosis; `jointlab.diagnosis.save` keeps it.

    Raises:
        StoreError, AnalysisError, JointlabError: there is no such run, or nothing in it to diagnose.
    """
    return diagnosed(subject_of_run(catalogue, run_id, progress), progress=progress).document


def progress_callback(advance: Advance, title_of: Callable[[str], str]) -> Callable[[DiagnosisStep], None]:
    """A function that moves a progress bar of `PARTS` to the share of a step, and says what is done now.

    Args:
        advance: of the bar.
        title_of: gives the title of an effect.
    """
    done = 0

    def show(step: DiagnosisStep) -> None:
        nonlocal done
        further = max(round(PARTS * step.share) - done, 0)
        done += further
        advance(further, step_text(step, title_of))

    return show
