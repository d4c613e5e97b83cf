"""Start a run: a sequence, which part of it, and what is to be otherwise. The address can ask for all of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from nicegui import ui

from api.page.controls import button
from api.page.frame import Frame
from api.page.markup import filters, paragraph, show
from api.page.sequence_form import (
    FIELDS,
    HAMMER_FIELDS,
    SWEEP_FIELDS,
    base_sequence,
    choices_of,
    sequence_names,
    wanted_sequence,
)
from api.page.sequence_of_run import sequence_to_decide
from api.service.access import Caller
from jointlab.errors import EXPECTED
from jointlab.sequences.wording import step_words
from jointlab.supervision.manager import RunManager
from rig.sequence import HammerStep, SineStep
from rig.sequence import Sequence as Document

PARTS = ("hammer", "sweep")


def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view: first which sequence, in the address; then its fields; then start."""
    parts = query.get("parts", "")
    show(filters(_source(frame, query) | {"parts": ("Part of it", parts, PARTS)}, "Choose"))
    try:
        base = _base(frame, query)
    except EXPECTED as error:
        frame.tell(str(error))
        return
    _form(frame, base, parts, choices_of(base) | {name: query[name] for name in FIELDS if name in query})


def _source(frame: Frame, query: Mapping[str, str]) -> dict[str, tuple[str, str, Sequence[str]]]:
    """Where the sequence is from, as a field of the address: a diagnosis, a run, or a name."""
    for name, label in (("next", "For diagnosis"), ("like", "Like run")):
        if query.get(name, "").isdecimal():
            return {name: (label, query[name], (query[name],))}
    names = sequence_names(frame.services)
    return {"sequence": ("Sequence", query.get("sequence", "") or names[0], names)}


def _base(frame: Frame, query: Mapping[str, str]) -> Document:
    """The sequence to begin with: the one that the diagnosis `next` asks for, which is said, or what else is named."""
    diagnosis = query.get("next", "")
    if not diagnosis.isdecimal():
        return base_sequence(frame.services, query)
    experiment, sequence = sequence_to_decide(frame.services, int(diagnosis))
    paragraph(f"Diagnosis {diagnosis} asks for it: {experiment}.", "notice")
    return sequence


def _form(frame: Frame, base: Document, parts: str, values: Mapping[str, str]) -> None:
    unwanted = {"hammer": SWEEP_FIELDS, "sweep": HAMMER_FIELDS}.get(parts, ())
    inputs = {}
    with ui.element("section").classes("card w-full"):
        with ui.element("div").classes("cards"):
            for name, label in FIELDS.items():
                if name in values and name not in unwanted:
                    field = ui.input(label, value=values[name]).props(f'outlined input-class="{name}"')
                    inputs[name] = field.classes("w-full")
        show("<h2>What will be done</h2>")
        steps = show("")
        by_itself = ui.checkbox("Let a simulated bench strike and mount by itself (on a real rig this changes nothing)")
        show(
            "<p>Decimals may be written 0.1 or 0,1. The rig checks every point against its limits before anything "
            "moves. Keep clear of the actuator once the run has started.</p>"
        )

        def chosen() -> dict[str, str]:
            return dict(values) | {name: field.value or "" for name, field in inputs.items()}

        def list_steps() -> None:
            steps.set_content(_steps(base, parts, chosen()))

        list_steps()
        for field in inputs.values():
            field.on("change", list_steps)

        async def begin() -> None:
            choices = chosen()
            started = await _start(frame, base, parts, choices, by_itself.value)
            if started is not None:
                ui.navigate.to(_live_view(wanted_sequence(base, parts, choices)))

        button("Start", begin, main=True)


def _steps(base: Document, parts: str, choices: Mapping[str, str]) -> str:
    """What would be done, in order; or why it cannot be."""
    try:
        wanted = wanted_sequence(base, parts, choices)
    except EXPECTED as error:
        return f'<p class="notice">{escape(str(error))}</p>'
    return f'<ol id="steps">{"".join(f"<li>{escape(step_words(step))}</li>" for step in wanted.steps)}</ol>'


def _live_view(sequence: Document) -> str:
    """Where what is measured first is seen; NiceGUI puts /page before it."""
    strikes = next((step.step == "hammer" for step in sequence.steps if isinstance(step, HammerStep | SineStep)), False)
    return "/hammer" if strikes else "/sweep"


async def _start(
    frame: Frame, base: Document, parts: str, choices: Mapping[str, str], automatic: bool
) -> int | None:  # fmt: skip
    """Plan the run and start it; its number."""
    run_id = await frame.deeds.drive(
        "create run", "new run", lambda runs, caller: runs.plan(wanted_sequence(base, parts, choices), caller.name)
    )
    if run_id is None:
        return None

    def start(runs: RunManager, caller: Caller) -> int:
        runs.start(run_id, caller.name, automatic=automatic)
        return run_id

    return await frame.deeds.drive("start run", f"run {run_id}", start)
