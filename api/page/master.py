"""Master curves of a specimen, which the view of runs shows where the address names one: asked for, and drawn."""

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from urllib.parse import urlencode

from nicegui import ui
from pydantic import ValidationError

from analysis.direct.shift_law import ShiftLaw
from api.page.address import number
from api.page.charts import master as charts
from api.page.controls import button, chart, choice
from api.page.formatting import job_progress, moment
from api.page.frame import Frame
from api.page.markup import Link, paragraph, show, show_table, table
from api.page.results.part import show_origin
from api.service.access import Caller
from api.service.context import queue
from jointlab.documents.master import ROOM, MasterDocument, MasterQuestion
from jointlab.errors import EXPECTED, JointlabError
from jointlab.identification.master import Series, offered_series, specimen_sweeps
from jointlab.report.master import (
    LAWS,
    extrapolations,
    hammer_table,
    left_out_notices,
    master_sentences,
    predictions_table,
    sweeps_table,
)
from jointlab.sequences.form import numbers
from jointlab.specimen_history import NO_POINTS
from rig.operator import loading_text
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.results.analyses import Analysis, get_analysis
from store.results.master_curves import StoredMasterSummary, get_master_curve, list_master_curves
from store.service.jobs import Job, list_jobs
from store.states import ENDED_JOB_STATES, JobState, Scope
from store.validation import faults_text

LOOK = 0.5  # s
KIND = "master"
ASKED = 1000.0
"""Hz that is asked for where nobody says another one: where the hammer knows the joints."""
READING = (
    "Cold rubber at a low frequency behaves as warm rubber at a high one: sweeps of one configuration and amplitude at "
    "three temperatures or more give k and γ beyond the tester's frequencies."
)


@dataclass(frozen=True, eq=False)
class Found:
    """What there is of a specimen.

    Attributes:
        series: that were measured, with the temperatures of the sweeps of each.
        curves: its master curves in short, newest first.
        shown: the one that is drawn, with its analysis; None where there is none.
    """

    series: Mapping[Series, Sequence[float]]
    curves: Sequence[StoredMasterSummary]
    shown: tuple[MasterDocument, Analysis] | None


async def build(frame: Frame, article: str, specimen: str, query: Mapping[str, str]) -> None:
    """Build the form that asks for a master curve, and the curve that the address names, or the newest one."""
    show(f"<h2>{escape(article)}, {escape(specimen)}: master curve</h2>")
    catalogue = frame.services.catalogue
    try:
        chosen = number(query, "curve")
        found = await frame.reading(lambda: _read(catalogue, article, specimen, chosen))
    except EXPECTED as error:
        frame.tell(str(error))
        return
    if not found.series:
        paragraph(NO_POINTS, "notice")
        return
    paragraph(READING, "quiet")
    _form(frame, article, specimen, found.series)
    progress_at = show("").props('aria-live="polite"')
    place = ui.element("div").classes("w-full")

    async def redraw(curve: int) -> None:
        newer = await frame.read(lambda: _read(catalogue, article, specimen, curve))
        if newer is not None:
            place.clear()
            with place:
                _draw(article, specimen, newer)

    _follow(frame, article, specimen, progress_at, redraw)
    with place:
        _draw(article, specimen, found)


def _read(catalogue: Catalogue, article: str, specimen: str, chosen: int | None) -> Found:
    """What there is of a specimen. NotFoundError where it has no curve with the number that is chosen."""
    curves = catalogue.read(list_master_curves, article=article, specimen=specimen)
    if chosen is None and curves:
        chosen = curves[0].analysis_id
    shown = None
    if chosen is not None:
        with catalogue.reading() as session:
            stored, analysis = get_master_curve(session, chosen), get_analysis(session, chosen)
        if (stored.article, stored.specimen) != (article, specimen):
            raise NotFoundError(f"master curve {chosen} is of {stored.article}, {stored.specimen}")
        shown = MasterDocument.model_validate(stored.document), analysis
    return Found(offered_series(catalogue, article, specimen), curves, shown)


