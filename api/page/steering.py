"""The row that drives a run: the operator's prompt, pause and resume, also after the run has ended."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import replace
from html import escape

from nicegui import ui

from api.page.address import current_run
from api.page.controls import button
from api.page.formatting import UNKNOWN, trip_sentences
from api.page.frame import Frame
from api.page.markup import show
from api.service.access import Caller
from jointlab.drive.events import PromptKind
from jointlab.drive.phase import Phase
from jointlab.drive.prompts import Prompt
from jointlab.drive.state import RigState
from jointlab.supervision.manager import RunManager
from store.measurements.runs import Run, get_run
from store.states import RunState

ENDED = {
    RunState.CREATED: "has not begun",
    RunState.RUNNING: "was cut off",
    RunState.FINISHED: "is finished",
    RunState.STOPPED: "is stopped",
    RunState.FAILED: "has failed",
}
"""The state of a run that is not carried out; one that the store calls running was cut off."""
HELD = {
    True: "The hydraulics are on: the actuator holds its position under pressure.",
    False: "The hydraulics are off.",
    None: "The run does not drive the actuator here.",
}
"""Text about the pressure while a run is paused."""
TRIPPED_MEANWHILE = "Remove the cause. The tester can be reset when the run has ended, and the run then resumed."
RESUMABLE = (RunState.RUNNING, RunState.STOPPED, RunState.FAILED)


def steering(frame: Frame, query: Mapping[str, str]) -> None:
    """A row that follows the rig: the prompt to the operator, and buttons for the run that the view shows."""
    runs = frame.services.runs
    if runs is None:
        show("<p>This service drives no rig; it only shows results.</p>")
        return
    row = ui.element("div").classes("card w-full").props('aria-live="polite"')
    shown: list[tuple[RigState, Prompt | None, int | None, int | None]] = []

    async def refresh() -> None:
        state, prompt = runs.state, runs.prompt
        now = [(without_counts(state), prompt, runs.pause_number, runs.stop_epoch)]
        if now == shown:
            return  # a button that is rebuilt with every point can hardly be pressed
        run = await frame.read(lambda: _latest(frame, query)) if not state.phase.is_of_a_run else None
        shown[:] = now
        row.clear()
        with row:
            show(f'<p class="big" id="prompt">{escape(prompt_text(state, prompt, run))}</p>')
            if beside := beside_prompt(state, prompt):
                show(f"<p>{escape(beside)}</p>")
            if run is not None and state.is_tripped:
                show(f'<p id="ended">{escape(_ended(state, run))}</p>')
            with ui.element("div").classes("row-of"):
                _buttons(frame, state, prompt, run)

    frame.refreshes.append(refresh)


def without_counts(state: RigState) -> RigState:
    """A state without the counts that change with every blow and sine point."""
    return replace(state, blows=0, refused_blows=0, sines=0)


def prompt_text(state: RigState, prompt: Prompt | None, run: Run | None) -> str:
    """The text for the operator: what to do, or the state of the last run."""
    if state.phase is Phase.IDLE:
        if state.is_tripped:
            return f"{' '.join(trip_sentences(state))} Remove the cause, then reset."
        return "No run is in progress." if run is None else _ended(state, run)
    if state.phase is Phase.UNKNOWN:
        return UNKNOWN
    if state.phase is Phase.STOPPING and (why := state.rest_unknown or state.shut_down):
        return f"Step back, and keep away from the machine: {why}"
    if state.phase is Phase.PAUSED:
        return f"Paused, nothing is armed. {HELD[state.pressure]}"
    if prompt is None:
        doing = state.activity or "starting"
        return f"{doing[:1].upper()}{doing[1:]} …"
    return prompt.text[:1].upper() + prompt.text[1:]


def beside_prompt(state: RigState, prompt: Prompt | None) -> str:
    """What is said beside the prompt; blank where there is nothing to say."""
    sentences = []
    if prompt is not None and prompt.kind is PromptKind.STRIKE and not prompt.waits and state.phase is Phase.RUNNING:
        sentences.append("The trigger waits for your blow.")
    if prompt is not None and prompt.waits and state.phase is Phase.PAUSED:
        sentences.append(f"Still to be done after that: {prompt.text}.")
    if state.is_tripped and state.phase in (Phase.RUNNING, Phase.PAUSED):  # it does not need the tester just now
        sentences += [*trip_sentences(state), TRIPPED_MEANWHILE]
    return " ".join(sentences)


def _ended(state: RigState, run: Run) -> str:
    # from the rig, where it could not be stored
    reason = run.reason or (state.reason if state.run_id == run.id else None)
    return f"Run {run.id} {ENDED[run.state]}{f': {reason}' if reason else ''}."


def _latest(frame: Frame, query: Mapping[str, str]) -> Run | None:
    run_id = current_run(frame.services, query)
    if run_id is None:
        return None
    return frame.services.catalogue.read(get_run, run_id)


def _buttons(frame: Frame, state: RigState, prompt: Prompt | None, run: Run | None) -> None:
    if state.phase is Phase.EXAMINING:
        show('<a class="act main" href="/page/instruments">Look at the examination</a>')
        return
    if state.phase is Phase.UNKNOWN:
        return
    if state.phase is Phase.IDLE:
        if state.is_tripped:
            reset_button(frame)
        if run is not None:
            _after(frame, state, run)
        show('<a class="act" href="/page/measure">Measure something</a>')
        return
    run_id = state.run_id
    assert run_id is not None, "a run that is carried out has a number"
    if prompt is not None and prompt.waits and state.phase in (Phase.RUNNING, Phase.STOPPING):
        number = prompt.number
        button("Done", lambda: _answer(frame, run_id, number), main=True, key=" ")
    if state.phase is Phase.PAUSED:
        button("Resume", resuming(frame, run_id), main=True, key="r")
    elif state.phase is Phase.RUNNING:
        button("Pause", lambda: frame.actions.pause(run_id), key="p")


def _after(frame: Frame, state: RigState, run: Run) -> None:
    """Buttons for a run that is not carried out."""
    if run.state in RESUMABLE and run.sequence and not state.is_tripped:
        button(f"Resume run {run.id}", resuming(frame, run.id), main=True, key="r")
    show(f'<a class="act" href="/page/results?run={run.id}">Results of run {run.id}</a>')


def reset_button(frame: Frame) -> None:
    """The button that resets a tripped tester."""

    async def reset() -> None:
        await frame.actions.drive(
            "acknowledge interlock", "rig", lambda runs, _, lease: runs.acknowledge_interlocks(lease)
        )

    button("I have removed the cause: reset", reset)


def resuming(frame: Frame, run_id: int) -> Callable[[], Awaitable[None]]:
    """What lets a run go on that is paused, was stopped or has failed, where no pause and no STOP came since now."""
    runs = frame.services.runs
    assert runs is not None, "the service drives a rig"
    pause, stop_epoch = runs.pause_number, runs.stop_epoch

    def go_on(runs: RunManager, caller: Caller, lease: int) -> None:
        runs.resume(run_id, caller.name, lease=lease, pause=pause, stop_epoch=stop_epoch)

    async def resume() -> None:
        await frame.actions.drive("resume run", f"run {run_id}", go_on)

    return resume


async def _answer(frame: Frame, run_id: int, number: int) -> None:
    await frame.actions.drive(
        "answer prompt", f"run {run_id}", lambda runs, _, lease: runs.answer(run_id, number, lease)
    )
