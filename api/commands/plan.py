"""`jointlab plan`: what a hammer test will tell, before it is made."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from api.commands.identification_options import option
from api.commands.sequences import named_sequence
from api.commands.terminal import out, write_json
from jointlab.planning.plan import ExpectedCylinder, plan_of
from jointlab.planning.report import expected_rows, plan_document, plan_sections
from jointlab.report.page import write_page
from jointlab.sequences import BUILT_IN


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("plan")(plan)


def plan(
    sequence: Annotated[str, typer.Argument(help=f"A sequence (YAML) with a hammer step, or {BUILT_IN!r}.")],
    shear: Annotated[float, typer.Option(min=1.0, help="Of one cylinder, as expected, N/m.")] = 0.4e6,
    compression: Annotated[float, typer.Option(min=1.0, help="Of one cylinder, as expected, N/m.")] = 2.5e6,
    rotation: Annotated[float, typer.Option(min=0.0, help="Of one cylinder, as expected, N m.")] = 20.0,
    loss_factor: Annotated[float, typer.Option(min=0.0, max=2.0, help="Of the elastomer.")] = 0.1,
    noise: Annotated[float, typer.Option(min=1e-9, help="Of an averaged accelerance, (m/s^2)/N.")] = 0.003,
    elements: Annotated[int | None, option("elements")] = None,
    file: Annotated[Path, typer.Option("--output", "-o", help="Where to write the page.")] = Path("plan.html"),
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the numbers to this file.")] = None,
) -> None:
    """Say which intervals a hammer test will leave, what would mend it, and how the bench lies to design studies."""
    cylinder = ExpectedCylinder(shear, compression, rotation, loss_factor)
    found = plan_of(named_sequence(sequence), cylinder, noise, elements)
    table = Table("joint", "element", "expected", "half-width of 95 %", box=None)
    for row in expected_rows(found):
        table.add_row(*row)
    out.print(table)
    for weak in found.expectation.weak_directions:
        out.print(weak.text)
    for remedy in found.remedies:
        out.print(f"  {remedy.text}")
    for joint in found.design.joints:
        out.print(
            f"joint {joint.name}: k-bar {joint.stiffness_ratio:.3g}, R {joint.aspect_ratio:.3g}, "
            f"theta {math.degrees(joint.inclination):.3g} degrees"
        )
    for text in found.design.statements:
        out.print(text, style="yellow")
    write_page(found.title, "Before the test.", plan_sections(found), file)
    if json_file is not None:
        write_json(plan_document(found), json_file)
    out.print(f"{file} written")
