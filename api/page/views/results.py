"""Results of a run: modes, accelerances, joints, tester, comparison of both experiments, files and origin."""

from collections.abc import Mapping
from typing import Any

from nicegui import ui

from api.page.current_run import current_run
from api.page.formatting import moment, run_state
from api.page.frame import Frame
from api.page.markup import Cell, Link, paragraph, show, table, tabs, terms
from api.page.results import files, hammer, tester
from api.page.results.part import Part
from store.errors import NotFoundError
from store.instruments import list_channels
from store.runs import Run, get_run, list_run_events

PARTS: tuple[Part[Any], ...] = (hammer.MODES, hammer.ACCELERANCES, hammer.JOINTS, tester.TESTER, tester.COMPARISON)
EVERYTHING, ORIGIN = "Everything", "Measured how"


def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view of the run and the part that the address names."""
    run_id = current_run(frame.services, query)
    if run_id is None:
        show("<p>Nothing was measured yet. Press <a href='/page/measure'>Measure</a>, or import a bundle.</p>")
        return
    part = query.get("part", PARTS[0].title)
    try:
        with frame.services.catalogue.reading() as session:
            run = get_run(session, run_id)
    except NotFoundError as error:
        frame.tell(f"{error}; the list of runs has those that there are")
        return
    how = run_state(run, frame.services.rig_state)
    paragraph(f"Run {run.id}: {run.title}; {run.article}; {how}", "quiet")
    parts = (*(each.title for each in PARTS), EVERYTHING, ORIGIN)
    show(tabs("parts of the results", {name: f"/page/results?run={run.id}&part={name}" for name in parts}, part))

    async def refresh() -> None:
        await _fill(frame, run, part, place)

    files.jobs_of_run(frame, run, refresh)
    place = ui.element("div").classes("w-full")
    ui.timer(0, refresh, once=True)


async def _fill(frame: Frame, run: Run, part: str, place: ui.element) -> None:
    place.clear()
    if part == ORIGIN:
        with place:
            _origin(frame, run)
        return
    for each in PARTS:
        if part in (each.title, EVERYTHING):
            with place:
                await _show(frame, run, each)


async def _show(frame: Frame, run: Run, part: Part[Any]) -> None:
    show(f"<h2>{part.title}</h2>")
    waiting = show("<p>…</p>")
    try:
        found = await frame.reading(lambda: part.read(frame.services.catalogue, run))
    except NotFoundError:
        waiting.set_content(f'<p class="notice">{part.missing}</p>')
        return
    waiting.delete()
    if found is not None:
        part.draw(run, found)


def _origin(frame: Frame, run: Run) -> None:
    """Instruments, calibrations and history of the run."""
    with frame.services.catalogue.reading() as session:
        channels, events = list_channels(session, run.id), list_run_events(session, run.id)
    said: dict[str, Cell] = {
        "started": moment(run.started_at),
        "ended": moment(run.finished_at),
        "software": run.software_version,
        "configuration": run.configuration_hash,
        "records": run.waveform_file,
        "measure it again": Link("the same sequence", f"/page/measure?like={run.id}"),
    }
    show(terms(said))
    rows = [
        (
            each.name,
            each.physical,
            f"{each.sensitivity:.6g} V/({each.unit})",
            each.instrument.serial,
            str(each.instrument.calibrated_on or "–"),
        )
        for each in channels
    ]
    show(table("Channels", ("channel", "terminal", "sensitivity", "sensor", "calibrated on"), rows))
    history = [(moment(each.happened_at), each.state.value, each.who or "", each.reason or "") for each in events]
    show(table("History", ("when", "state", "who", "why"), history))
