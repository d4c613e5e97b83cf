"""`jointlab run` and `jointlab resume`: a sequence, on the configured instruments."""

import json
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from api.commands.interrupts import INTERRUPTED, steering_by_keys
from api.commands.terminal import LARGEST_RUN, open_catalogue, out, progress_console
from api.commands.terminal_operator import SequenceProgress, TerminalOperator
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import CarryOut, resume_run, run_sequence
from jointlab.sequences import BUILT_IN, NAMES, SUSPENDED, built_in
from jointlab.sequences.wording import step_text, total_text
from jointlab.settings import Settings, load_settings
from jointlab.supervision.stored_limits import stored_limits, with_stored_limits
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import Event, RunContinued, RunPaused, RunResumed, RunStarted, notify_all
from rig.instruments import Instruments
from rig.sequence import Sequence, load_sequence, sequence_from
from rig.steps import check_plan
from rig.tester_limits import TesterLimits
from store.audit import add_audit_entry
from store.catalogue import Catalogue
from store.database import is_made
from store.locks import rig_lock
from store.provenance import who_is_here
from store.runs import get_run

Reset = Annotated[
    bool, typer.Option("--reset", help="Reset the tester first: the cause of its trip is removed. Recorded.")
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
        typer.Option("--dry-run", help="Check against the limits in force and list the steps; move and store nothing."),
    ] = False,
    reset: Reset = False,
    schema: Annotated[  # noqa: ARG001 - its callback has shown it and left
        bool,
        typer.Option("--schema", is_eager=True, callback=show_schema, help="Print the JSON schema of a sequence."),
    ] = False,
) -> None:
    """Run a sequence on the configured instruments and store everything as one run.

    Ctrl-Z (Ctrl-Break on Windows) pauses it with the actuator at rest, and once more lets it go on. Ctrl-C stops it
    with the actuator at rest; what was measured is kept, and jointlab resume goes on.
    """
    document = named_sequence(sequence)
    settings = load_settings()
    if dry_run:
        list_steps(document, settings)
        return
    instruments = instruments_of(settings)
    with open_catalogue(settings) as catalogue, rig_lock(catalogue, settings.rig):
        instruments = with_stored_limits(instruments, catalogue)
        _carry_out(partial(run_sequence, document, reset=reset), instruments, catalogue, document)


def resume(
    number: Annotated[int, typer.Argument(metavar="RUN", min=1, max=LARGEST_RUN, help="Number of the run.")],
    reset: Reset = False,
) -> None:
    """Go on with a run that was stopped, failed or lost its process, at the next point that is not measured.

    Ctrl-Z (Ctrl-Break on Windows) pauses it and lets it go on, Ctrl-C stops it.
    """
    settings = load_settings()
    instruments = instruments_of(settings)
    with open_catalogue(settings) as catalogue, rig_lock(catalogue, settings.rig):
        instruments = with_stored_limits(instruments, catalogue)
        with catalogue.reading() as session:
            stored = get_run(session, number)
        document = sequence_from(stored.sequence, f"sequence of run {number}") if stored.sequence else None
        _carry_out(partial(resume_run, number, reset=reset), instruments, catalogue, document)


def _note(catalogue: Catalogue, progress: SequenceProgress, event: Event) -> None:
    """Write into the audit log, before anything moves, who moves it from the terminal."""
    match event:
        case RunStarted():
            action = "start run"
        case RunContinued() | RunResumed():
            action = "resume run"
        case RunPaused():
            action = "pause run"
        case _:
            return
    target = f"run {progress.run_id}"  # which hears of the event first
    with catalogue.writing() as session:
        add_audit_entry(session, who=who_is_here(), action=action, target=target, outcome="at the terminal")


def _carry_out(carry_out: CarryOut, instruments: Instruments, catalogue: Catalogue, document: Sequence | None) -> None:
    """Carry out a run that keys pause and stop, show its progress, and say how to go on with it."""
    control, operator = RunControl(), TerminalOperator(progress_console)
    with SequenceProgress(document, progress_console) as progress:
        observer = notify_all(progress, partial(_note, catalogue, progress))
        try:
            with steering_by_keys(control, progress_console):
                carry_out(instruments, catalogue, operator, observer, control)
        except (KeyboardInterrupt, RunStoppedError):
            _say_how_to_go_on(progress, "stopped")
            raise typer.Exit(INTERRUPTED) from None
        except Exception:
            _say_how_to_go_on(progress, "failed")
            raise
        out.print(f"run {progress.run_id} finished; jointlab identify {progress.run_id} evaluates it")


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
