"""The client: the rig, the laboratory, runs, results and jobs of one service."""

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from datetime import date
from pathlib import Path
from typing import Any, Self
from urllib.parse import quote

from jointlab.client.connection import Connection, RigEvent
from jointlab.client.driving import Driver
from jointlab.documents.alarms import AlarmDocument
from jointlab.documents.commissioning import ExaminationDocument
from jointlab.documents.history import HistoryDocument
from jointlab.documents.investigations import InvestigationDocument, InvestigationSummary
from jointlab.documents.jobs import JobDocument
from jointlab.documents.laboratory import (
    CalibrationDocument,
    ChannelDocument,
    Health,
    InstrumentDocument,
    NewCalibration,
    Ready,
    SpecimenDocument,
)
from jointlab.documents.master import MasterQuestion, MasterSummary, StoredMasterDocument
from jointlab.documents.overlay import OverlayDocument
from jointlab.documents.results import (
    AnalysisDocument,
    ComparisonDocument,
    FrequencyResponseDocument,
    JointMatrixDocument,
    ModesDocument,
    SetSummary,
    StiffnessPoint,
    TableSummary,
)
from jointlab.documents.rig import HallRigDocument, Limits, RigDocument, RigStopped, Stopped
from jointlab.documents.runs import (
    AmendmentDocument,
    BlowDocument,
    NamedSequence,
    RunDetails,
    RunSummary,
    SequenceSummary,
    SineRecordDocument,
    WaveformDocument,
)
from jointlab.documents.stiffness import StiffnessDocument
from jointlab.identification.options import Options
from rig.sequences.sequence import Sequence
from store.states import OVER, AnalysisKind, InvestigationState, RunState

POLL_INTERVAL = 0.5
"""Seconds between two requests for the state of a run or a job."""


