"""`jointlab report`: one self-contained HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.commands.identification import FreeBeam, Without, identified
from api.commands.terminal import out
from api.report.page import write_report


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("report")(report)


def report(
    target: Annotated[str, typer.Argument(metavar="BUNDLE|RUN", help="A bundle, or the number of a run.")],
    file: Annotated[Path, typer.Option("--output", "-o", help="Where to write it.")] = Path("report.html"),
    without: Without = None,
    free_beam: FreeBeam = None,
) -> None:
    """Identify and write the report, with the paper's figures and tables for this bench."""
    found = identified(target, without or (), free_beam)
    write_report(found, file)
    out.print(f"{file} written")
