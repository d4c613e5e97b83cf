"""Start a run: a sequence, which part of it, and what is to be otherwise. The address can ask for all of it."""

from __future__ import annotations

from collections.abc import Mapping

from nicegui import ui

from api.errors import EXPECTED
from api.page.controls import button
from api.page.frame import Frame
from api.page.markup import filters, paragraph, show
from api.page.wanted import (
    FIELDS,
    HAMMER_FIELDS,
    SWEEP_FIELDS,
    base_sequence,
    choices_of,
    sequence_names,
    wanted_sequence,
)
from api.runs.manager import RunManager
from api.service.access import Caller
from rig.sequence import Sequence

PARTS = ("hammer", "sweep")


def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view: first which sequence, in the address; then its fields; then start."""
    parts = query.get("parts", "")
    names = sequence_names(frame.services)
    show(
        filters(
            {
                "sequence": ("Sequence", query.get("sequence", "") or names[0], names),
                "parts": ("Part of it", parts, PARTS),
            },
            "Choose",
        )
    )
    if why := query.get("because", ""):
        paragraph(f"Why: {why}", "notice")
    try:
        base = base_sequence(frame.services, query)
    except EXPECTED as error:
        frame.tell(str(error))
        return
    _form(frame, base, parts, choices_of(base) | {name: query[name] for name in FIELDS if name in query})


def _form(frame: Frame, base: Sequence, parts: str, values: Mapping[str, str]) -> None:
    unwanted = {"hammer": SWEEP_FIELDS, "sweep": HAMMER_FIELDS}.get(parts, ())
    inputs = {}
    with ui.element("section").classes("card w-full"):
        with ui.element("div").classes("cards"):
            for name, label in FIELDS.items():
                if name in values and name not in unwanted:
                    field = ui.input(label, value=values[name]).props(f'outlined input-class="{name}"')
                    inputs[name] = field.classes("w-full")
        by_itself = ui.checkbox("Let a simulated bench strike and mount by itself (on a real rig this changes nothing)")
        show(
            "<p>Decimals may be written 0.1 or 0,1. The rig checks every point against its limits before anything "
            "moves. Keep clear of the actuator once the run has started.</p>"
        )

        async def begin() -> None:
            choices = dict(values) | {name: field.value or "" for name, field in inputs.items()}
            started = await _start(frame, base, parts, choices, by_itself.value)
            if started is not None:
                first = wanted_sequence(base, parts, choices).steps[0].step
                ui.navigate.to("/hammer" if first == "hammer" else "/sweep")  # NiceGUI puts /page before it

        button("Start", begin, main=True)


async def _start(
    frame: Frame, base: Sequence, parts: str, choices: Mapping[str, str], automatic: bool
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
