"""`jointlab identify`, `jointlab modes` and `jointlab report`: results of measurements."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.commands.identification_options import takes_options
from api.commands.terminal import (
    bundle_with_notes,
    check_line,
    check_writable,
    open_catalogue,
    out,
    progress_bar,
    progress_console,
    run_number,
    show_sections,
    show_table,
    write_json,
)
from jointlab.errors import JointlabError
from jointlab.identification.options import AS_MEASURED, Options
from jointlab.settings import load_settings
from store.errors import StoreError
from store.provenance import who_is_here

if TYPE_CHECKING:
    from jointlab.identification.pipeline import Identification
    from jointlab.report.signature import Signature
    from store.catalogue import Catalogue


@takes_options
def identify(
    target: Annotated[str, typer.Argument(metavar="BUNDLE|RUN", help="A bundle, or the number of a run.")],
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the whole result to this file.")] = None,
    options: Options = AS_MEASURED,
) -> None:
    """Identify k, h and gamma by both methods and compare them.

    Results of a run are stored beside older ones; those of a bundle are only shown (import it first to store them).
    """
    from jointlab.identification.document import identification_document

    check_writable(json_file, read=(Path(target),))
    found = identified(target, options)
    show(found)
    if json_file is not None:
        write_json(identification_document(found), json_file)


def modes(
    file: Annotated[Path, typer.Argument(help="UFF file with accelerances (dataset 58 or 58b, function type 4).")],
    accelerometer: Annotated[
        str | None, typer.Option(help="Use this accelerometer alone, such as 3y; by default each by itself.")
    ] = None,
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LOW HIGH", help="Frequencies in Hz to fit between; by default all lines above 0 Hz."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Estimate natural frequencies, loss factors and shapes; poles are chosen automatically.

    Each accelerometer of the file has modes of its own; where it roves, each point of the force has.
    """
    import json

    from analysis.errors import AnalysisError
    from analysis.modal.estimation import ModalEstimate, estimate_modes
    from jointlab.identification.document import modes_document, plain
    from jointlab.identification.responses_file import read_responses
    from jointlab.identification.save import mode_set
    from jointlab.report.tables import modes_table

    found = read_responses(file, accelerometer)
    for note in found.notes:
        progress_console.print(f"note: {note}", soft_wrap=True)
    estimates, said = list[tuple[str, ModalEstimate]](), list[str]()
    places = [str(each.response) for each in found.sets]
    for number, (each, place) in enumerate(zip(found.sets, places, strict=True), start=1):
        name = f"{place}, set {number}" if places.count(place) > 1 else place  # a set for each level, for example
        try:
            estimates.append((name, estimate_modes(each, band)))
        except AnalysisError as error:
            if len(found.sets) == 1:
                raise
            said.append(f"accelerometer at {name}: {error}")
    if not estimates:
        raise AnalysisError("; ".join(said))
    for note in said:
        progress_console.print(f"note: {note}", soft_wrap=True)
    if as_json:
        documents = [{"accelerometer": place, **modes_document(own)} for place, own in estimates]
        out.print_json(json.dumps(plain(documents[0] if len(found.sets) == 1 else documents)))
        return
    for place, estimate in estimates:
        if len(found.sets) > 1:
            out.print(f"accelerometer at {place}")
        show_table(modes_table(mode_set(estimate), estimate.quality))


@takes_options
def report(
    target: Annotated[str, typer.Argument(metavar="BUNDLE|RUN", help="A bundle, or the number of a run.")],
    file: Annotated[Path, typer.Option("--output", "-o", help="Where to write it.")] = Path("report.html"),
    signed_by: Annotated[
        str | None, typer.Option(metavar="NAME", help="Who signs it; by default it has a line to sign by hand.")
    ] = None,
    options: Options = AS_MEASURED,
) -> None:
    """Identify and write the report: a summary on one page, contents, and the paper's figures and tables as annexes.

    It has the newest diagnosis of the run (`jointlab gap diagnose`), too. A file that ends in .pdf is printed by the
    Chromium of this computer. A signature is in the audit log, too, with the checksum of the file.
    """
    from jointlab.identification.run import standing_of
    from jointlab.report.identification import write_report, write_run_report
    from jointlab.report.signature import Signature

    check_writable(file, read=(Path(target),))
    run = run_number(target)
    _check_signer(signed_by, run, file)
    laboratory = load_settings().laboratory
    found = identified(target, options)
    if run is None:
        write_report(found, file, laboratory=laboratory)
    else:
        signature = None if signed_by is None else Signature(signed_by, who_is_here(), datetime.now(UTC))
        with open_catalogue() as catalogue:
            standing = standing_of(catalogue, run, found)
            write_run_report(catalogue, run, found, file, laboratory, standing, signature=signature)
            if signature is not None:
                _sign(catalogue, run, signature, file)
    out.print(f"{file} written")
    if signed_by is not None:
        out.print(f"signed by {signed_by}")


def _check_signer(name: str | None, run: int | None, file: Path) -> None:
    """Raise JointlabError where this is no name, or there is no run or no file whose checksum could be noted."""
    if name is None:
        return
    check_line(name, "--signed-by")
    if run is None:
        raise JointlabError(
            "--signed-by belongs to the report of a stored run, as the audit log has the signature; store the bundle "
            "with jointlab import, and sign the report of its run"
        )
    if file.exists() and not file.is_file():
        raise JointlabError(f"{file} is no file whose checksum could be noted with the signature; name a file")


def _sign(catalogue: Catalogue, run: int, signature: Signature, file: Path) -> None:
    """Note the signature under the report of a run; where that fails, there is no report that says it is signed."""
    from jointlab.report.signature import note_signature

    try:
        with catalogue.writing() as session:
            note_signature(session, run, signature, file)
    except StoreError:
        file.unlink(missing_ok=True)
        raise


def identified(target: str, options: Options = AS_MEASURED) -> Identification:
    """Identify a bundle, or a run; a run's results are stored.

    Raises:
        StoreError, AnalysisError, JointlabError: there is no such thing, or nothing can be identified from it.
    """
    from jointlab.identification.load import measurement_of_bundle, with_free_beam
    from jointlab.identification.pipeline import identify
    from jointlab.identification.run import identify_and_save

    run, progress = run_number(target), progress_bar
    if run is not None:
        with open_catalogue() as catalogue:
            return identify_and_save(catalogue, run, options, progress)
    measurement = measurement_of_bundle(bundle_with_notes(target), options)
    if options.free_beam is not None:
        with open_catalogue() as catalogue:
            measurement = with_free_beam(measurement, catalogue, options, progress)
    return identify(measurement, options)


def show(found: Identification) -> None:
    """Print the result in short."""
    from jointlab.report.summary import summary_sections

    show_sections(summary_sections(found))
