"""Documents on jobs, and what each kind of job is asked for with."""

from datetime import datetime
from typing import Any, Literal, Self

from pydantic import BaseModel, Field, model_validator

from jointlab.documents.fields import LARGEST, OneLine, Request
from jointlab.identification.options import Options
from store.states import JobState

MOST_CASES = 500
"""Cases of a trial that the service carries out: half a day on two cores."""
REPORTS = ("report", "report-pdf")
"""Forms of exports that are signed where a name is given."""


class JobDocument(BaseModel):
    """One job; times are UTC."""

    id: int
    kind: str
    state: JobState
    parameters: dict[str, Any]
    asked_by: str
    attempts: int = Field(description="how often it was begun; more than once where a worker was lost")
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    heartbeat_at: datetime | None = Field(description="time of the latest sign of life from its worker")
    stage: str | None
    done: int = Field(description="steps of the stage, of `total`")
    total: int
    now: str | None = Field(
        description="what its worker does and has found so far, in words, such as the first answer of a diagnosis; "
        "null where the job does not run"
    )
    result: dict[str, Any] | None = Field(
        description="null until the job is done; of a bundle that was refused, `unfit_points` has the sine points that "
        "it cannot hold, each with the reason"
    )
    error: str | None


class OfRun(Request):
    """Which run."""

    run: int = Field(ge=1, le=LARGEST, description="number of the run")


class NewIdentification(Options, OfRun):
    """Which run, and the options of its identification."""


class NewTrial(Request):
    """How many cases are drawn, and with which seed."""

    cases: int = Field(ge=1, le=MOST_CASES, description="more are tried on the command line: jointlab gap trial")
    seed: int = Field(default=0, ge=0, le=LARGEST)


class NewExport(OfRun):
    """Which run, and in which form."""

    form: Literal["bluesky", "bundle", "hdf5", "mat", "model", "parquet", "report", "report-pdf", "uff"] = Field(
        description="documents of Bluesky; UFF and JSON in a .zip; records and results; results for MATLAB; the "
        "corrected simulation in a .zip; tables in a .zip; HTML; the same printed by Chromium; accelerances and modes"
    )
    leave_out_unfit_points: bool = Field(
        default=False,
        description="of a bundle: sine points that its table cannot hold, such as one beyond 90 degrees or without a "
        "temperature, are left out and listed in setup.json and in the result of the job, with reasons; by default the "
        "bundle is refused",
    )

    signed_by: OneLine | None = Field(
        default=None,
        description="of a report: name of the person who signs it. The summary of the report has it, with the time and "
        "who gave the command; the audit log has it with the checksum of the file. Without it, the report has an empty "
        "line to be signed by hand",
    )

    @model_validator(mode="after")
    def _points_are_of_a_bundle(self) -> Self:
        if self.leave_out_unfit_points and self.form != "bundle":
            raise ValueError(f"leave_out_unfit_points belongs to the form bundle; leave it out with {self.form}")
        return self

    @model_validator(mode="after")
    def _reports_are_signed(self) -> Self:
        if self.signed_by is not None and self.form not in REPORTS:
            raise ValueError(f"signed_by belongs to the forms {' and '.join(REPORTS)}; leave it out with {self.form}")
        return self