class Client:
    """One service. A context manager; methods raise `ProblemError` where the service says why it cannot.

    Args:
        address: such as ``http://127.0.0.1:8000``.
        key: made by ``jointlab key create``; None on a computer where no key is needed.
        timeout: s that an answer may take.
    """

    def __init__(self, address: str = "http://127.0.0.1:8000", key: str | None = None, timeout: float = 30.0) -> None:
        self._connection = Connection(address, key, timeout)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def health(self) -> Health:
        """Whether the service can do its work."""
        return self._connection.get(Health, "/health")

    def ready(self) -> Ready:
        """That the service can do its work now; ProblemError names what is missing."""
        return self._connection.get(Ready, "/health/ready")

    # The rig

    def rig(self) -> RigDocument:
        """The state of the rig."""
        return self._connection.get(RigDocument, "/rig")

    def stop(self) -> int | None:
        """STOP: end the present run; its number, None where there is none. It needs neither key nor lease.

        On return the actuator is at rest, where the rig drives a tester.
        """
        return self._connection.post(Stopped, "/rig/stop").run_id

    def rigs(self) -> list[HallRigDocument]:
        """The rigs that the service shows, as their own drive processes say it."""
        return list(self._connection.pages(HallRigDocument, "/rigs"))

    def stop_rig(self, name: str) -> None:
        """STOP for one of `rigs`; on return an actuator that it drives is at rest. It needs neither key nor lease."""
        self._connection.post(RigStopped, f"/rigs/{quote(name)}/stop")

    @contextmanager
    def driving(self, holder: str, *, by_force: bool = False) -> Iterator[Driver]:
        """Hold the control lease while the context lasts.

        Args:
            holder: name that others are shown.
            by_force: take it over, from another client of the same key or, with the scope engineer, from any client.
        """
        driver = Driver(self._connection, holder, by_force=by_force)
        try:
            yield driver
        finally:
            driver.give_back()

    def limits(self) -> Limits:
        """The rig's limits in force."""
        return self._connection.get(Limits, "/rig/limits")

    def set_limits(self, limits: Limits) -> Limits:
        """Set the rig's limits for runs that begin from now on; needs the scope engineer."""
        return self._connection.put(Limits, "/rig/limits", limits.model_dump())

    def events(self, last_event_id: str | None = None) -> AbstractContextManager[Iterator[RigEvent]]:
        """Events of the rig from now on, or after the event with this id."""
        return self._connection.events("/rig/events", last_event_id)

    # Alarms

    def alarms(self, standing: bool | None = None) -> Iterator[AlarmDocument]:
        """Alarms, newest first: all, or those that nobody has acknowledged (`standing`), or the others."""
        return self._connection.pages(AlarmDocument, "/alarms", standing=standing)

    def acknowledge_alarm(self, alarm: int, note: str | None = None) -> AlarmDocument:
        """Say that somebody has seen an alarm; needs the scope control:rig."""
        return self._connection.post(AlarmDocument, f"/alarms/{alarm}/acknowledge", {"note": note})

    def test_alarms(self) -> AlarmDocument:
        """Raise an alarm that is a test; needs the scope admin."""
        return self._connection.post(AlarmDocument, "/alarms/test")

    # The laboratory

    def examinations(self, rig: str | None = None) -> Iterator[ExaminationDocument]:
        """Examinations of every rig, or of one, newest first."""
        return self._connection.pages(ExaminationDocument, "/examinations", rig=rig)

    def instruments(self, kind: str | None = None) -> Iterator[InstrumentDocument]:
        """Every instrument that was ever used, or those of a kind such as tester, in the order of first use."""
        return self._connection.pages(InstrumentDocument, "/instruments", kind=kind)

    def calibrations(self, instrument: int) -> Iterator[CalibrationDocument]:
        """The calibrations of an instrument, newest first."""
        return self._connection.pages(CalibrationDocument, f"/instruments/{instrument}/calibrations")

    def calibrate(self, instrument: int, certificate: NewCalibration) -> CalibrationDocument:
        """Store a new certificate; needs the scope engineer."""
        path = f"/instruments/{instrument}/calibrations"
        return self._connection.post(CalibrationDocument, path, certificate.model_dump(mode="json"))

    def channels(self, run: int | None = None) -> Iterator[ChannelDocument]:
        """The channel table of a run, by default of the next run."""
        return self._connection.pages(ChannelDocument, "/channels" if run is None else f"/runs/{run}/channels")

    def specimens(self, article: str | None = None) -> Iterator[SpecimenDocument]:
        """Specimens, or those of a test article, in the order of first use."""
        return self._connection.pages(SpecimenDocument, "/specimens", article=article)

    def specimen_history(
        self,
        specimen: int,
        configuration: str | None = None,
        amplitude_pp_mm: float | None = None,
        frequency: float | None = None,
    ) -> HistoryDocument:
        """A specimen over its runs at one point of the tester, with its trend.

        Args:
            specimen: its number, of `specimens`.
            configuration, amplitude_pp_mm, frequency: of the point, as commanded; those of most runs by default.

        Raises:
            ProblemError: it was not measured there; the message says where it was.
        """
        asked = {"configuration": configuration, "amplitude_pp_mm": amplitude_pp_mm, "frequency": frequency}
        return self._connection.get(HistoryDocument, f"/specimens/{specimen}/history", **asked)

    def sequences(self) -> Iterator[SequenceSummary]:
        """All sequences by name, stored and built-in ones."""
        return self._connection.pages(SequenceSummary, "/sequences")

    def sequence(self, name: str) -> Sequence:
        """One sequence, stored or built in."""
        return self._connection.get(NamedSequence, f"/sequences/{quote(name)}").sequence

    def save_sequence(self, name: str, sequence: Sequence) -> Sequence:
        """Store a sequence under a name, in place of the one that was there."""
        body = sequence.model_dump(mode="json")
        return self._connection.put(NamedSequence, f"/sequences/{quote(name)}", body).sequence

    def delete_sequence(self, name: str) -> None:
        """Delete a stored sequence; runs keep their own copy."""
        self._connection.request("DELETE", f"/sequences/{quote(name)}")

    # Runs

    def runs(
        self,
        state: RunState | None = None,
        article: str | None = None,
        since: date | None = None,
        until: date | None = None,
        specimen: str | None = None,
    ) -> Iterator[RunSummary]:
        """Runs, newest first; those that began from one day (UTC) to another, both included."""
        days = {name: day.isoformat() for name, day in (("since", since), ("until", until)) if day is not None}
        return self._connection.pages(RunSummary, "/runs", state=state, article=article, specimen=specimen, **days)

    def run(self, run: int) -> RunDetails:
        """One run."""
        return self._connection.get(RunDetails, f"/runs/{run}")

    def create_run(self, sequence: str | Sequence | dict[str, Any]) -> RunSummary:
        """Store a run to be started later; `sequence` is the name of a stored one, or a whole one."""
        given = sequence.model_dump(mode="json") if isinstance(sequence, Sequence) else sequence
        return self._connection.post(RunSummary, "/runs", {"sequence": given})

    def wait_for_run(self, run: int, timeout: float | None = None) -> RunDetails:
        """Wait while a run is under way; one that has not begun is returned at once.

        A run whose process was lost stays `running` until it is resumed, so give a timeout where nobody looks on.

        Args:
            run: its number.
            timeout: s; None for no end.

        Raises:
            TimeoutError: the run is still under way.
        """
        ends = None if timeout is None else time.monotonic() + timeout
        while (found := self.run(run)).state is RunState.RUNNING:
            if ends is not None and time.monotonic() > ends:
                raise TimeoutError(f"run {run} is still running after {timeout:g} s")
            time.sleep(POLL_INTERVAL)
        return found

    def blows(self, run: int, accepted: bool | None = None) -> Iterator[BlowDocument]:
        """Blows of a run, in the order of measuring."""
        return self._connection.pages(BlowDocument, f"/runs/{run}/blows", accepted=accepted, limit=1000)

    def sine_records(self, run: int) -> Iterator[SineRecordDocument]:
        """Sine records of a run, in the order of measuring."""
        return self._connection.pages(SineRecordDocument, f"/runs/{run}/sine-records", limit=1000)

    def withdraw_blow(self, blow: int, reason: str) -> BlowDocument:
        """Withdraw an accepted blow; a hammer session that still lasts repeats its point."""
        return self._connection.post(BlowDocument, f"/blows/{blow}/withdraw", {"reason": reason})

    def blow_waveform(self, blow: int) -> WaveformDocument:
        """The records of a blow."""
        return self._connection.get(WaveformDocument, f"/blows/{blow}/waveform")

    # Results

    def analyses(self, run: int, kind: AnalysisKind | None = None) -> Iterator[AnalysisDocument]:
        """The analyses of a run, newest first; the number of one reads its results."""
        return self._connection.pages(AnalysisDocument, f"/runs/{run}/analyses", kind=kind)

    def accelerance_sets(self, run: int, analysis: int | None = None) -> Iterator[SetSummary]:
        """The roving-hammer sets of a run: the newest accelerances, or those of one analysis."""
        return self._connection.pages(SetSummary, f"/runs/{run}/frequency-responses", analysis=analysis)

    def accelerance(
        self, run: int, set_number: int, point: str, analysis: int | None = None
    ) -> FrequencyResponseDocument:
        """The accelerance of a set from the blows at a point such as 3y: the newest, or that of one analysis."""
        path = f"/runs/{run}/frequency-responses/{set_number}/{point}"
        return self._connection.get(FrequencyResponseDocument, path, analysis=analysis)

    def modes(self, run: int, analysis: int | None = None) -> ModesDocument:
        """The modes of a run: the newest, or those of one analysis."""
        return self._connection.get(ModesDocument, f"/runs/{run}/modes", analysis=analysis)

    def tables(self, run: int) -> Iterator[TableSummary]:
        """The tables of a run's newest results, with their columns."""
        return self._connection.pages(TableSummary, f"/runs/{run}/tables")

    def table(self, run: int, name: str, form: str = "csv") -> bytes:
        """One table of a run's newest results as a ``csv`` or ``parquet`` file."""
        return self._connection.request("GET", f"/runs/{run}/tables/{name}.{form}").content

    def joint_matrices(self, run: int, analysis: int | None = None) -> Iterator[JointMatrixDocument]:
        """The joint matrices of a run: the newest by each inverse method, or those of one analysis."""
        return self._connection.pages(JointMatrixDocument, f"/runs/{run}/joint-matrices", analysis=analysis)

    def dynamic_stiffness(self, run: int, analysis: int | None = None) -> Iterator[StiffnessPoint]:
        """The sine points of a run by the direct method: the newest, or those of one analysis."""
        path = f"/runs/{run}/dynamic-stiffness"
        return self._connection.pages(StiffnessPoint, path, analysis=analysis, limit=1000)

    def stiffness_at(self, run: int, amplitude_pp_mm: float, frequency: float) -> StiffnessDocument:
        """The dynamic stiffness by the fitted law of a run, at an amplitude (mm peak to peak) and a frequency (Hz)."""
        path = f"/runs/{run}/dynamic-stiffness/at"
        return self._connection.get(StiffnessDocument, path, amplitude_pp_mm=amplitude_pp_mm, frequency=frequency)

    def comparisons(self, run: int, analysis: int | None = None) -> Iterator[ComparisonDocument]:
        """The comparison of both methods on a run: the newest, or that of one analysis."""
        return self._connection.pages(ComparisonDocument, f"/runs/{run}/comparisons", analysis=analysis)

    def overlay(
        self,
        *runs: int,
        amplitude_pp_mm: float | None = None,
        point: str | None = None,
        response: str | None = None,
    ) -> OverlayDocument:
        """Results of two to twelve runs over each other.

        Args:
            amplitude_pp_mm: of the sine points, as commanded; that of most runs by default.
            point, response: of the accelerance, such as 3y; the driving point by default.

        Raises:
            ProblemError: the runs do not have that in common; the message says what they have.
        """
        asked = {"amplitude_pp_mm": amplitude_pp_mm, "point": point, "response": response}
        return self._connection.get(OverlayDocument, "/overlay", run=runs, **asked)

    def master_curves(self, article: str | None = None, specimen: str | None = None) -> Iterator[MasterSummary]:
        """Master curves in short, newest first: all, or those of an article and of a specimen."""
        return self._connection.pages(MasterSummary, "/master-curves", article=article, specimen=specimen)

    def master_curve(self, number: int) -> StoredMasterDocument:
        """One master curve: parameters of its shift, curve with bands, points, predictions, what was left out."""
        return self._connection.get(StoredMasterDocument, f"/master-curves/{number}")

    def amend(self, run: int, article: dict[str, object], reason: str) -> AmendmentDocument:
        """Correct values of a run's article, such as ``{"beam": {"length": 0.914}}``; earlier results stay.

        Raises:
            ProblemError: the service says why not.
        """
        body = {"article": article, "reason": reason}
        return self._connection.post(AmendmentDocument, f"/runs/{run}/amendments", body)

    # Jobs

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

    # Investigations

    def investigations(self, run: int | None = None) -> Iterator[InvestigationSummary]:
        """Investigations, those begun last first: all, or those of one run."""
        return self._connection.pages(InvestigationSummary, "/investigations", run=run)

    def investigate(
        self, run: int, *, minutes: float | None = None, experiments: int | None = None, certain: float | None = None
    ) -> InvestigationDocument:
        """Begin an investigation of the gap of a run; it moves no machine by itself.

        Args:
            run: its number.
            minutes: of rig time in all; 240 by default.
            experiments: that are carried out at most; 3 by default.
            certain: probability of the verdict at which it ends; 0.95 by default.
        """
        body = {"run": run} | _budget(minutes, experiments, certain)
        return self._connection.post(InvestigationDocument, "/investigations", body)

    def investigation(self, investigation: int) -> InvestigationDocument:
        """One investigation."""
        return self._connection.get(InvestigationDocument, f"/investigations/{investigation}")

    def wait_for_investigation(self, investigation: int) -> InvestigationDocument:
        """Wait until an investigation has diagnosed: it then waits for an answer, or has ended in any way."""
        while (found := self.investigation(investigation)).state is InvestigationState.WORKING:
            time.sleep(POLL_INTERVAL)
        return found

    def investigation_sequence(self, investigation: int) -> Sequence:
        """The sequence of the experiment that an investigation asks for; `create_run` takes it."""
        return self._connection.get(Sequence, f"/investigations/{investigation}/sequence")

    def answer_investigation(
        self,
        investigation: int,
        *,
        run: int | None = None,
        readings: dict[str, float] | None = None,
        refusal: str | None = None,
    ) -> InvestigationDocument:
        """Answer what an investigation asks for; all data are then diagnosed again.

        Args:
            investigation: its number.
            run: with the data that were asked for.
            readings: by name, each in the unit that was asked for.
            refusal: why the experiment cannot be made.

        Raises:
            ProblemError: it waits for no answer, or for another one; not exactly one answer is given.
        """
        given = {"run": run, "readings": readings, "refusal": refusal}
        body = {name: value for name, value in given.items() if value is not None}
        return self._connection.post(InvestigationDocument, f"/investigations/{investigation}/answer", body)

    def continue_investigation(
        self,
        investigation: int,
        *,
        minutes: float | None = None,
        experiments: int | None = None,
        certain: float | None = None,
    ) -> InvestigationDocument:
        """Go on with an investigation that was stopped, has failed or, with a larger budget, has spent its budget."""
        body = _budget(minutes, experiments, certain)
        return self._connection.post(InvestigationDocument, f"/investigations/{investigation}/continue", body)

    def stop_investigation(self, investigation: int) -> InvestigationDocument:
        """Stop an investigation; one that has ended stays as it is."""
        return self._connection.post(InvestigationDocument, f"/investigations/{investigation}/stop")

    # Trials and other jobs

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
        while (found := self.job(job)).state not in OVER:
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


def _budget(minutes: float | None, experiments: int | None, certain: float | None) -> dict[str, float]:
    given = {"minutes": minutes, "experiments": experiments, "certain": certain}
    return {name: value for name, value in given.items() if value is not None}
