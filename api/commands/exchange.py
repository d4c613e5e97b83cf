"""`jointlab import` and `jointlab export`: read bundles into the catalogue, and write files of a run."""

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from api.commands.terminal import LARGEST_RUN, check_line, open_catalogue, out
from jointlab.errors import JointlabError
from store.exchange.bundle import read_bundle
from store.exchange.bundle_exchange import UnfitPointsError, export_bundle, import_bundle
from store.exports.formats import FORMS

FILE_ENDING = re.compile(r"\.[A-Za-z]\w*")
"""The ending of a name that stands for a file, unlike that of `run-2026.03`."""


class ExportForm(StrEnum):
    """Forms of `jointlab export`."""

    BUNDLE = "bundle"
    BLUESKY = "bluesky"
    HDF5 = "hdf5"
    MAT = "mat"
    PARQUET = "parquet"
    UFF = "uff"
    MODEL = "model"


def import_(
    bundle: Annotated[Path, typer.Argument(help="A measurement bundle: a folder, or a zip of it.")],
    article: Annotated[
        str | None, typer.Option(help="Name of the test article; the bundle's title by default.")
    ] = None,
) -> None:
    """Store a bundle as a run. On any error nothing is stored."""
    if article is not None:
        check_line(article, "--article")
    read = read_bundle(bundle)
    with open_catalogue() as catalogue:
        run = import_bundle(catalogue, read, article)
    for warning in read.warnings:
        out.print(f"warning: {warning}", style="yellow")
    rows = sum(len(measured.inputs) for measured in read.inverse)
    out.print(
        f"run {run}: {len(read.inverse)} sets with {rows} accelerances, {len(read.direct)} sine points, "
        f"{len(read.blows)} blows"
    )


def export(
    run: Annotated[int, typer.Argument(min=1, max=LARGEST_RUN, help="Number of the run.")],
    target: Annotated[
        Path, typer.Argument(help="A new file; for bundle and parquet a new folder, or a new file that ends in .zip.")
    ],
    form: Annotated[ExportForm, typer.Option("--format", help="What to write.")] = ExportForm.BUNDLE,
    blows: Annotated[
        bool | None, typer.Option(help="Write the accepted blows into a bundle too, as by default.")
    ] = None,
    leave_out_unfit_points: Annotated[
        bool,
        typer.Option(
            "--leave-out-unfit-points",
            help="Leave out sine points that a bundle cannot hold, such as one beyond 90 degrees or without a "
            "temperature, and say which; by default the bundle is refused.",
        ),
    ] = False,
) -> None:
    """Write a run as a bundle, its results for other programs, or the corrected simulation of its newest diagnosis
    (model).

    Results have units, intervals and provenance. HDF5 has every record, too, and UFF accelerances and modes alone. A
    run that was measured here has to be identified first.
    """
    _check_target(target, form)
    if blows is not None and form is not ExportForm.BUNDLE:
        raise JointlabError(f"--blows and --no-blows belong to --format bundle; leave them out with {form}")
    if leave_out_unfit_points and form is not ExportForm.BUNDLE:
        raise JointlabError(f"--leave-out-unfit-points belongs to --format bundle; leave it out with {form}")
    with open_catalogue() as catalogue:
        if form is ExportForm.BUNDLE:
            try:
                left_out = export_bundle(
                    catalogue, run, target, blows=blows is not False, leave_out_unfit_points=leave_out_unfit_points
                )
            except UnfitPointsError as error:
                error.add_note("with --leave-out-unfit-points such points are left out, and the bundle says which")
                raise
            out.print(f"{target} written")
            for point in left_out:
                out.print(f"warning: {point}", style="yellow")
        elif form is ExportForm.MODEL:
            from jointlab.diagnosis.model_file import write_model_of_run

            out.print(", ".join(map(str, write_model_of_run(catalogue, run, target))) + " written")
        else:
            _, write = FORMS[form]
            out.print(f"{target} written: {write(catalogue, run, target)} analyses")


def _check_target(target: Path, form: ExportForm) -> None:
    """A folder that is called `run.h5` is no HDF5 file, which is what one who forgot --format expects."""
    folder = form in (ExportForm.BUNDLE, ExportForm.PARQUET)
    if not folder or target.suffix == ".zip" or not FILE_ENDING.fullmatch(target.suffix):
        return
    other = next((name for name, (suffix, _) in FORMS.items() if suffix == target.suffix.lower()), None)
    hint = "" if other is None else f", or give --format {other}"
    raise JointlabError(
        f"{target} is called like a file, and {form} is written into a folder, or a file that ends in .zip; "
        f"name one of these{hint}"
    )
