"""Start a run: a sequence, the part of it to measure, and changes to it. The address can give all of them.

What most runs change has fields; the whole sequence can be changed as text.
"""

from collections.abc import Mapping
from urllib.parse import urlencode

from nicegui import ui

from api.page.controls import button
from api.page.frame import Frame
from api.page.markup import filters, paragraph, show, tabs
from api.page.sequence_choice import ASKED, chosen, chosen_text, sources
from api.page.sequence_editor import TEXT, sequence_editor
from api.page.starting import automatic_choice, outlook, show_warnings, start
from jointlab.sequences.form import HAMMER_FIELDS, STEPS_OF_PART, SWEEP_FIELDS, form_of, sequence_of_form
from rig.sequences.sequence import Sequence as Document

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
    """Build the view: first the choice of a sequence, in the address; then its fields or its text; then the start."""
    part, as_text = query.get("parts", ""), query.get("as") == TEXT
    source = await frame.read(lambda: sources(frame.services, query))
    if source is None:
        return
    if as_text:
        show(filters(source, "Choose", {"as": TEXT}))
    else:
        show(filters(source | {"parts": ("Part of it", part, tuple(STEPS_OF_PART))}, "Choose"))
    named = {name: value for name, (_, value, _) in source.items()}
    ways = {"Fields": named, "Text": named | {"as": TEXT}}
    links = {way: f"/page/measure?{urlencode(each)}" for way, each in ways.items()}
    show(tabs("how to change it", links, "Text" if as_text else "Fields"))
    if as_text:
        text = await frame.read(lambda: chosen_text(frame.services, query))
        if text is not None:
            _asked(query, text[1])
            await show_warnings(frame)
            sequence_editor(frame, text[0])
        return
    read = await frame.read(lambda: chosen(frame.services, query))
    if read is None:
        return
    base, experiment = read
    _asked(query, experiment)
    await show_warnings(frame)
    _form(frame, base, part, form_of(base) | {name: query[name] for name in LABELS if name in query})


def _asked(query: Mapping[str, str], experiment: str) -> None:
    """The experiment that the sequence is for, where another view asked for it."""
    if experiment:
        who = f"Investigation {query[ASKED]}" if ASKED in query else f"Diagnosis {query['next']}"
        paragraph(f"{who} asks for this: {experiment}.", "notice")


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
        automatic = automatic_choice(frame)
        show(
            "<p>Decimals may be written 0.1 or 0,1. The rig checks every point against its limits before anything "
            "moves. Keep clear of the actuator once the run has started.</p>"
        )

        def made() -> Document:
            filled = dict(values) | {name: field.value or "" for name, field in inputs.items()}
            return sequence_of_form(base, part, filled)

        def list_steps() -> None:
            steps.set_content(outlook(frame.services, made)[1])

        list_steps()
        for field in inputs.values():
            field.on("change", list_steps)
        button("Start", lambda: start(frame, made, automatic=automatic.value), main=True)