def _form(frame: Frame, article: str, specimen: str, series: Mapping[Series, Sequence[float]]) -> None:
    """Fields of what can be asked, and the button that queues the work."""
    offered = {
        f"{configuration} {amplitude!r}": (configuration, amplitude, _temperatures(found))
        for (configuration, amplitude), found in series.items()
    }
    words = {key: f"{name}, {amplitude:g} mm: {at}" for key, (name, amplitude, at) in offered.items()}
    chosen, law = [next(iter(offered))], [ShiftLaw.WLF.value]
    with ui.element("div").classes("row-of"):
        choice("Configuration, amplitude (peak to peak)", "series", words, partial(chosen.__setitem__, 0))
        choice("Shift", "shift", {each.value: LAWS[each] for each in ShiftLaw}, partial(law.__setitem__, 0))
        warm = ui.input("Temperature (°C)", value=f"{ROOM:g}").props("outlined")
        asked = ui.input("Frequencies to predict at (Hz)", value=f"{ASKED:g}").props("outlined")
        known = ui.input("C1, C2 (K) of WLF, if known").props("outlined")

    async def press() -> None:
        configuration, amplitude, _ = offered[chosen[0]]
        try:
            constants = numbers(known.value or "", "C1 and C2")
            temperature = numbers(warm.value or "", "the temperature")
            if len(constants) not in (0, 2):
                raise JointlabError(f"C1 and C2 are two numbers, such as 9 100, and not {known.value!r}")
            if len(temperature) > 1:
                raise JointlabError(f"the temperature is one number, and not {warm.value!r}")
            given = {
                "article": article,
                "specimen": specimen,
                "configuration": configuration,
                "amplitude_pp_mm": amplitude,
                "shift": law[0],
                "temperature_c": temperature[0] if temperature else ROOM,
                "frequencies": numbers(asked.value or "", "frequencies"),
                "wlf": dict(zip(("c1", "c2"), constants, strict=True)) if constants else None,
            }
            question = MasterQuestion.model_validate(given)
        except ValidationError as error:
            frame.tell(faults_text(error.errors(), "question"))
            return
        except JointlabError as error:
            frame.tell(str(error))
            return
        await _queue(frame, question)

    button("Compute the master curve", press, main=True)


def _temperatures(found: Sequence[float]) -> str:
    return f"{', '.join(f'{each:.1f}' for each in found)} °C" if found else "no temperature"


def _queue(frame: Frame, question: MasterQuestion) -> Awaitable[object]:
    parameters = question.model_dump(mode="json", exclude_defaults=True)

    def add(caller: Caller) -> Job:
        specimen_sweeps(frame.services.catalogue, question)  # what is wrong is said at once
        return queue(frame.services).add(KIND, parameters, caller.name, once=True)

    return frame.actions.act(Scope.ANALYSE, f"queue {KIND}", "jobs", add, **parameters)


def _follow(
    frame: Frame, article: str, specimen: str, place: ui.html, redraw: Callable[[int], Awaitable[None]]
) -> None:
    """Show how far the newest job of the specimen is; `redraw` is called with the number of a new curve."""
    seen: list[tuple[int, JobState, int]] = []

    async def look() -> None:
        job = await frame.read(lambda: _newest_job(frame.services.catalogue, article, specimen))
        if job is None:
            return
        now, first = (job.id, job.state, job.done), not seen
        if seen == [now]:
            return
        seen[:] = [now]
        failed = job.state is JobState.FAILED
        progress = f": {job_progress(job)}" if job.stage else ""
        text = f"Job {job.id} has failed: {job.error}" if failed else f"Job {job.id} is {job.state}{progress}"
        is_said = failed or job.state not in ENDED_JOB_STATES
        place.set_content(f'<p class="notice{" trouble" if failed else ""}">{escape(text)}</p>' if is_said else "")
        if not first and job.state is JobState.DONE and job.result:
            await redraw(job.result["master_curve"])

    ui.timer(LOOK, look)


def _newest_job(catalogue: Catalogue, article: str, specimen: str) -> Job | None:
    jobs = catalogue.read(list_jobs, kind=KIND)
    of = {"article": article, "specimen": specimen}
    return next((job for job in jobs if of.items() <= job.parameters.items()), None)


def _draw(article: str, specimen: str, found: Found) -> None:
    if found.shown is None:
        paragraph("There is no master curve of this specimen yet.")
        return
    document, analysis = found.shown
    for sentence in master_sentences(document):
        paragraph(sentence)
    where = f"{specimen} {loading_text(document.configuration)}, {document.amplitude_pp_mm:g} mm"
    chart(f"|k|, {where}: curve with 95 % band, points by temperature", charts.magnitude(document), "master-k")
    with ui.element("div").classes("cards"):
        chart(f"γ, {where}", charts.loss_factor(document), "master-gamma")
        chart("Shift factors over temperature", charts.shift_factors(document), "master-shift")
    if document.predictions:
        show_table(predictions_table(document.predictions))
    for notice in (*extrapolations(document.predictions), *left_out_notices(document)):
        paragraph(notice.text, "notice")
    show_table(sweeps_table(document))
    if document.hammer_k22:
        show_table(hammer_table(document))
    show_origin(analysis)
    rows = [_row(article, specimen, each) for each in found.curves]
    head = ("curve", "configuration", "mm p-p", "shift", "reference °C", "made")
    show(table("Master curves of this specimen, newest first", head, rows))


def _row(article: str, specimen: str, found: StoredMasterSummary) -> tuple[str | Link, ...]:
    query = urlencode({"article": article, "master": specimen, "curve": found.analysis_id})
    return (
        Link(str(found.analysis_id), f"/page/runs?{query}"),
        found.configuration,
        f"{found.amplitude_pp_mm:g}",
        LAWS[found.shift],
        f"{found.reference_c:g}",
        moment(found.created_at),
    )
