"""`jointlab plan`: which intervals to expect from a hammer test, before it is made."""

from pathlib import Path
from typing import Annotated

import typer

from api.commands.identification_options import option
from api.commands.sequences import named_sequence
from api.commands.terminal import check_writable, out, show_sections, write_json
from jointlab.planning.plan import ExpectedCylinder, plan_of
from jointlab.planning.report import plan_document, plan_sections
from jointlab.report.page import write_page
from jointlab.sequences import BUILT_IN, NAMES


def plan(
    sequence: Annotated[str, typer.Argument(help=f"A sequence (YAML) with a hammer step, or {BUILT_IN!r}.")],
    shear: Annotated[float, typer.Option(min=1.0, help="Of one cylinder, as expected, N/m.")] = 0.4e6,
    compression: Annotated[float, typer.Option(min=1.0, help="Of one cylinder, as expected, N/m.")] = 2.5e6,
    rotation: Annotated[float, typer.Option(min=0.0, help="Of one cylinder, as expected, N m.")] = 20.0,
    loss_factor: Annotated[float, typer.Option(min=0.0, max=2.0, help="Of the elastomer.")] = 0.1,
    noise: Annotated[float, typer.Option(min=1e-9, max=1e3, help="Of an averaged accelerance, (m/s^2)/N.")] = 0.003,
    elements: Annotated[int | None, option("elements")] = None,
    file: Annotated[Path, typer.Option("--output", "-o", help="Where to write the page.")] = Path("plan.html"),
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the numbers to this file.")] = None,
) -> None:
    """Say which intervals a hammer test will leave, what would improve it, and what design studies say."""
    check_writable(file, json_file, read=(None if sequence in NAMES else Path(sequence),))
    cylinder = ExpectedCylinder(shear, compression, rotation, loss_factor)
    found = plan_of(named_sequence(sequence), cylinder, noise, elements)
    sections = plan_sections(found)
    show_sections(sections)
    write_page(found.title, "Before the test.", sections, file)
    if json_file is not None:
        write_json(plan_document(found), json_file)
    out.print(f"{file} written")
