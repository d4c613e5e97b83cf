"""Trials of the gap diagnosis on cases whose truth is sealed."""

from pathlib import Path
from typing import Annotated

import typer

from api.commands.gap_structures import OTHER, TrialOptions, try_structure
from api.commands.terminal import out, progress_bar, write_json
from jointlab.errors import JointlabError
from jointlab.trials.run import TrialSettings, carry_out


def trial(
    seal: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where commitments, seals, answers and scores go.")
    ] = None,
    cases: Annotated[int, typer.Option(min=1, max=10_000, help="How many cases are drawn.")] = 40,
    seed: Annotated[int, typer.Option(min=0, help="Which cases are drawn.")] = 1,
    workers: Annotated[int | None, typer.Option(min=1, max=64, help="Processes that diagnose; 2 by default.")] = None,
    through_instruments: Annotated[
        bool,
        typer.Option(
            "--through-instruments", help="Measure --plain cases over the wires, not as files; takes minutes."
        ),
    ] = False,
    plain: Annotated[
        bool,
        typer.Option("--plain", help="Laws of the catalogue on the paper's bench, without nuisances: easier cases."),
    ] = False,
    stop: Annotated[
        bool, typer.Option("--stop", help="Diagnose no further cases: judge those that have been answered.")
    ] = False,
    publish: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the scores shown beside verdicts, trial_scores.json.")
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="MODULE:OBJECT", help="Try another structure, with this simulator.", rich_help_panel=OTHER
        ),
    ] = None,
    on: Annotated[
        Path | None, typer.Option(metavar="CURVES", help="Under the conditions of these curves.", rich_help_panel=OTHER)
    ] = None,
    reader: Annotated[
        str | None,
        typer.Option(metavar="MODULE:FUNCTION", help="Reads CURVES, if they are no CSV.", rich_help_panel=OTHER),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(metavar="MODULE:CLASS", help="An additional effect; may be repeated.", rich_help_panel=OTHER),
    ] = None,
) -> None:
    """Try the diagnosis on simulated cases whose truth is sealed until it has answered.

    Cases are drawn on three kinds of independent bench: single effects, two, three and five at once, none, and effects
    in no catalogue. Their laws are random functions, which no law of the catalogue is; every case has the nuisances of
    a real bench. A SHA-256 of every truth is written to DIR before the first diagnosis; workers are told of nothing but
    what was measured. A trial that was interrupted goes on when the same command is given again.

    With --model and --on, cases of another structure are drawn from the priors of its simulator, with inexact laws.
    """
    if (model is None) != (on is None) or ((reader or effect) and model is None):
        raise JointlabError("--model and --on belong together, and --reader and --effect to them")
    if model is not None and (seal or plain or through_instruments or stop or workers):
        raise JointlabError(
            "--seal, --plain, --through-instruments, --stop and --workers belong to a trial of the beam rig"
        )
    if model is not None and on is not None:
        try_structure(TrialOptions(on, model, reader, tuple(effect or ()), cases, seed, publish))
        return
    if seal is None:
        raise JointlabError("give --seal DIR for a trial of the beam rig, or --model with --on for another structure")
    scores = carry_out(
        TrialSettings(cases, seed, seal, workers or 2, plain, through_instruments), progress_bar, stop=stop
    )
    out.print((seal / "scores.md").read_text(encoding="utf-8"))
    out.print(f"{seal / 'scores.json'}, scores.md, reliability.svg and confusion.svg written")
    if publish is not None:
        published = {name: scores[name] for name in ("format", "cases", "versions", "verdicts")}
        write_json(published | {"seed": seed}, publish)
        out.print(f"{publish} written")
