"""Jobs on a run and the files that came of them: identify, diagnose, report, bundle, HDF5, model; tables as CSV."""

from collections.abc import Awaitable, Callable
from functools import partial

from nicegui import ui
from pydantic import ValidationError

from api.page.controls import button
from api.page.formatting import job_progress, moment
from api.page.frame import Frame
from api.page.markup import Cell, Link, anchor, show, table
from api.service.access import Caller
from api.service.context import queue
from jointlab.documents.jobs import REPORTS, NewExport
from jointlab.jobs.kinds import has_unfit_points
from store.exports.content import KINDS
from store.measurements.runs import Run
from store.service.jobs import Job, list_jobs
from store.states import ENDED_JOB_STATES, JobState, Scope

LOOK = 0.5  # s
LABELS = {
    "bundle": "Bundle (UFF, CSV)",
    "hdf5": "HDF5",
    "bluesky": "Bluesky",
    "mat": "MATLAB",
    "parquet": "Parquet",
    "uff": "UFF",
    "model": "Corrected simulation",
    "report": "Report",
    "report-pdf": "Report (PDF)",
}
WITHOUT_UNFIT_POINTS = "Bundle without unfit points"
CHANGING = {"identify", "diagnose"}


def jobs_of_run(frame: Frame, run: Run, refresh: Callable[[], None]) -> None:
    """Buttons that queue jobs on a run, and how far they are; `refresh` is called when one brought new results."""
    show("<h2>Do with this run</h2>")
    with ui.element("div").classes("row-of"):
        button("Identify", lambda: _queue(frame, "identify", {"run": run.id}), main=True)
        button("Diagnose the gap", lambda: _queue(frame, "diagnose", {"run": run.id}))
        for form, label in LABELS.items():
            if form not in REPORTS:
                button(label, partial(_queue, frame, "export", {"run": run.id, "form": form}))
        without = {"run": run.id, "form": "bundle", "leave_out_unfit_points": True}
        button(WITHOUT_UNFIT_POINTS, partial(_queue, frame, "export", without))
    _reports(frame, run)
    listed = show("").props('aria-live="polite"')
    cancels = ui.element("div").classes("row-of")
    show(_tables(run))
    seen: list[tuple[int, JobState, int, str | None]] = []

    async def look() -> None:
        jobs = await frame.read(lambda: _jobs(frame, run))
        now = [(job.id, job.state, job.done, job.now) for job in jobs or ()]
        if jobs is None or now == seen:
            return
        changed = {state[0] for state in now if state not in seen}
        first = not seen
        seen[:] = now
        listed.set_content(_list(jobs))
        cancels.clear()
        with cancels:
            for job in jobs:
                if job.state not in ENDED_JOB_STATES:
                    button(f"Cancel job {job.id}", partial(_cancel, frame, job.id))
        if not first and any(job.id in changed and job.kind in CHANGING and _is_done(job) for job in jobs):
            refresh()

    ui.timer(LOOK, look)


def _reports(frame: Frame, run: Run) -> None:
    """The buttons of reports, beside the name of who signs them."""

    async def make(form: str) -> None:
        signer.error = None
        try:
            given = NewExport.model_validate(
                {"run": run.id, "form": form, "signed_by": (signer.value or "").strip() or None}
            )
        except ValidationError:
            signer.error = "write a name in one line of 500 characters or less"
            return
        await _queue(frame, "export", given.model_dump(exclude_defaults=True))

    with ui.element("div").classes("row-of"):
        signer = ui.input("Signed by", placeholder="empty: to sign by hand").props("outlined hide-bottom-space")
        for form in REPORTS:
            button(LABELS[form], partial(make, form))


def _queue(frame: Frame, kind: str, parameters: dict[str, object]) -> Awaitable[object]:
    def add(caller: Caller) -> Job:
        return queue(frame.services).add(kind, parameters, caller.name, once=True)

    return frame.actions.act(Scope.ANALYSE, f"queue {kind}", f"run {parameters['run']}", add)


def _cancel(frame: Frame, job_id: int) -> Awaitable[object]:
    return frame.actions.act(
        Scope.ANALYSE, "cancel job", f"job {job_id}", lambda _caller: queue(frame.services).cancel(job_id)
    )


def _jobs(frame: Frame, run: Run) -> list[Job]:
    with frame.services.catalogue.reading() as session:
        return [job for job in list_jobs(session, limit=1000) if job.parameters.get("run") == run.id][:8]


def _is_done(job: Job) -> bool:
    return job.state is JobState.DONE


def _list(jobs: list[Job]) -> str:
    if not jobs:
        return ""
    return table("Jobs", ("job", "what", "asked at", "state", ""), map(_row, jobs))


def _row(job: Job) -> tuple[Cell, ...]:
    signer = job.parameters.get("signed_by")
    signed = "" if signer is None else f"signed by {signer}"
    what = " ".join(str(part) for part in (job.kind, job.parameters.get("form", ""), signed) if part)
    progress = f"{job.state}: {job_progress(job)}" if job.stage and not job.result else job.state.value
    return str(job.id), what, moment(job.created_at), progress, _outcome(job)


def _outcome(job: Job) -> Cell:
    if has_unfit_points(job):
        return f"{job.error}. “{WITHOUT_UNFIT_POINTS}” leaves such points out, and the bundle says which."
    if job.error:
        return job.error
    if job.kind == "export" and job.result:
        left_out = job.result.get("left_out", ())
        without = f" ({len(left_out)} sine points left out)" if left_out else ""
        return Link(f"Open {job.result['file']}{without}", f"/page/files/{job.id}", new_tab=True)
    if job.kind == "investigate":
        return Link("Open the investigation", f"/page/gap?investigation={job.parameters.get('investigation', job.id)}")
    if job.kind == "diagnose" and job.result:
        return Link("Open the diagnosis", f"/page/gap?diagnosis={job.result['diagnosis']}")
    return ""


def _tables(run: Run) -> str:
    links = (Link(name.replace("_", " "), f"/page/tables/{run.id}/{name}.csv", new_tab=True) for name in KINDS)
    return f"<p>Tables as CSV: {' · '.join(map(anchor, links))}</p>"
