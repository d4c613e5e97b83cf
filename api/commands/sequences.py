"""`jointlab run` and `jointlab resume`: a sequence, on the configured instruments."""

import json
import math
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from api.commands.following import RunFollower
from api.commands.interrupts import INTERRUPTED, steering_by_keys
from api.commands.terminal import LARGEST_RUN, open_catalogue, out, progress_console
from api.commands.terminal_operator import SequenceProgress, TerminalOperator
from jointlab.commissioning.warnings import changes, latest_examination, warnings_of
from jointlab.commissioning.wording import BY_EXAMINATION, warning_text
from jointlab.drive.phase import Phase
from jointlab.errors import JointlabError, exit_code
from jointlab.instruments import instruments_of
from jointlab.sequences import BUILT_IN, NAMES, SUSPENDED, built_in, sequence_of
from jointlab.sequences.wording import step_text, total_text
from jointlab.settings import Settings, load_settings
from jointlab.supervision.manager import RunManager
from jointlab.supervision.stored_limits import stored_limits
from jointlab.trials.simulated_operator import operator_at
from rig.errors import RunStoppedError
from rig.events import Event, RunContinued, RunStarted, notify_all
from rig.instruments import NOT_DRIVEN
from rig.sequences.sequence import Sequence
from rig.sequences.sequence_file import load_sequence
from rig.sequences.steps import check_plan, shortcomings
from rig.tester.limits import TesterLimits
from rig.tester.missing_functions import lack_text
from store.catalogue import Catalogue
from store.database.connection import is_made
from store.errors import StoreError
from store.measurements.instruments import list_instruments
from store.measurements.runs import get_run
from store.provenance import who_is_here
from store.service.audit import add_audit_entry

Reset = Annotated[
    bool, typer.Option("--reset", help="Reset the tester first: the cause of its trip is removed. Recorded.")
]
Automatic = Annotated[
    bool | None,
    typer.Option(
        "--automatic/--no-automatic",
        help="Let a simulated bench strike and mount without prompts; by default where one is configured, and in a "
        "resumed run as in the part before.",
        show_default=False,
    ),
]


def show_schema(wanted: bool) -> None:
    """Print the JSON schema of a sequence and exit."""
    if wanted:
        typer.echo(json.dumps(Sequence.model_json_schema(), indent=2))
        raise typer.Exit


def run(
    sequence: Annotated[str, typer.Argument(help=f"A sequence (YAML), or one of ours: {BUILT_IN}, {SUSPENDED}.")],
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Check limits and instruments, and list the steps; move and store nothing."),
    ] = False,
    automatic: Automatic = None,
    reset: Reset = False,
    schema: Annotated[  # noqa: ARG001 - its callback has shown it and left
        bool, typer.Option("--schema", is_eager=True, callback=show_schema, help="Print the JSON schema of a sequence.")
    ] = False,
) -> None:
    """Run a sequence on the configured instruments and store everything as one run.

    Ctrl-Z (Ctrl-Break on Windows) pauses it, and once more lets it go on. Ctrl-C stops it; what was measured is kept,
    and jointlab resume goes on. An actuator that the run drives is at rest with both.
    """
    document = named_sequence(sequence)
    settings = load_settings()
    check_automatic(settings, automatic)
    if dry_run:
        list_steps(document, settings)
        _check_readiness(document, settings)
        return
    with open_catalogue(settings) as catalogue:

        def begin(rig: RunManager) -> int:
            return rig.run(document, who_is_here(), automatic=automatic, reset=reset)

        carry_out(settings, catalogue, document, begin)


