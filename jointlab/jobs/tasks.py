"""The work of each kind of job.

It returns a function that stores its result: that is called in the transaction that ends the job, so that a job is
done exactly if there is a result. Only the process that does a job imports this, with all that identifies and
diagnoses; what a job is and needs is in `kinds`.
"""

from collections.abc import Callable
from dataclasses import asdict, replace
from datetime import UTC, datetime
from typing import Any, get_args

from sqlalchemy.orm import Session

from jointlab.diagnosis.investigation import INVESTIGATION, diagnosed_together, next_step, step_after_refusal, with_step
from jointlab.diagnosis.load import Subject, subject_of_run
from jointlab.diagnosis.model_file import write_model_of_run
from jointlab.diagnosis.pipeline import diagnose_run
from jointlab.diagnosis.save import save_diagnosis
from jointlab.documents.master import MasterQuestion
from jointlab.errors import JointlabError
from jointlab.identification.master import specimen_master
from jointlab.identification.master_document import master_document
from jointlab.identification.master_save import save_master
from jointlab.identification.options import Options
from jointlab.identification.run import identify_run, recompute
from jointlab.identification.save import save_identification
from jointlab.jobs.cluster import other_workers
from jointlab.jobs.kinds import (
    SUFFIXES,
    UNFIT_POINTS,
    JobKindName,
    RefusedJobError,
    exports_folder,
    kind_named,
    trial_folder,
)
from jointlab.report.identification import write_run_report
from jointlab.report.signature import Signature, note_signature
from jointlab.settings import load_settings
from store.catalogue import Catalogue
from store.exchange.bundle_exchange import UnfitPointsError, export_bundle
from store.exports.formats import FORMS
from store.progress import Progress
from store.service.jobs import Job

Save = Callable[[Session], dict[str, Any]]
Work = Callable[[Catalogue, Job, Progress], Save]


def work_of(kind: str) -> Work:
    """The work of a kind of job. Raises JointlabError where there is no such kind."""
    kind_named(kind)
    return WORK[kind]


def identify(catalogue: Catalogue, job: Job, progress: Progress) -> Save:
    """k, h and gamma of a run by both methods, and their comparison."""
    chosen = dict(job.parameters)
    run = chosen.pop("run")
    found = identify_run(catalogue, run, Options(**chosen), progress)
    return lambda session: asdict(save_identification(session, run, found))


def master(catalogue: Catalogue, job: Job, progress: Progress) -> Save:
    """The master curve of a specimen."""
    question = MasterQuestion.model_validate(job.parameters)
    with progress("master curve", 1) as advance:
        found = master_document(specimen_master(catalogue, question))
        advance(1)
    return lambda session: {"master_curve": save_master(session, question, found)}


def diagnose(catalogue: Catalogue, job: Job, progress: Progress) -> Save:
    """The diagnosis of the gap between a run and its simulation."""
    run = job.parameters["run"]
    document = diagnose_run(catalogue, run, progress)
    return lambda session: {"diagnosis": save_diagnosis(session, run, document)}


def investigate(catalogue: Catalogue, job: Job, progress: Progress) -> Save:
    """The next step of an investigation: the diagnosis of all data so far, and the experiment to ask for."""
    state = INVESTIGATION.validate_python(job.parameters["state"])
    if state.open_request is not None:  # it was stopped while it waited, and waits again
        return lambda _session: {"state": job.parameters["state"]}
    if (after_refusal := step_after_refusal(state)) is not None:
        return lambda _session: {"state": INVESTIGATION.dump_python(with_step(state, after_refusal), mode="json")}

    def load(source: str) -> Subject:
        return subject_of_run(catalogue, int(source), progress)

    found = diagnosed_together(state, load, progress)
    step = next_step(state, found.diagnosis)
    first, *further = map(int, state.sources)

    def save(session: Session) -> dict[str, Any]:
        number = save_diagnosis(session, first, found.document, tuple(sorted(state.absent)), further)
        after = with_step(state, replace(step, diagnosis=number))
        return {"diagnosis": number, "state": INVESTIGATION.dump_python(after, mode="json")}

    return save


def trial(catalogue: Catalogue, job: Job, progress: Progress) -> Save:
    """How often the diagnosis is right on simulated cases, whose truth is sealed until it has answered."""
    # imported for a trial only: no other work depends on the simulation
    from jointlab.trials.run import TrialSettings, carry_out

    folder = trial_folder(catalogue, job.id)
    with other_workers() as others:
        pool, workers = others or (None, 1)
        wanted = TrialSettings(job.parameters["cases"], job.parameters["seed"], folder, workers)
        scores = carry_out(wanted, progress, pool=pool)
    return lambda _session: scores


def export(catalogue: Catalogue, job: Job, progress: Progress) -> Save:
    """A file of a run: its bundle, results for other programs, the corrected simulation, or its report."""
    run, form = job.parameters["run"], job.parameters["form"]
    said: dict[str, Any] = {}
    signature: Signature | None = None
    folder = exports_folder(catalogue)
    name = f"run-{run}-{job.id}-{job.attempts}{SUFFIXES[form]}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise JointlabError(f"{folder} cannot be made: {error.strerror or error}") from error
    with progress(form, 1) as advance:
        match form:
            case "bundle":
                leave_out = job.parameters.get("leave_out_unfit_points", False)
                try:
                    left_out = export_bundle(catalogue, run, folder / name, leave_out_unfit_points=leave_out)
                except UnfitPointsError as error:
                    points = [point.model_dump(mode="json") for point in error.points]
                    raise RefusedJobError(str(error), {UNFIT_POINTS: points}) from error
                if left_out:
                    said["left_out"] = list(map(str, left_out))
            case "model":
                write_model_of_run(catalogue, run, folder / name)
            case _ if form in FORMS:
                FORMS[form][1](catalogue, run, folder / name)
            case _:
                found, standing = recompute(catalogue, run, progress)
                laboratory, signature = load_settings().laboratory, _signature(job)
                # a job that was cancelled is told so by its progress
                write_run_report(
                    catalogue, run, found, folder / name, laboratory, standing, lambda: advance(0), signature=signature
                )
        advance(1)

    def save(session: Session) -> dict[str, Any]:
        if signature is not None:
            note_signature(session, run, signature, folder / name)
        return {"file": name, "bytes": (folder / name).stat().st_size, **said}

    return save


def _signature(job: Job) -> Signature | None:
    """Who signs the report that a job makes now; None where nobody does."""
    name = job.parameters.get("signed_by")
    return None if name is None else Signature(name, job.asked_by, datetime.now(UTC))


WORK: dict[str, Work] = {
    "master": master,
    "diagnose": diagnose,
    "investigate": investigate,
    "identify": identify,
    "export": export,
    "trial": trial,
}
"""By kind."""
assert set(WORK) == set(get_args(JobKindName))
