"""Requests for jobs: identification, diagnosis, master curve, trial, export."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from jointlab.client.connection import POLL_INTERVAL, Connection
from jointlab.documents.jobs import JobDocument
from jointlab.documents.master import MasterQuestion
from jointlab.identification.options import Options
from store.states import ENDED_JOB_STATES


class JobRequests:
    """Work that the service queues, and its files."""

    _connection: Connection

    def identify(self, run: int, **options: Any) -> JobDocument:
        """Queue an identification of a run by both methods.

        Args:
            run: its number.
            options: fields of `jointlab.identification.options.Options`, such as `elements=1`.

        Raises:
            ValidationError: there is no such option, or its value is outside of its limits.
        """
        chosen = Options(**options).model_dump(mode="json", exclude_defaults=True)
        return self._connection.post(JobDocument, "/identifications", {"run": run} | chosen)

    def diagnose(self, run: int) -> JobDocument:
        """Queue a diagnosis of the gap between a run and its simulation."""
        return self._connection.post(JobDocument, "/diagnoses", {"run": run})

    def compute_master_curve(self, article: str, specimen: str, **options: Any) -> JobDocument:
        """Queue a master curve of a specimen; `master_curve` of the job's result is its number.

        Args:
            article, specimen: as in the catalogue.
            options: further fields of `jointlab.documents.master.MasterQuestion`, such as `frequencies=(1000,)`.

        Raises:
            ValidationError: there is no such option, or its value is outside of its limits.
            ProblemError: there are too few temperatures, no such points or runs.
        """
        asked = MasterQuestion(article=article, specimen=specimen, **options)
        body = asked.model_dump(mode="json", exclude_defaults=True)
        return self._connection.post(JobDocument, "/master-curves", body)

    def trials(self) -> Iterator[JobDocument]:
        """Trials of the diagnosis, newest first; the scores are in the result of each that is done."""
        return self._connection.pages(JobDocument, "/trials")

    def try_diagnosis(self, cases: int, seed: int = 0) -> JobDocument:
        """Queue a trial of the diagnosis on this number of sealed cases."""
        return self._connection.post(JobDocument, "/trials", {"cases": cases, "seed": seed})

    def job(self, job: int) -> JobDocument:
        """One job."""
        return self._connection.get(JobDocument, f"/jobs/{job}")

    def cancel(self, job: int) -> JobDocument:
        """End a job that is not over."""
        return self._connection.post(JobDocument, f"/jobs/{job}/cancel")

    def wait_for_job(self, job: int) -> JobDocument:
        """Wait until a job is over in any way."""
        while (found := self.job(job)).state not in ENDED_JOB_STATES:
            time.sleep(POLL_INTERVAL)
        return found

    def export(
        self,
        run: int,
        form: str,
        path: Path,
        *,
        leave_out_unfit_points: bool = False,
        signed_by: str | None = None,
    ) -> tuple[str, ...]:
        """Write a run to a new file: as ``bluesky``, ``bundle`` (.zip), ``hdf5``, ``mat``, ``parquet`` (.zip),
        ``uff``, ``model`` (the corrected simulation, .zip), ``report`` (HTML) or ``report-pdf``.

        A bundle with a sine point that its table cannot hold is refused; with `leave_out_unfit_points` such points are
        left out. Returns a sentence for each, which the bundle has, too. A report is signed by the name `signed_by`.

        Raises:
            ProblemError: it cannot be made.
            FileExistsError: there is such a file already.
        """
        asked_for: dict[str, Any] = {"run": run, "form": form}
        if leave_out_unfit_points:
            asked_for["leave_out_unfit_points"] = True
        if signed_by is not None:
            asked_for["signed_by"] = signed_by
        asked = self._connection.post(JobDocument, "/exports", asked_for)
        job = self.wait_for_job(asked.id)
        content = self._connection.request("GET", f"/exports/{job.id}/file").content
        with path.open("xb") as file:
            file.write(content)
        return tuple((job.result or {}).get("left_out", ()))
