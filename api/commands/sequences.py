"""`jointlab run`: a sequence, on the configured instruments."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated

import typer

from api.commands.terminal import instruments_of, open_catalogue, out, progress_console
from api.operator import SequenceProgress, TerminalOperator
from api.settings import load_settings
from rig.run import check_plan, run_sequence, sweep_plan
from rig.sequence import HammerStep, Sequence, load_sequence
from rig.tester_limits import TesterLimits

BUILT_IN = "paper"
SECONDS_A_BLOW = 6.0  # to strike, to ring out, to step to the next


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("run")(run)


def run(
    sequence: Annotated[str, typer.Argument(help=f"A sequence document (YAML), or {BUILT_IN!r} for the paper's.")],
    dry_run: Annotated[bool, typer.Option(help="Check and list the steps; connect to nothing.")] = False,
) -> None:
    """Run a sequence on the configured instruments and store everything as one run."""
    document = named_sequence(sequence)
    if dry_run:
        list_steps(document)
        return
    settings = load_settings()
    instruments = instruments_of(settings)
    operator = TerminalOperator(progress_console)
    with open_catalogue(settings) as catalogue, SequenceProgress(document, progress_console) as progress:
        number = run_sequence(document, instruments, catalogue, operator, progress)
    out.print(f"run {number} finished; jointlab identify {number} evaluates it")


def named_sequence(name: str) -> Sequence:
    """A sequence by file, or the built-in one by name.

    Raises:
        SequenceError: the document cannot be run as it stands.
    """
    if name != BUILT_IN:
        return load_sequence(Path(name))
    with resources.as_file(resources.files("api.sequences") / "paper.yaml") as path:
        return load_sequence(path)


def list_steps(sequence: Sequence) -> None:
    """Say what a sequence would do, how long it takes about, and within which limits.

    Raises:
        RigError: a step makes no sense, or is beyond the rig's limits.
    """
    limits = TesterLimits()
    check_plan(sequence, limits)
    out.print(f"{sequence.title} ({sequence.article_name})")
    for number, step in enumerate(sequence.steps, start=1):
        if isinstance(step, HammerStep):
            blows = len(step.points) * step.blows
            out.print(
                f"{number}. hammer: {step.blows} blows at each of {', '.join(step.points)} "
                f"({blows} blows, about {blows * SECONDS_A_BLOW / 60:.0f} min)"
            )
            continue
        plan = sweep_plan(step)
        seconds = sum(plan.record_duration(frequency, 0.0, 1.0) for _, frequency in plan.sines())
        seconds *= len(plan.specimens) * len(plan.configurations)
        amplitudes = ", ".join(f"{amplitude:g}" for amplitude in step.amplitudes_pp_mm)
        out.print(
            f"{number}. sweep: {plan.points} sine points, {step.frequencies.first:g} to {step.frequencies.last:g} Hz, "
            f"{amplitudes} mm p-p, preset {step.preset_mm:g} mm, "
            f"{', '.join(step.configurations)} of {', '.join(step.specimens)} "
            f"(records alone {seconds / 60:.0f} min)"
        )
        out.print(
            f"   limits of the rig: {1e3 * limits.amplitude_pp:g} mm p-p, preset {1e3 * limits.lowest_preset:g} to "
            f"{1e3 * limits.highest_preset:g} mm, {limits.lowest_frequency:g} to {limits.highest_frequency:g} Hz"
        )
