"""`jointlab stiffness`: what the fitted law says at an amplitude and a frequency."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from analysis.direct.cylinder_terms import JointLaw
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.specimen_scatter import Scatter, SpecimenScatter
from analysis.interval import Estimate
from api.commands.terminal import check_writable, open_catalogue, out, run_number, write_json
from jointlab.documents.stiffness import HIGHEST_FREQUENCY, LARGEST_AMPLITUDE
from jointlab.identification.law import StiffnessAt, laws_of, laws_of_points, points_of_run, stiffness_at
from jointlab.identification.law_document import stiffness_document
from jointlab.identification.load import measurement_of_bundle
from jointlab.report.section import number
from store.bundle import read_bundle

KILO = 1e3


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("stiffness")(stiffness)


def stiffness(
    target: Annotated[str, typer.Argument(metavar="BUNDLE|RUN", help="A bundle, or a run that was identified.")],
    amplitude: Annotated[
        float, typer.Option(min=1e-6, max=LARGEST_AMPLITUDE, help="Of the cylinder's motion, peak to peak, mm.")
    ],
    frequency: Annotated[float, typer.Option(min=1e-3, max=HIGHEST_FREQUENCY, help="Hz.")],
    specimen: Annotated[
        list[str] | None, typer.Option(help="Only this joint's cylinders; may be repeated. By default all.")
    ] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the answer to this file.")] = None,
) -> None:
    """Say k, h and gamma at an amplitude and frequency that need not have been measured.

    A law is fitted to the sine points of each joint's cylinders: Kraus's amplitude dependence times a fractional Zener
    model, and what the specimen does beyond it. Intervals hold 95 %, and open where points are far; outside of what was
    measured the answer says so. With several specimens it tells where another one of their kind lies.

    For example: jointlab stiffness 3 --amplitude 0.03 --frequency 80
    """
    if json_file is not None:
        check_writable(json_file)
    laws, analysis = _laws(target)
    found = stiffness_at(laws, 1e-3 * amplitude, frequency, specimen or ())
    _show(found)
    if json_file is not None:
        write_json(stiffness_document(found, analysis).model_dump(mode="json"), json_file)


def _laws(target: str) -> tuple[Mapping[str, JointLaw], int | None]:
    """The laws of a bundle's or a run's points, and the number of the analysis that these are from."""
    run = run_number(target)
    if run is None:
        return laws_of(measurement_of_bundle(read_bundle(Path(target)))), None
    with open_catalogue() as catalogue:
        analysis = points_of_run(catalogue, run)
        return laws_of_points(catalogue, run, analysis), analysis


def _show(found: StiffnessAt) -> None:
    out.print(f"At {1e3 * found.amplitude_pp:g} mm peak to peak and {found.frequency:g} Hz, k and h in kN/m; a is the")
    out.print("shear, b the compressive stiffness of one cylinder, k11, k22, k12 are of the joint:")
    table = Table("joint", "term", "k", "95 %", "h", "95 %", "gamma", "95 %", box=None)
    for each in found.specimens:
        terms: dict[str, DynamicStiffness] = {
            "a": each.cylinder.shear,
            "b": each.cylinder.compression,
            "k11": each.joint.k11,
            "k22": each.joint.k22,
            "k12": each.joint.k12,
        }
        for name, term in terms.items():
            stiffness, damping = term.stiffness_estimate, term.damping_estimate
            cells = [_cells(stiffness, KILO), _cells(damping, KILO), _cells(term.loss_factor_estimate)]
            table.add_row(each.specimen, name, *(cell for pair in cells for cell in pair))
    out.print(table)
    for each in found.specimens:
        for phrase in each.beyond:
            out.print(f"extrapolated, joint {each.specimen}: {phrase}", style="yellow")
    if found.scatter is None:
        out.print("one specimen alone does not show where another one of its kind lies")
    else:
        _show_scatter(found.scatter)


def _show_scatter(scatter: SpecimenScatter) -> None:
    out.print(f"Where a single specimen lies, if {', '.join(scatter.specimens)} are of one kind:")
    table = Table("term", "", "mean", "between specimens", "a single one, 95 %", box=None)
    rows: tuple[tuple[str, str, Scatter, float], ...] = (
        ("a", "k", scatter.shear, KILO),
        ("a", "h", scatter.shear_damping, KILO),
        ("a", "gamma", scatter.shear_loss_factor, 1.0),
        ("b", "k", scatter.compression, KILO),
        ("b", "h", scatter.compression_damping, KILO),
        ("b", "gamma", scatter.compression_loss_factor, 1.0),
    )
    for term, quantity, each, unit in rows:
        mean, _ = _cells(each.mean, unit)
        _, single = _cells(each.next_specimen, unit)
        table.add_row(term, quantity, mean, number(each.deviation / unit), single)
    out.print(table)


def _cells(estimate: Estimate, unit: float = 1.0) -> tuple[str, str]:
    """A value, and its 95 % interval."""
    low, high = estimate.interval()
    return number(estimate.value / unit, 4), f"{number(low / unit)} .. {number(high / unit)}"
