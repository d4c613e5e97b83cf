"""From a sequence to a run: the steps that it would do, or why it cannot be measured, and the start of it."""

from collections.abc import Callable
from html import escape

from nicegui import ui

from api.page.frame import Frame
from api.page.instruments.examinations import warnings_text
from api.page.markup import show
from api.service.access import Caller
from api.service.context import Services
from jointlab.commissioning.warnings import latest_examination
from jointlab.errors import EXPECTED
from jointlab.sequences.wording import step_text
from jointlab.supervision.manager import RunManager
from rig.sequences.sequence import HammerStep, Sequence, SequenceError, SineStep
from rig.sequences.steps import check_channels, check_plan
from rig.tester.limits import TesterLimits

Made = Callable[[], Sequence]
"""Makes a sequence of what a person has written. Raises one of `EXPECTED` where that is none."""


def limits_of(services: Services) -> TesterLimits:
    """The limits of the rig, or usual ones where the service drives none."""
    return TesterLimits() if services.runs is None else services.runs.instruments.limits


async def show_warnings(frame: Frame) -> None:
    """Warnings about the rig before a run, as those of `jointlab run`."""

    def warned() -> str:
        runs = frame.services.runs
        return (
            ""
            if runs is None
            else warnings_text(runs, latest_examination(frame.services.catalogue, runs.instruments.rig))
        )

    if warnings := await frame.read(warned):
        show(warnings + '<p><a href="/page/instruments">Examine the rig</a></p>')


def outlook(services: Services, made: Made) -> tuple[Sequence | None, str]:
    """The sequence, if it can be measured, and as markup its steps in order, or why it cannot be measured."""
    try:
        sequence = made()
        check_plan(sequence, limits_of(services))
        if services.runs is not None:
            check_channels(sequence, services.runs.instruments)
    except SequenceError as error:
        faults = "".join(f"<li>{escape(fault)}</li>" for fault in error.faults or (str(error),))
        return None, f'<ul class="notice faults">{faults}</ul>'
    except EXPECTED as error:
        return None, f'<p class="notice">{escape(str(error))}</p>'
    steps = "".join(f"<li>{escape(step_text(step))}</li>" for step in sequence.steps)
    return sequence, f'<ol id="steps">{steps}</ol>'


def automatic_choice(frame: Frame) -> ui.checkbox:
    """The choice whether a simulated bench strikes and mounts by itself; hidden where there is none."""
    choice = ui.checkbox("Let the simulated bench strike and mount by itself", value=True)
    runs = frame.services.runs
    choice.set_visibility(runs is not None and runs.has_automatic_operator)
    return choice


async def start(frame: Frame, made: Made, *, automatic: bool) -> None:
    """Plan a run of the sequence, start it, and show it."""
    sequences = list[Sequence]()
    stop_epoch = (
        None if frame.services.runs is None else frame.services.runs.stop_epoch
    )  # before anything is waited for

    def plan(runs: RunManager, caller: Caller, _lease: int) -> int:
        sequences.append(made())
        return runs.plan(sequences[-1], caller.name)

    run_id = await frame.actions.drive("create run", "new run", plan)
    if run_id is None:
        return

    def begin(runs: RunManager, caller: Caller, lease: int) -> int:
        runs.start(run_id, caller.name, automatic=automatic, lease=lease, stop_epoch=stop_epoch)
        return run_id

    if await frame.actions.drive("start run", f"run {run_id}", begin) is not None:
        ui.navigate.to(_live_view(sequences[-1]))


def _live_view(sequence: Sequence) -> str:
    """The view of the step that measures first; NiceGUI puts /page before it."""
    strikes = next((step.step == "hammer" for step in sequence.steps if isinstance(step, HammerStep | SineStep)), False)
    return "/hammer" if strikes else "/sweep"
