"""An investigation: the verdict so far, its experiments, and what it asks for, to be answered, refused or stopped."""

import math
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from html import escape

from nicegui import ui

from api.page.controls import button, choice
from api.page.formatting import job_progress, moment
from api.page.frame import Frame
from api.page.markup import Cell, Link, anchor, paragraph, show, table
from api.service.access import Caller
from api.service.context import queue
from jointlab.diagnosis.catalogue import title_of
from jointlab.diagnosis.experiment_text import request
from jointlab.diagnosis.investigation import Answer, Asked, Budget, Data, Readings, Refused
from jointlab.diagnosis.investigation_text import (
    HEAD,
    asked_text,
    effects_text,
    last_sentence,
    missing_sentences,
    steps_table,
)
from jointlab.diagnosis.reading_text import reading_label, reading_words
from jointlab.errors import EXPECTED, JointlabError
from jointlab.jobs.investigations import (
    StoredInvestigation,
    answer,
    begin,
    get_investigation,
    go_on,
    list_investigations,
    offered_runs,
    stop,
)
from store.errors import NotFoundError
from store.measurements.runs import Run
from store.service.jobs import Job
from store.states import InvestigationState, Scope

LOOK = 0.5  # s
STATES = {
    InvestigationState.WORKING: ("diagnosing", "moving"),
    InvestigationState.WAITING: ("waits for you", "held"),
    InvestigationState.ENDED: ("ended", "accepted"),
    InvestigationState.STOPPED: ("stopped", "idle"),
    InvestigationState.FAILED: ("failed", "refused"),
}
Act = Callable[[Caller], StoredInvestigation]


async def build(frame: Frame, number: int) -> None:
    """Build the view of one investigation; it is drawn again whenever that has changed."""
    progress_at = show("").props('aria-live="polite"')
    place = ui.element("div").classes("w-full")
    drawn = list[object]()

    async def look() -> None:
        try:
            found, runs = await frame.reading(lambda: _read(frame, number))
        except NotFoundError as error:
            frame.tell(f"{error}; the list of the view Gap has those that there are")
            timer.cancel()
            return
        except EXPECTED as error:
            frame.tell(str(error))
            return
        working = found.state is InvestigationState.WORKING
        progress_at.set_content(f"<p>{escape(_progress(found.job))}</p>" if working else "")
        now: list[object] = [found.job.id, found.state, [run.id for run in runs]]
        if now == drawn:
            return
        drawn[:] = now
        place.clear()
        with place:
            _draw(frame, found, runs)

    timer = ui.timer(LOOK, look)


def show_list(caption: str, found: Sequence[StoredInvestigation]) -> None:
    """A table of investigations; nothing where there are none."""
    if not found:
        return
    rows = [
        (
            Link(each.name, f"/page/gap?investigation={each.id}"),
            str(each.run),
            STATES[each.state][0],
            _leads(each),
            str(len(each.investigation.made)),
            moment(each.job.finished_at or each.job.created_at),
        )
        for each in found
    ]
    show(table(caption, ("", "run", "state", "leading explanation", "experiments", "changed"), rows))


def begin_button(frame: Frame, run: int) -> None:
    """A button that begins an investigation of a run and opens it."""

    async def press() -> None:
        begun = await _act(
            frame, "begin", f"run {run}", lambda caller: begin(queue(frame.services), run, Budget(), caller.name)
        )
        if begun is not None:
            ui.navigate.to(f"/gap?investigation={begun.id}")

    button("Find the cause by experiments", press)


def investigations_of(frame: Frame, run: int | None = None) -> list[StoredInvestigation]:
    """The stored investigations, or those of one run."""
    return frame.services.catalogue.read(list_investigations, run_id=run)


def _read(frame: Frame, number: int) -> tuple[StoredInvestigation, list[Run]]:
    """The investigation, and the runs that may answer where it asks for one."""
    with frame.services.catalogue.reading() as session:
        found = get_investigation(session, number)
        asked = found.investigation.open_request
        return found, [] if asked is None or asked.readings else offered_runs(session, found)


