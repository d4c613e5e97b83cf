"""`jointlab import` and `jointlab export`: bundles into the catalogue and out of it."""

from pathlib import Path
from typing import Annotated

import typer

from api.commands.terminal import LARGEST_RUN, open_catalogue, out
from store.bundle import read_bundle
from store.bundle_exchange import export_bundle, import_bundle


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
    bundle: Annotated[Path, typer.Argument(help="A new folder, or a new file that ends in .zip.")],
    blows: Annotated[bool, typer.Option(help="Write the accepted blows too.")] = True,
) -> None:
    """Write a run as a bundle. A run that was measured here has to be identified first."""
    with open_catalogue() as catalogue:
        export_bundle(catalogue, run, bundle, blows=blows)
    out.print(f"{bundle} written")
