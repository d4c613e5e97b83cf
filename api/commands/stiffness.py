"""`jointlab stiffness`: the fitted law at an amplitude and a frequency."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from api.commands.terminal import (
    bundle_with_notes,
    check_writable,
    open_catalogue,
    run_number,
    show_sections,
    write_json,
)
from jointlab.documents.stiffness import HIGHEST_FREQUENCY, LARGEST_AMPLITUDE
from jointlab.identification.direct import Direct
from jointlab.identification.law import laws_of, laws_of_points, points_of_run, stiffness_at
from jointlab.identification.law_document import stiffness_document
from jointlab.identification.load import measurement_of_bundle
from jointlab.report.stiffness import stiffness_section


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
    check_writable(json_file)
    laws, analysis = _laws(target)
    found = stiffness_at(laws, 1e-3 * amplitude, frequency, specimen or ())
    show_sections([stiffness_section(found)])
    if json_file is not None:
        write_json(stiffness_document(found, analysis).model_dump(mode="json"), json_file)


def _laws(target: str) -> tuple[Mapping[str, Direct], int | None]:
    """The laws of a bundle's or a run's points, and the number of the analysis that these are from."""
    run = run_number(target)
    if run is None:
        return laws_of(measurement_of_bundle(bundle_with_notes(target))), None
    with open_catalogue() as catalogue:
        analysis = points_of_run(catalogue, run)
        return laws_of_points(catalogue, run, analysis), analysis
