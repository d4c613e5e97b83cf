"""The technician at a terminal, and the progress of a sequence as bars."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from functools import partial

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from analysis.dof import Dof
from api.commands.console import PlainConsole, visible
from api.commands.enter import discard_keys, is_enter_pressed
from jointlab.drive.events import BlowWithdrawn
from rig.errors import RequestError
from rig.events import (
    ActuatorShutDown,
    BlowAccepted,
    BlowInconsistent,
    BlowMissed,
    BlowRefused,
    Event,
    HammerStarted,
    InterlockReset,
    InterlockTripped,
    MotionSeen,
    PointStarted,
    RateCoerced,
    RestUnknown,
    RunContinued,
    RunStarted,
    SinePointMeasured,
    SinePointRefused,
    SoakEnded,
    SoakStarted,
    SpecimenMounted,
    TesterLineLost,
    WaitStarted,
)
from rig.operator import Operator, loading_text, mounting_text, points_text
from rig.sequences.sequence import Sequence as RigSequence
from rig.tester.status import last_resort, stopping_text

PAUSE = 0.05  # s between two looks for Enter


class TerminalOperator(Operator):
    """Prompts a person: strikes are announced, mounting and tasks are confirmed with Enter.

    Args:
        look: is called again and again while a person is waited for, and returns after a moment; it may show what
            happens, and raise where nothing is to be waited for any more. The prompt is shown again after other texts.
    """

    def __init__(self, console: PlainConsole, look: Callable[[], object] | None = None) -> None:
        self._console = console
        self._look = look or partial(time.sleep, PAUSE)

    def strike(self, point: Dof, blow: int) -> None:
        """Ask for a blow; the trigger waits for it."""
        self._console.print(f"strike {point} now (blow {blow})")

    def mount(self, specimen: str, configuration: str) -> None:
        """Ask for the cylinders, and wait until they are mounted; RequestError where there is no terminal."""
        self._confirm(f"mount {mounting_text(specimen, configuration)}", "step back, then press Enter")

    def run_points(self, preset: float, points: Sequence[tuple[float, float]]) -> None:
        """Ask for points of the machine's own software; the recorder waits for them."""
        self._console.print(f"let the machine's own software run {points_text(preset, points)}", markup=False)

    def do_task(self, text: str) -> None:
        """Ask for the task `text`, and wait until it is done; RequestError where there is no terminal."""
        self._confirm(text, "then press Enter")

    def _confirm(self, request: str, then: str) -> None:
        if not sys.stdin.isatty():
            raise RequestError(f"{request}: there is no terminal to confirm it on; run the sequence from a terminal")
        discard_keys()
        shown = -1
        try:
            while not is_enter_pressed():
                if self._console.texts != shown:
                    self._console.print(f"{request}, {then}")
                    shown = self._console.texts
                self._look()
        except EOFError as error:
            raise RequestError(f"{request}: the terminal was closed") from error


class SequenceProgress:
    """An observer that shows a sequence as two bars, and everything unusual as lines. A context manager.

    Attributes:
        run_id: number of the run, None before it has begun.
    """

    def __init__(self, sequence: RigSequence | None, console: Console) -> None:
        self.run_id: int | None = None
        self._console = console
        self._bars = Progress(
            TextColumn("{task.description:<34}"),
            BarColumn(bar_width=32),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        blows = sum(len(step.points) * step.blows for step in sequence.hammer_steps) if sequence else 0
        sines = sum(step.points for step, _ in sequence.sine_steps) if sequence else 0
        self._blows = self._bars.add_task("blows", total=blows) if blows else None
        self._sines = self._bars.add_task("sine points", total=sines) if sines else None

    def __enter__(self) -> SequenceProgress:
        self._bars.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bars.stop()

    def __call__(self, event: Event) -> None:
        """Show `event`."""
        match event:
            case RunStarted(run_id):
                self.run_id = run_id
                self._say(f"run {run_id}")
            case RunContinued(run_id, blows, sines):
                self.run_id = run_id
                self._say(f"run {run_id} goes on after {blows} blows and {sines} sine points")
                self._advance(self._blows, blows)
                self._advance(self._sines, sines)
            case WaitStarted(seconds):
                self._say(f"waiting for {seconds:g} s")
            case SoakStarted(band, seconds, limit):
                self._say(f"waiting for {seconds:g} s within {band:g} K, at most {limit:g} s")
            case SoakEnded(celsius, waited):
                self._say(f"the temperature settled at {celsius:.2f} C after {waited:.0f} s")
            case HammerStarted(set_number, peak_force):
                self._say(f"hammer set {set_number}: blows of about {peak_force:g} N")
            case PointStarted(point, index, points):
                self._describe(self._blows, f"blows at {point} ({index} of {points})")
            case BlowAccepted():
                self._advance(self._blows)
            case BlowRefused(point, blow, reason):
                self._say(f"blow {blow} at {point} refused: {reason}")
            case BlowInconsistent(point, blow, reason):
                self._say(f"blow {blow} at {point} left out: {reason}; strike one more")
                self._advance(self._blows, -1)
            case BlowWithdrawn(run_id, point, blow, reason) if run_id == self.run_id:
                self._say(f"blow {blow} at {point} withdrawn: {reason}")
                self._advance(self._blows, -1)
            case BlowMissed(point, blow, waited):
                self._say(f"blow {blow} at {point}: nobody struck within {waited:g} s")
            case SpecimenMounted(specimen, configuration):
                self._describe(self._sines, f"sine points, {specimen} {loading_text(configuration)}")
            case SinePointMeasured():
                self._advance(self._sines)
            case MotionSeen(frequency, amplitude, verdict):
                self._describe(self._sines, f"{frequency:g} Hz, {amplitude:g} mm: {verdict}")
            case SinePointRefused(specimen, configuration, amplitude, frequency, reason):
                self._say(f"{specimen} {loading_text(configuration)}, {amplitude:g} mm at {frequency:g} Hz: {reason}")
            case InterlockTripped(interlocks, stopped=True):
                self._say(f"the tester has stopped the actuator: {stopping_text(interlocks)}")
            case InterlockTripped(interlocks):
                self._say(f"an interlock of the tester has fired, which did not stop it: {stopping_text(interlocks)}")
            case TesterLineLost(stops_within):
                self._say(f"line to the tester lost; {last_resort(stops_within)}. Keep away from the machine")
            case ActuatorShutDown(reason):
                self._say(f"the program has shut the tester down: {reason}. Keep away from the machine")
            case RestUnknown(reason):
                self._say(f"{reason}. Keep away from the machine")
            case InterlockReset(interlocks):
                self._say(f"the tester was reset after {stopping_text(interlocks)}")
            case RateCoerced(requested, used):
                self._say(f"sampling at {used:g} Hz instead of {requested:g} Hz, as the instrument can")
            case _:
                pass

    def _say(self, text: str) -> None:
        self._console.print(text, markup=False)

    def _describe(self, task: TaskID | None, text: str) -> None:
        if task is not None:
            self._bars.update(task, description=visible(text))

    def _advance(self, task: TaskID | None, steps: int = 1) -> None:
        if task is not None:
            self._bars.advance(task, steps)
