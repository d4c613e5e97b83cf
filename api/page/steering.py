"""What drives the run that is carried out: the operator's prompt, hold, go on, and resume after it has ended."""

from __future__ import annotations

from dataclasses import replace
from html import escape

from nicegui import ui

from api.page.controls import button
from api.page.frame import Frame
from api.page.markup import show
from api.runs.prompts import Prompt
from api.runs.state import Phase, RigState

RESUMABLE = ("stopped", "failed")
ENDED = {"finished": "is finished", "stopped": "is stopped", "failed": "has failed"}


def steering(frame: Frame, *, holds: bool = True) -> None:
    """A row that follows the rig: what the operator is to do, and how to hold and go on."""
    runs = frame.services.runs
    if runs is None:
        show("<p>This service drives no rig; it shows what was measured.</p>")
        return
    row = ui.element("div").classes("card w-full").props('aria-live="polite"')
    shown: list[tuple[RigState, Prompt | None]] = []

    async def refresh() -> None:
        now = [(without_counts(runs.state), runs.prompt)]
        if now == shown:
            return  # a button that is made anew with every point can hardly be pressed
        shown[:] = now
        row.clear()
        with row:
            show(prompt_text(runs.state, runs.prompt))
            with ui.element("div").classes("row-of"):
                _buttons(frame, runs.state, runs.prompt, holds)

    frame.refreshes.append(refresh)


def without_counts(state: RigState) -> RigState:
    """What of a state does not change with every blow and sine point."""
    return replace(state, blows=0, sines=0)


def prompt_text(state: RigState, prompt: Prompt | None) -> str:
    """What the operator is to do, as large as it is important."""
    if state.phase is Phase.IDLE:
        ended = f"Run {state.run_id} {ENDED[state.ended_as]}" if state.ended_as else "Nothing is carried out"
        why = f": {escape(state.reason)}" if state.reason else ""
        return f'<p class="big" id="prompt">{escape(ended)}{why}.</p>'
    if state.phase is Phase.PAUSED:
        return '<p class="big" id="prompt">On hold. The actuator is held, nothing is armed.</p>'
    if prompt is None:
        return f'<p class="big" id="prompt">{escape(state.activity or "Starting")} …</p>'
    after = "" if prompt.waits else "<p>The trigger waits for your blow.</p>"
    return f'<p class="big" id="prompt">{escape(prompt.text[:1].upper() + prompt.text[1:])}</p>{after}'


def _buttons(frame: Frame, state: RigState, prompt: Prompt | None, holds: bool) -> None:
    run_id = state.run_id
    if run_id is None:
        show('<a class="act main" href="/page/measure">Measure something</a>')
        return
    if state.phase is Phase.IDLE:
        if state.ended_as in RESUMABLE and not state.interlocks:
            button(f"Resume run {run_id}", lambda: resume(frame, run_id), main=True, key="r")
        show(f'<a class="act" href="/page/results?run={run_id}">Results of run {run_id}</a>')
        show('<a class="act" href="/page/measure">Measure something</a>')
        return
    if prompt is not None and prompt.waits:
        number = prompt.number
        button("Done", lambda: _answer(frame, run_id, number), main=True, key=" ")
    if state.phase is Phase.PAUSED:
        button("Go on", lambda: resume(frame, run_id), main=True, key="r")
    elif holds and state.phase is Phase.RUNNING:
        button("Hold", lambda: _pause(frame, run_id), key="h")


async def resume(frame: Frame, run_id: int) -> None:
    """Let a run go on that is on hold, was stopped or has failed."""
    await frame.deeds.drive(
        "resume run", f"run {run_id}", lambda runs, caller: runs.resume(run_id, caller.name, reset=False)
    )  # fmt: skip


async def _pause(frame: Frame, run_id: int) -> None:
    await frame.deeds.drive("pause run", f"run {run_id}", lambda runs, _: runs.pause(run_id))


async def _answer(frame: Frame, run_id: int, number: int) -> None:
    await frame.deeds.drive("answer prompt", f"run {run_id}", lambda runs, _: runs.answer(run_id, number))
