"""Start a run: a sequence, the part of it to measure, and changes to it. The address can give all of them."""

from collections.abc import Mapping, Sequence
from html import escape

from nicegui import ui

from api.page.address import number
from api.page.controls import button
from api.page.formatting import WHOLE_LIST
from api.page.frame import Frame
from api.page.instruments.examinations import warnings_text
from api.page.markup import filters, paragraph, show
from api.service.access import Caller
from api.service.context import Services
from jointlab.commissioning.warnings import latest_examination
from jointlab.diagnosis.investigation_text import asked_text
from jointlab.errors import EXPECTED
from jointlab.jobs.investigations import sequence_for_request
from jointlab.sequences import BUILT_IN, NAMES, sequence_named
from jointlab.sequences.form import HAMMER_FIELDS, STEPS_OF_PART, SWEEP_FIELDS, form_of, sequence_of_form
from jointlab.sequences.of_run import sequence_for_diagnosis, sequence_of_run
from jointlab.sequences.wording import step_text
from jointlab.supervision.manager import RunManager
from rig.sequences.sequence import HammerStep, SineStep
from rig.sequences.sequence import Sequence as Document
from rig.sequences.steps import check_channels, check_plan
from rig.tester.limits import TesterLimits
from store.service.sequence_documents import list_sequences

ASKED = "investigation"
"""Field of the address with the number of the investigation whose experiment is measured."""
LABELS = {
    "title": "Title",
    "article_name": "Test article",
    "points": "Points to strike",
    "blows": "Blows at each point",
    "specimens": "Joints in the tester",
    "configurations": "Configurations",
    "amplitudes": "Amplitudes, mm peak to peak",
    "frequencies": "Frequencies: first, last, step, Hz",
}


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view: first the choice of a sequence, in the address; then its fields; then the start."""
    part = query.get("parts", "")
    source = await frame.read(lambda: _source(frame.services, query))
    if source is None:
        return
    show(filters(source | {"parts": ("Part of it", part, tuple(STEPS_OF_PART))}, "Choose"))
    read = await frame.read(lambda: _base(frame.services, query))
    if read is None:
        return
    base, experiment = read
    if experiment:
        who = f"Investigation {query[ASKED]}" if ASKED in query else f"Diagnosis {query['next']}"
        paragraph(f"{who} asks for this: {experiment}.", "notice")
    warned = await frame.read(lambda: _warned(frame.services))
    if warned:
        show(warned + '<p><a href="/page/instruments">Examine the rig</a></p>')
    _form(frame, base, part, form_of(base) | {name: query[name] for name in LABELS if name in query})


def _warned(services: Services) -> str:
    """Warnings about the rig before a run, as those of `jointlab run`."""
    runs = services.runs
    return "" if runs is None else warnings_text(runs, latest_examination(services.catalogue, runs.instruments.rig))


def _source(services: Services, query: Mapping[str, str]) -> dict[str, tuple[str, str, Sequence[str]]]:
    """The source of the sequence, as a field of the address: an investigation, a diagnosis, a run, or a name."""
    for name, label in ((ASKED, "For investigation"), ("next", "For diagnosis"), ("like", "Like run")):
        if number(query, name) is not None:
            return {name: (label, query[name], (query[name],))}
    with services.catalogue.reading() as session:
        names = (*NAMES, *(stored.name for stored in list_sequences(session, limit=WHOLE_LIST)))
    return {"sequence": ("Sequence", query.get("sequence", "") or names[0], names)}


def _base(services: Services, query: Mapping[str, str]) -> tuple[Document, str]:
    """The sequence to change: the one that an investigation or the diagnosis `next` asks for, that of the run `like`,
    or a named one; and the experiment that is asked for, in words.
    """
    investigation, diagnosis, like = number(query, ASKED), number(query, "next"), number(query, "like")
    with services.catalogue.reading() as session:
        if investigation is not None:
            asked, sequence = sequence_for_request(session, investigation, _limits(services))
            return sequence, asked_text(asked)
        if diagnosis is not None:
            experiment, sequence = sequence_for_diagnosis(session, diagnosis, _limits(services))
            return sequence, experiment
        if like is not None:
            return sequence_of_run(session, like), ""
        return sequence_named(session, query.get("sequence") or BUILT_IN), ""


def _form(frame: Frame, base: Document, part: str, values: Mapping[str, str]) -> None:
    hidden = {"hammer": SWEEP_FIELDS, "sweep": HAMMER_FIELDS}.get(part, ())
    inputs = {}
    with ui.element("section").classes("card w-full"):
        with ui.element("div").classes("cards"):
            for name, label in LABELS.items():
                if name in values and name not in hidden:
                    field = ui.input(label, value=values[name]).props(f'outlined input-class="{name}"')
                    inputs[name] = field.classes("w-full")
        show("<h2>What will be done</h2>")
        steps = show("")
        runs = frame.services.runs
        automatic = ui.checkbox("Let the simulated bench strike and mount by itself", value=True)
        automatic.set_visibility(runs is not None and runs.has_automatic_operator)
        show(
            "<p>Decimals may be written 0.1 or 0,1. The rig checks every point against its limits before anything "
            "moves. Keep clear of the actuator once the run has started.</p>"
        )

        def filled() -> dict[str, str]:
            return dict(values) | {name: field.value or "" for name, field in inputs.items()}

        def list_steps() -> None:
            steps.set_content(_steps(base, part, filled(), frame.services))

        list_steps()
        for field in inputs.values():
            field.on("change", list_steps)

        async def begin() -> None:
            form = filled()
            started = await _start(frame, base, part, form, automatic.value)
            if started is not None:
                ui.navigate.to(_live_view(sequence_of_form(base, part, form)))

        button("Start", begin, main=True)


def _limits(services: Services) -> TesterLimits:
    return TesterLimits() if services.runs is None else services.runs.instruments.limits


def _steps(base: Document, part: str, form: Mapping[str, str], services: Services) -> str:
    """The steps of the run in order, or why it cannot be measured."""
    try:
        sequence = sequence_of_form(base, part, form)
        check_plan(sequence, _limits(services))
        if services.runs is not None:
            check_channels(sequence, services.runs.instruments)
    except EXPECTED as error:
        return f'<p class="notice">{escape(str(error))}</p>'
    return f'<ol id="steps">{"".join(f"<li>{escape(step_text(step))}</li>" for step in sequence.steps)}</ol>'


def _live_view(sequence: Document) -> str:
    """The view of the step that measures first; NiceGUI puts /page before it."""
    strikes = next((step.step == "hammer" for step in sequence.steps if isinstance(step, HammerStep | SineStep)), False)
    return "/hammer" if strikes else "/sweep"


async def _start(frame: Frame, base: Document, part: str, form: Mapping[str, str], automatic: bool) -> int | None:
    """Plan the run and start it; its number."""
    run_id = await frame.actions.drive(
        "create run", "new run", lambda runs, caller, _: runs.plan(sequence_of_form(base, part, form), caller.name)
    )
    if run_id is None:
        return None

    def start(runs: RunManager, caller: Caller, lease: int) -> int:
        runs.start(run_id, caller.name, automatic=automatic, lease=lease)
        return run_id

    return await frame.actions.drive("start run", f"run {run_id}", start)