def resume(
    number: Annotated[int, typer.Argument(metavar="RUN", min=1, max=LARGEST_RUN, help="Number of the run.")],
    automatic: Automatic = None,
    reset: Reset = False,
) -> None:
    """Go on with a run that was stopped, failed or lost its process, at the next point that is not measured.

    Ctrl-Z (Ctrl-Break on Windows) pauses it and lets it go on, Ctrl-C stops it.
    """
    settings = load_settings()
    check_automatic(settings, automatic)
    with open_catalogue(settings) as catalogue:
        stored = catalogue.read(get_run, number)
        document = sequence_of(stored)

        def go_on(rig: RunManager) -> int:
            rig.resume(number, who_is_here(), automatic=automatic, reset=reset)
            return number

        carry_out(settings, catalogue, document, go_on)


def check_automatic(settings: Settings, automatic: bool | None) -> None:
    """Raise JointlabError where the bench is to strike by itself and is not simulated."""
    if automatic and settings.simulated_operator is None:
        raise JointlabError(
            "--automatic: only a simulated bench strikes and mounts by itself, and none is configured here; the file "
            "of jointlab simulate --config has one (simulated_operator)"
        )


def _note_begin(catalogue: Catalogue, progress: SequenceProgress, event: Event) -> None:
    """Write into the audit log, before anything moves, who begins or continues a run from the terminal."""
    match event:
        case RunStarted():
            _note(catalogue, "start run", progress.run_id)  # which hears of the event first
        case RunContinued():
            _note(catalogue, "resume run", progress.run_id)


def _note(catalogue: Catalogue, action: str, run_id: int | None) -> None:
    with catalogue.writing() as session:
        add_audit_entry(session, who=who_is_here(), action=action, target=f"run {run_id}", outcome="at the terminal")


class Keys:
    """What keys do with the present run."""

    def __init__(self, rig: RunManager, catalogue: Catalogue) -> None:
        self._rig, self._catalogue = rig, catalogue
        self._held: int | None = None  # number of the pause

    def pause(self) -> None:
        """Pause it, with the actuator at rest."""
        try:
            self._held = self._rig.pause(self._run())
        finally:  # a database must not delay the actuator's rest, nor hide that it is not confirmed
            try:
                _note(self._catalogue, "pause run", self._run())
            except StoreError as error:
                progress_console.print(f"the pause is not in the audit log: {error}", style="red")

    def resume(self) -> None:
        """Let it go on."""
        _note(self._catalogue, "resume run", self._run())
        held, self._held = self._held, None
        self._rig.resume(self._run(), who_is_here(), pause=held)

    def stop(self) -> None:
        """End it, with the actuator at rest."""
        self._rig.end_run(self._run(), who_is_here())

    def is_paused(self) -> bool:
        """Whether it is paused, by a key and by nobody else since."""
        return self._held is not None and self._held == self._rig.pause_number

    def is_interrupted(self) -> bool:
        """Whether it is paused, is being ended or has ended."""
        return self._rig.state.phase not in (Phase.STARTING, Phase.RUNNING)

    def _run(self) -> int:
        return self._rig.state.run_id or 0  # none has that number


def carry_out(
    settings: Settings, catalogue: Catalogue, document: Sequence | None, begin: Callable[[RunManager], int]
) -> int:
    """Carry out a run that keys pause and stop, show its progress, and say how to go on with it; its number."""
    with (
        operator_at(settings.simulated_operator) as simulated,
        closing(RunManager(catalogue, settings, simulated, name="jointlab run")) as rig,
        SequenceProgress(document, progress_console) as progress,
    ):
        rig.lease.take(who_is_here(), "terminal", lasts=math.inf)  # until this program ends
        keys = Keys(rig, catalogue)
        observer = notify_all(progress, partial(_note_begin, catalogue, progress))
        try:
            with steering_by_keys(keys, progress_console):
                follower = RunFollower(rig, observer, progress_console)
                run_id = begin(rig)
                _warn(catalogue, settings, rig, run_id)
                follower.follow(run_id, TerminalOperator(progress_console, follower.look))
            rig.wait()
            rig.check_outcome()
        except (KeyboardInterrupt, RunStoppedError):
            _say_how_to_go_on(progress, "stopped")
            raise typer.Exit(INTERRUPTED) from None
        except Exception:
            _say_how_to_go_on(progress, "failed")
            raise
        left_out = f", {rig.state.reason}" if rig.state.reason else ""
        out.print(f"run {progress.run_id} finished{left_out}; jointlab identify {progress.run_id} evaluates it")
        return run_id


