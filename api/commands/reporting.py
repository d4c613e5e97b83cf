"""`jointlab report`: one self-contained HTML file."""

from pathlib import Path
from typing import Annotated

import typer

from api.commands.identification import identified
from api.commands.identification_options import takes_options
from api.commands.terminal import open_catalogue, out, run_number
from jointlab.identification.options import AS_MEASURED, Options
from jointlab.report.gap import stored_gap_sections
from jointlab.report.page import write_report
from jointlab.report.section import Section


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("report")(report)


@takes_options
def report(
    target: Annotated[str, typer.Argument(metavar="BUNDLE|RUN", help="A bundle, or the number of a run.")],
    file: Annotated[Path, typer.Option("--output", "-o", help="Where to write it.")] = Path("report.html"),
    options: Options = AS_MEASURED,
) -> None:
    """Identify and write the report, with the paper's figures and tables for this bench.

    Where the run has been diagnosed (`jointlab gap diagnose`), the newest diagnosis comes first.
    """
    found, run = identified(target, options), run_number(target)
    gap: tuple[Section, ...] = ()
    if run is not None:
        with open_catalogue() as catalogue:
            gap = stored_gap_sections(catalogue, run)
    write_report(found, file, more=gap)
    out.print(f"{file} written")
