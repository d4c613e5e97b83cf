"""Results of a run: modes, accelerances, joints, tester, comparison of both experiments, files and origin."""

from collections.abc import Callable, Mapping
from html import escape
from typing import Any

from nicegui import ui

from api.page.address import current_run
from api.page.formatting import moment, run_state
from api.page.frame import DATABASE_AWAY, Frame
from api.page.markup import Cell, Link, anchor, show, table, tabs, terms
from api.page.results import files, hammer, headline, tester
from api.page.results.amendment import amendment_form
from api.page.results.part import Part
from api.service.context import Services
from jointlab.errors import EXPECTED
from jointlab.jobs.investigations import investigations_waiting_for
from jointlab.report.summary import no_joints
from jointlab.sensitivity import stored_sensitivity_text
from store.errors import LeftOutError, NotFoundError
from store.instrument import StoredChannel
from store.measurements.amendments import Amendment, list_amendments
from store.measurements.instruments import list_channels
from store.measurements.runs import Run, RunEvent, get_run, list_run_events
from store.states import RunState

PARTS: tuple[Part[Any], ...] = (hammer.MODES, hammer.ACCELERANCES, hammer.JOINTS, tester.TESTER, tester.COMPARISON)
EVERYTHING, ORIGIN = "Everything", "Measured how"
STEPS = {"hammer": "hammer session", "sweep": "sweep"}


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view of the run and the part that the address names."""
    try:
        run = await frame.reading(lambda: _run(frame.services, query))
    except NotFoundError as error:
        frame.tell(f"{error}; the list of runs has those that there are")
        return
    except EXPECTED as error:
        frame.tell(str(error))
        return
    if run is None:
        show("<p>Nothing was measured yet. Press <a href='/page/measure'>Measure</a>, or import a bundle.</p>")
        return
    part = query.get("part", next((each.title for each in PARTS if not _lacks(run, each)), PARTS[0].title))
    how = run_state(run, frame.services.rig_state, frame.services.rig_name)
    below = f'<a href="#{headline.ACTIONS}">Identify, diagnose, report</a>'
    show(f'<p class="quiet">{escape(f"Run {run.id}: {run.title}; {run.article}; {how}")} · {below}</p>')
    for waiting in await frame.read(lambda: frame.services.catalogue.read(investigations_waiting_for, run)) or ():
        link = anchor(Link(waiting.name, f"/page/gap?investigation={waiting.id}"))
        show(f'<p class="notice">This run may be what {link} waits for.</p>')
    card = ui.element("section").classes("card w-full")
    parts = (*(each.title for each in PARTS), EVERYTHING, ORIGIN)
    show(tabs("parts of the results", {name: f"/page/results?run={run.id}&part={name}" for name in parts}, part))

    async def refresh() -> None:
        await headline.fill(frame, run, card, is_open="part" not in query)
        await _fill(frame, run, part, place, redraw)

    def redraw() -> None:
        frame.fill(refresh)

    place = ui.element("div").classes("w-full")
    with ui.element("section").classes("w-full actions").props(f'id="{headline.ACTIONS}"'):
        files.jobs_of_run(frame, run, redraw)
    redraw()


def _run(services: Services, query: Mapping[str, str]) -> Run | None:
    """The run that the address names, or the latest; None where there is none."""
    run_id = current_run(services, query)
    if run_id is None:
        return None
    return services.catalogue.read(get_run, run_id)


async def _fill(frame: Frame, run: Run, part: str, place: ui.element, redraw: Callable[[], None]) -> None:
    """Draw a part of the results from the beginning; errors of `DATABASE_AWAY` come out of it."""
    place.clear()
    if part == ORIGIN:
        with place:
            await _origin(frame, run, redraw)
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
    except LeftOutError as error:
        waiting.set_content(f'<p class="notice trouble">{escape(no_joints(error.reason).text)}</p>')
        return
    except NotFoundError:
        waiting.set_content(f'<p class="notice">{_missing(run, part)}</p>')
        return
    except DATABASE_AWAY:
        raise
    except EXPECTED as error:
        waiting.set_content(f'<p class="notice trouble">{escape(str(error))}</p>')
        return
    waiting.delete()
    part.draw(run, found)


def _lacks(run: Run, part: Part[Any]) -> bool:
    """Whether the sequence of a run, if it has one, has no step that a part needs."""
    kinds = {step["step"] for step in run.sequence.get("steps", ())}
    return bool(kinds and part.needs) and part.needs not in kinds


def _missing(run: Run, part: Part[Any]) -> str:
    """The step to take where a part has no results."""
    if not _lacks(run, part):
        return part.missing
    return (
        f"This run has no {STEPS[part.needs]}, so that it has no results here. "
        f"<a href='/page/measure?parts={part.needs}'>Measure</a> one."
    )


def _recorded(services: Services, run: Run) -> tuple[list[StoredChannel], list[RunEvent], list[Amendment]]:
    with services.catalogue.reading() as session:
        return list_channels(session, run.id), list_run_events(session, run.id), list_amendments(session, run.id)


async def _origin(frame: Frame, run: Run, redraw: Callable[[], None]) -> None:
    """Instruments, calibrations, amendments and history of the run."""
    channels, events, amendments = await frame.reading(lambda: _recorded(frame.services, run))
    said: dict[str, Cell] = {
        "started": moment(run.began_at),
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
            stored_sensitivity_text(each),
            each.instrument.serial,
            str(each.instrument.calibrated_on or "–"),
        )
        for each in channels
    ]
    show(table("Channels", ("channel", "terminal", "sensitivity", "sensor", "calibrated on"), rows))
    history = [(moment(each.happened_at), each.state.value, each.who or "", each.reason or "") for each in events]
    if amendments:
        versions = [(f"{each.version}", moment(each.created_at), each.who, each.reason) for each in amendments]
        show(table("Amendments of the setup", ("version", "when", "who", "why"), versions))
    show(table("History", ("when", "state", "who", "why"), history))
    if run.state is not RunState.CREATED:
        amendment_form(frame, run, redraw)