def _warn(catalogue: Catalogue, settings: Settings, rig: RunManager, run_id: int) -> None:
    """Say why the rig should have been examined before this run."""
    examination = latest_examination(catalogue, settings.rig)
    found = warnings_of(examination, rig.instruments.channels, settings.commissioning.valid_days)
    if examination is not None:
        with catalogue.reading() as session:
            found += changes(examination, list_instruments(session, run_id))
    for warning in found:
        command = "; jointlab doctor examines it" if warning.kind in BY_EXAMINATION else ""
        progress_console.print(f"warning: {warning_text(warning)}{command}", style="yellow")


def _say_how_to_go_on(progress: SequenceProgress, ended: str) -> None:
    if progress.run_id is not None:
        progress_console.print(f"run {progress.run_id} {ended}; jointlab resume {progress.run_id} goes on with it")


def named_sequence(name: str) -> Sequence:
    """A sequence by file, or the built-in one by name.

    Raises:
        SequenceError: the document cannot be run as it stands.
    """
    return built_in(name) if name in NAMES else load_sequence(Path(name))


def list_steps(sequence: Sequence, settings: Settings) -> None:
    """Print the steps of a sequence, about how long they take, and the limits in force.

    Raises:
        RigError: a step makes no sense, or is beyond the limits in force at the rig.
        StoreError: there is a database, and it cannot be read.
    """
    stored = _stored_limits(settings)
    limits = stored or TesterLimits()
    check_plan(sequence, limits)
    out.print(f"{sequence.title} ({sequence.article_name})")
    for number, step in enumerate(sequence.steps, start=1):
        out.print(f"{number}. {step_text(step)}", markup=False)
    out.print(total_text(sequence.steps))
    if sequence.sine_steps:
        whose = "no others are set" if stored is None else f"set for {settings.rig!r}"
        out.print(f"{_limits_line(limits)} ({whose})")


def _check_readiness(sequence: Sequence, settings: Settings) -> None:
    """Say what keeps the sequence from being run on the configured instruments now, and exit with the code for that."""
    if not settings.channels:
        out.print("no instruments are configured here: write [[channels]] into jointlab.toml")
        return
    instruments = instruments_of(settings)
    if sequence.sine_steps and instruments.is_external:
        out.print(f"{NOT_DRIVEN}: its state, limits and interlocks are not checked; look at its own display")
    for lack in sorted(instruments.tester_map.lacks if sequence.sine_steps else ()):
        out.print(f"the tester ({instruments.tester_map.name}) has {lack_text(lack)}", markup=False)
    found = shortcomings(sequence, instruments)
    for error in found:
        out.print(f"not ready: {error}", style="red", markup=False)
    if found:
        raise typer.Exit(exit_code(found[0]))


def _stored_limits(settings: Settings) -> TesterLimits | None:
    """The limits that were set for the rig; None where there is no database yet, and none is made."""
    if not is_made(settings.database_url):
        return None
    with open_catalogue(settings) as catalogue:
        return stored_limits(catalogue, settings.rig)


def _limits_line(limits: TesterLimits) -> str:
    return (
        f"limits of the rig: {1e3 * limits.amplitude_pp:g} mm p-p, preset {1e3 * limits.lowest_preset:g} to "
        f"{1e3 * limits.highest_preset:g} mm, {limits.lowest_frequency:g} to {limits.highest_frequency:g} Hz, "
        f"{limits.velocity:g} m/s, {limits.acceleration:g} m/s^2, {limits.force:g} N"
    )
