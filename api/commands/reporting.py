"""`jointlab report`: one self-contained HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.modal.estimator import Estimator
from api.commands import choices
from api.commands.identification import identified
from api.commands.terminal import open_catalogue, out, run_number
from jointlab.report.gap import stored_gap_sections
from jointlab.report.page import write_report
from jointlab.report.section import Section


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("report")(report)


def report(
    target: Annotated[str, typer.Argument(metavar="BUNDLE|RUN", help="A bundle, or the number of a run.")],
    file: Annotated[Path, typer.Option("--output", "-o", help="Where to write it.")] = Path("report.html"),
    without: choices.Without = None,
    free_beam: choices.FreeBeam = None,
    elements: choices.Elements = None,
    joint_exponent: choices.JointExponent = 0.0,
    regularise: choices.Regularise = None,
    estimator: choices.AverageBy = Estimator.H1,
    force_window: choices.ForceWindow = None,
    exponential_window: choices.ExponentialWindow = None,
) -> None:
    """Identify and write the report, with the paper's figures and tables for this bench.

    Where the run has been diagnosed (`jointlab gap diagnose`), the newest diagnosis comes first.
    """
    options = choices.chosen(without, elements, joint_exponent, regularise, estimator, force_window, exponential_window)
    found, run = identified(target, options, free_beam), run_number(target)
    gap: tuple[Section, ...] = ()
    if run is not None:
        with open_catalogue() as catalogue:
            gap = stored_gap_sections(catalogue, run)
    write_report(found, file, more=gap)
    out.print(f"{file} written")
