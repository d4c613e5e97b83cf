"""`jointlab identify` and `jointlab modes`: results from what was measured."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from analysis.frequency_response import FrequencyResponses
from analysis.interval import Estimate
from analysis.modal.estimation import ModalEstimate, estimate_modes
from api.commands.identification_options import takes_options
from api.commands.progress_bars import on_terminal
from api.commands.terminal import (
    check_writable,
    open_catalogue,
    out,
    progress_console,
    run_number,
    write_json,
)
from jointlab.identification.document import identification_document, modes_document, plain
from jointlab.identification.load import measurement_of_bundle, with_free_beam
from jointlab.identification.measurement import dof
from jointlab.identification.options import AS_MEASURED, Options
from jointlab.identification.pipeline import Identification, identify
from jointlab.identification.run import identify_and_save
from jointlab.identification.statements import fit_statements, regularisation_statements
from jointlab.identification.suspended import SuspendedBeam
from store.accelerance_file import read_accelerances
from store.bundle import read_bundle


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command("identify")(identify_)
    app.command("modes")(modes)


@takes_options
def identify_(
    target: Annotated[str, typer.Argument(metavar="BUNDLE|RUN", help="A bundle, or the number of a run.")],
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the whole result to this file.")] = None,
    options: Options = AS_MEASURED,
) -> None:
    """Identify k, h and gamma by both methods and compare them.

    Results of a run are stored beside older ones; those of a bundle are only shown (import it first to store them).
    """
    if json_file is not None:
        check_writable(json_file)
    found = identified(target, options)
    show(found)
    if json_file is not None:
        write_json(identification_document(found), json_file)


def modes(
    file: Annotated[Path, typer.Argument(help="UFF file with accelerances (dataset 58 or 58b, function type 4).")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Estimate natural frequencies, loss factors and shapes; poles are chosen by themselves."""
    read = read_accelerances(file)
    estimate = estimate_modes(
        FrequencyResponses(
            frequency=read.frequency,
            accelerance=read.accelerance,
            response=dof(read.response),
            inputs=tuple(dof(point) for point in read.inputs),
            coherence=read.coherence,
        )
    )
    if as_json:
        out.print_json(json.dumps(plain(modes_document(estimate))))
    else:
        out.print(modes_table(estimate))


def identified(target: str, options: Options = AS_MEASURED) -> Identification:
    """Identify a bundle, or a run; a run's results are stored.

    Raises:
        StoreError, AnalysisError, JointlabError: there is no such thing, or nothing can be identified from it.
    """
    run, progress = run_number(target), on_terminal(progress_console)
    if run is not None:
        with open_catalogue() as catalogue:
            return identify_and_save(catalogue, run, options, progress)
    measurement = measurement_of_bundle(read_bundle(Path(target)), options)
    if options.free_beam is not None:
        with open_catalogue() as catalogue:
            measurement = with_free_beam(measurement, catalogue, options, progress)
    return identify(measurement, options)


def modes_table(estimate: ModalEstimate) -> Table:
    """Modes as a table for people."""
    table = Table("mode", "frequency (Hz)", "95 %", "loss factor", "95 %", box=None)
    rows = zip(
        estimate.modes.frequency,
        estimate.frequency_ci95,
        estimate.modes.loss_factor,
        estimate.loss_factor_ci95,
        strict=True,
    )
    for number, (frequency, frequency_ends, loss_factor, loss_ends) in enumerate(rows, start=1):
        table.add_row(
            str(number),
            f"{frequency:.3f}",
            f"{frequency_ends[0]:.3f} .. {frequency_ends[1]:.3f}",
            f"{loss_factor:.5f}",
            f"{loss_ends[0]:.5f} .. {loss_ends[1]:.5f}",
        )
    return table


def _free_beam_table(suspended: SuspendedBeam) -> Table:
    table = Table("mode", "frequency (Hz)", "95 %", "Timoshenko", "updated", "damping ratio", "95 %", box=None)
    for row in suspended.result.table:
        frequency, damping = _value_and_interval(row.experiment, 3), _value_and_interval(row.damping_ratio, 5)
        table.add_row(str(row.mode), *frequency, f"{row.timoshenko:.3f}", f"{row.updated:.3f}", *damping)
    return table


def _value_and_interval(estimate: Estimate | None, digits: int) -> tuple[str, str]:
    if estimate is None:
        return "-", "-"
    low, high = estimate.interval()
    return f"{estimate.value:.{digits}f}", f"{low:.{digits}f} .. {high:.{digits}f}"


def show(found: Identification) -> None:
    """The result in short, for people."""
    for fault in found.measurement.faults:
        out.print(f"found wrong: {fault}", style="yellow")
    if found.suspended is not None:
        out.print(_free_beam_table(found.suspended))
        for text in found.suspended.result.statements:
            out.print(f"  {text}")
    if found.inverse is not None:
        out.print(modes_table(found.inverse.modal))
        table = Table("joint", "element", "k (MN/m)", "95 %", "h (MN/m)", "95 %", "paper's k, 95 %", box=None)
        for name, joint in found.inverse.likelihood.joints.items():
            paper = found.inverse.paper.joints[name]
            for row, column in ((0, 0), (0, 1), (1, 1)):
                at = (row, column)
                table.add_row(
                    name,
                    f"{row + 1}{column + 1}{'' if joint.observable[at] else ' (not observable)'}",
                    f"{joint.stiffness[at] / 1e6:.3f}",
                    " .. ".join(f"{end / 1e6:.3f}" for end in joint.k_ci95[at]),
                    f"{joint.damping[at] / 1e6:.3f}",
                    " .. ".join(f"{end / 1e6:.3f}" for end in joint.h_ci95[at]),
                    " .. ".join(f"{end / 1e6:.3f}" for end in paper.k_ci95[at]),
                )
        out.print(table)
        for text in fit_statements(found.inverse.fit):
            out.print(text)
        if found.inverse.regularised is not None:
            for text in regularisation_statements(found.inverse.fit, found.inverse.regularised):
                out.print(text, style="yellow")
        if found.inverse.remedies:
            out.print("What would mend the weakest direction of the stiffnesses (EI/L^3, noise of the lines alone):")
            for remedy in found.inverse.remedies:
                out.print(f"  {remedy.text}")
        for check in found.inverse.fit.all_checks:
            if not check.passed:
                out.print(f"FAILED: {check.name}: {check.text}", style="red")
    for correction in found.corrections.applied:
        out.print(f"corrected for {correction.text}")
    if found.corrections.calibration is not None:
        for warning in found.corrections.calibration.warnings:
            out.print(f"calibration of the tester: {warning}", style="yellow")
    for name, direct in found.direct.items():
        series = sum(len(points) for by_amplitude in direct.series.values() for points in by_amplitude.values())
        out.print(f"joint {name}: {series} sine points")
        for amplitude, superposition in direct.superposition.items():
            out.print(f"  {amplitude:g} mm: {superposition.text}")
    if found.comparison:
        table = Table("joint", "element", "inverse 95 %", "direct 95 %", "verdict", box=None)
        for each in found.comparison:
            unit = 1e6 if each.element.startswith("k") else 1.0
            inverse = (
                "-" if each.inverse is None else f"{each.inverse.low / unit:.3f} .. {each.inverse.high / unit:.3f}"
            )
            tester = f"{each.direct.low / unit:.3f} .. {each.direct.high / unit:.3f}"
            table.add_row(each.joint, each.element, inverse, tester, each.verdict.value)
        out.print(table)
