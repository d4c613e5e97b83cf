"""The kinds of jobs: the parameters of each, and where its files are. Their work is in `tasks`."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from jointlab.documents.master import MasterQuestion
from jointlab.errors import ConflictError, JointlabError
from jointlab.identification.options import Options
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.exports.suffixes import SUFFIXES as RESULTS
from store.service.jobs import Job, get_job
from store.states import JobState

JobKindName = Literal["master", "diagnose", "investigate", "identify", "export", "trial"]

HOUR = 3600.0  # s
UNFIT_POINTS = "unfit_points"
"""Key in the cause of a refused bundle; its value lists the sine points (`LeftOutPoint`) that it cannot hold."""


class RefusedJobError(JointlabError):
    """A job is refused; `cause` says why in values, by a name, for every way in to tell what can be done about it."""

    def __init__(self, why: str, cause: dict[str, Any]) -> None:
        super().__init__(why)
        self.cause = cause


class UnfitPointsJobError(ConflictError):
    """There is no file of a bundle, as it was refused for its sine points."""


@dataclass(frozen=True)
class JobKind:
    """A kind of job.

    Attributes:
        required_parameters: their names.
        time_limit: seconds that it may take.
        optional_parameters: their names.
        may_run_beside: kinds that may start although jobs of this kind take all slots.
    """

    required_parameters: tuple[str, ...]
    time_limit: float
    optional_parameters: tuple[str, ...] = ()
    may_run_beside: tuple[str, ...] = ()


def kind_named(name: str) -> JobKind:
    """A kind of job. Raises JointlabError where there is no such kind."""
    if name not in KINDS:
        raise JointlabError(f"there is no kind of job {name!r}; there are {', '.join(KINDS)}")
    return KINDS[name]


def exports_folder(catalogue: Catalogue) -> Path:
    """The folder of exported files, beside the waveforms."""
    return catalogue.waveforms.folder.with_name(f"{catalogue.waveforms.folder.name}-exports")


def export_file(catalogue: Catalogue, job_id: int) -> Path:
    """The file of an export.

    Raises:
        NotFoundError: there is no such export, or its file was removed.
        UnfitPointsJobError: it is a bundle that was refused for its sine points.
        ConflictError: the export is not done.
    """
    job = catalogue.read(get_job, job_id)
    if job.kind != "export":
        raise NotFoundError(f"there is no export {job_id}")
    if job.state is not JobState.DONE or job.result is None:
        kind = UnfitPointsJobError if has_unfit_points(job) else ConflictError
        raise kind(f"export {job_id} is {job.state}: {job.error or 'its file is not made yet'}")
    path = exports_folder(catalogue) / str(job.result["file"])
    if not path.is_file():
        raise NotFoundError(f"the file of export {job_id} was removed from {path.parent}; ask for it again")
    return path


def has_unfit_points(job: Job) -> bool:
    """Whether a job is the export of a bundle that was refused for sine points which it cannot hold."""
    return job.state is JobState.FAILED and UNFIT_POINTS in (job.result or {})


def trial_folder(catalogue: Catalogue, job_id: int) -> Path:
    """The folder of a trial that is not over, beside the waveforms: a worker that takes it up goes on from there."""
    return exports_folder(catalogue) / f"trial-{job_id}"


SUFFIXES: Mapping[str, str] = {
    "bundle": ".zip", "model": ".zip", "report": ".html", "report-pdf": ".pdf",
    **RESULTS,
}  # fmt: skip
SPECIMEN = ("article", "specimen")
KINDS: dict[str, JobKind] = {
    "master": JobKind(
        SPECIMEN, HOUR, optional_parameters=tuple(each for each in MasterQuestion.model_fields if each not in SPECIMEN)
    ),
    "diagnose": JobKind(("run",), 2 * HOUR, may_run_beside=("master", "identify", "export")),
    "investigate": JobKind(
        ("run", "state"),
        4 * HOUR,
        optional_parameters=("investigation",),
        may_run_beside=("master", "identify", "export"),
    ),
    "identify": JobKind(
        ("run",), HOUR, optional_parameters=tuple(Options.model_fields), may_run_beside=("master", "export")
    ),
    "export": JobKind(("run", "form"), HOUR, optional_parameters=("leave_out_unfit_points", "signed_by")),
    "trial": JobKind(
        ("cases", "seed"), 12 * HOUR, may_run_beside=("master", "diagnose", "investigate", "identify", "export")
    ),
}
"""The kinds, the most urgent first: what a person waits for is done before a trial."""
assert set(KINDS) == set(get_args(JobKindName))