def _draw(frame: Frame, found: StoredInvestigation, runs: Sequence[Run]) -> None:
    words, colour = STATES[found.state]
    run = anchor(Link(f"run {found.run}", f"/page/results?run={found.run}"))
    show(
        f'<p class="big" id="investigation"><span class="badge {colour}">{escape(words)}</span></p>'
        f"<p>{escape(found.name.capitalize())} of {run}. {escape(_verdict(found))}</p>"
    )
    _error(found)
    asked = found.investigation.open_request
    if found.state is not InvestigationState.WORKING and asked is not None:
        text = asked_text(asked)
        show(f'<h2>Next experiment</h2><p id="asked">{escape(text[:1].upper() + text[1:])}.</p>')
        if asked.readings:
            _readings(frame, found, asked)
        else:
            _run(frame, found, runs)
        _refusal(frame, found)
    with ui.element("div").classes("row-of"):
        if found.state in (InvestigationState.STOPPED, InvestigationState.FAILED):
            button("Go on", lambda: _go_on(frame, found))
        if found.state not in (InvestigationState.STOPPED, InvestigationState.ENDED):
            button("Stop the investigation", lambda: _stop(frame, found))
    if found.investigation.steps and found.investigation.steps[-1].ended == "budget":
        _more_budget(frame, found)
    _steps(found)


def _verdict(found: StoredInvestigation) -> str:
    if not found.investigation.steps:
        return "The run has not been diagnosed yet."
    last = found.investigation.steps[-1]
    said = f"So far {_leads(found)} with a probability of {100 * last.probability:.1f} %."
    if last.ended is None:
        return said
    end = last_sentence(found.investigation)
    return f"{said} {end[:1].upper()}{end[1:]}."


def _leads(found: StoredInvestigation) -> str:
    steps = found.investigation.steps
    return effects_text(steps[-1].effects) if steps else "–"


def _progress(job: Job) -> str:
    return job_progress(job) if job.stage else "The diagnosis waits for its turn."


def _error(found: StoredInvestigation) -> None:
    if found.state is InvestigationState.FAILED and found.job.error:
        paragraph(f"The last diagnosis has failed: {found.job.error}.", "notice trouble")


def _steps(found: StoredInvestigation) -> None:
    """All steps, each with its diagnosis."""
    steps = found.investigation.steps
    if not steps:
        return
    rows: list[Sequence[Cell]] = [
        (*row, "–" if step.diagnosis is None else Link(f"diagnosis {step.diagnosis}", _address(step.diagnosis)))
        for row, step in zip(steps_table(found.investigation).rows, steps, strict=True)
    ]
    show(table("Steps", (*HEAD, "all data"), rows))
    for each in missing_sentences(found.investigation):
        paragraph(f"{each[:1].upper()}{each[1:]}.", "notice")
    budget = found.investigation.budget
    paragraph(
        f"Spent: {len(found.investigation.made)} of {budget.experiments} experiments, "
        f"{found.investigation.minutes:.0f} of {budget.minutes:.0f} min on the rig.",
        "quiet",
    )


def _address(diagnosis: int) -> str:
    return f"/page/gap?diagnosis={diagnosis}"


def _run(frame: Frame, found: StoredInvestigation, runs: Sequence[Run]) -> None:
    """A link to the sequence, and the runs with which the request may be answered."""
    address = f"/page/measure?investigation={found.id}"
    show(
        f'<p><a class="act main" href="{escape(address)}">Open the sequence for it</a></p>'
        "<p>Start it there like any other run. When it is finished, choose it here.</p>"
    )
    if not runs:
        paragraph("There is no other finished run of this article yet.", "quiet")
        return
    offered = {str(run.id): f"run {run.id}: {run.title}, {moment(run.began_at)}" for run in runs}
    chosen = [str(runs[0].id)]
    with ui.element("div").classes("row-of"):
        choice("Measured by", "answer-run", offered, partial(chosen.__setitem__, 0))
        button("Diagnose with this run", lambda: _answer(frame, found, Data(chosen[0])), main=True)


