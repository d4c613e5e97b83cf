"""`jointlab import` and `jointlab export`: bundles into the catalogue, and files of a run out of it."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from api.commands.terminal import LARGEST_RUN, open_catalogue, out
from store.bundle import read_bundle
from store.bundle_exchange import export_bundle, import_bundle


class ExportForm(StrEnum):
    """Forms of `jointlab export`."""

    BUNDLE = "bundle"
    HDF5 = "hdf5"


def import_(
    bundle: Annotated[Path, typer.Argument(help="A measurement bundle: a folder, or a zip of it.")],
    article: Annotated[
        str | None, typer.Option(help="Name of the test article; the bundle's title by default.")
    ] = None,
) -> None:
    """Store a bundle as a run. On any error nothing is stored."""
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
        Path, typer.Argument(help="A new file; for a bundle a new folder, or a new file that ends in .zip.")
    ],
    form: Annotated[ExportForm, typer.Option("--format", help="What to write.")] = ExportForm.BUNDLE,
    blows: Annotated[bool, typer.Option(help="Write the accepted blows into a bundle too.")] = True,
) -> None:
    """Write a run as a bundle, or as one HDF5 file with every record and result in physical units.

    For a bundle, a run that was measured here has to be identified first.
    """
    with open_catalogue() as catalogue:
        if form is ExportForm.BUNDLE:
            export_bundle(catalogue, run, target, blows=blows)
            out.print(f"{target} written")
        else:
            from store.hdf5 import export_hdf5

            written = export_hdf5(catalogue, run, target)
            out.print(f"{target} written: {written.waveforms} waveforms, {written.analyses} analyses")