def _readings(frame: Frame, found: StoredInvestigation, asked: Asked) -> None:
    """A field for each reading."""
    fields = dict[str, ui.input]()
    with ui.element("div").classes("row-of"):
        for name, unit in asked.readings.items():
            label = reading_label(name, unit)
            label = label[:1].upper() + label[1:]
            with ui.element("div"):
                paragraph(label)  # above the field: inside it a phone cuts the unit off
                fields[name] = ui.input().props('outlined inputmode="decimal"')
                fields[name].props["aria-label"] = label

    async def send() -> None:
        try:
            typed = {name: field.value or "" for name, field in fields.items()}
            values = {name: _value(reading_words(name), text) for name, text in typed.items() if text.strip()}
        except JointlabError as error:
            frame.tell(str(error))
            return
        await _answer(frame, found, Readings(values))

    button("Diagnose with these readings", send, main=True)


def _value(name: str, text: str) -> float:
    try:
        found = float(text.strip().replace(",", "."))
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise JointlabError(f"{name} is a number such as 0.12 or 25e-6, and not {text!r}")
    return found


def _budget(minutes: str, experiments: str, certain: float) -> Budget:
    """A budget as it was written. JointlabError where it is none."""
    spent, count = _value("minutes", minutes), _value("experiments", experiments)
    if spent < 0 or count < 0 or count != int(count):
        raise JointlabError("minutes and experiments are not negative, and experiments are a whole number")
    return Budget(spent, int(count), certain)


def _refusal(frame: Frame, found: StoredInvestigation) -> None:
    """A field for the reason why the experiment cannot be made, and what is asked for otherwise."""
    others = [each for each in found.investigation.steps[-1].otherwise if each.experiment.information]
    if others:
        said = "; ".join(f"{request(each.experiment, title_of)} ({each.experiment.minutes:.0f} min)" for each in others)
        paragraph(f"If it cannot be made, these are asked for in turn: {said}.", "quiet")
    with ui.element("div").classes("row-of"):
        reason = ui.input("Why it cannot be made").props("outlined")

        async def refuse() -> None:
            text = (reason.value or "").strip()
            if text:
                await _answer(frame, found, Refused(text))
            else:
                frame.tell("write why the experiment cannot be made; another one is then asked for")

        button("Ask for another one", refuse)


def _more_budget(frame: Frame, found: StoredInvestigation) -> None:
    """Fields for a larger budget."""
    budget = found.investigation.budget
    with ui.element("div").classes("row-of"):
        minutes = ui.input("Minutes on the rig in all", value=f"{budget.minutes:g}").props("outlined")
        experiments = ui.input("Experiments in all", value=str(budget.experiments)).props("outlined")

        async def send() -> None:
            try:
                larger = _budget(minutes.value or "", experiments.value or "", budget.certain)
            except JointlabError as error:
                frame.tell(str(error))
                return
            await _go_on(frame, found, larger)

        button("Go on with this budget", send, main=True)


def _answer(frame: Frame, found: StoredInvestigation, given: Answer) -> Awaitable[object]:
    def do(caller: Caller) -> StoredInvestigation:
        return answer(queue(frame.services), frame.services.catalogue, found.id, given, caller.name)

    return _act(frame, "answer", found.name, do, **_details(given))


def _details(given: Answer) -> dict[str, object]:
    """An answer for the audit log, under the names that requests have."""
    match given:
        case Data(source):
            return {"run": int(source)}
        case Readings(values):
            return {"readings": values}
        case Refused(reason):
            return {"refusal": reason}


def _go_on(frame: Frame, found: StoredInvestigation, budget: Budget | None = None) -> Awaitable[object]:
    def do(caller: Caller) -> StoredInvestigation:
        larger = None if budget is None else lambda _present: budget
        return go_on(queue(frame.services), frame.services.catalogue, found.id, caller.name, larger)

    return _act(frame, "continue", found.name, do)


def _stop(frame: Frame, found: StoredInvestigation) -> Awaitable[object]:
    return _act(
        frame,
        "stop",
        found.name,
        lambda caller: stop(queue(frame.services), frame.services.catalogue, found.id, caller.name),
    )


def _act(frame: Frame, what: str, target: str, do: Act, **details: object) -> Awaitable[StoredInvestigation | None]:
    return frame.actions.act(Scope.ANALYSE, f"{what} investigation", target, do, **details)
