"""`jointlab history`: a specimen over its runs."""

from typing import Annotated

import typer

from api.commands.terminal import open_catalogue, out, show_table
from jointlab.errors import JointlabError
from jointlab.report.history import NO_POINTS, history_table, trend_sentences
from store.results.specimen_history import nominal_points, specimen_history


def history(
    article: Annotated[str, typer.Argument(help="The test article.")],
    specimen: Annotated[str, typer.Argument(help="The joint, such as I.")],
    configuration: Annotated[str | None, typer.Option(help="compression, shear or angled.")] = None,
    amplitude: Annotated[float | None, typer.Option(help="Commanded, mm peak to peak.")] = None,
    frequency: Annotated[float | None, typer.Option(help="Commanded, Hz.")] = None,
) -> None:
    """Show k and γ of a specimen over its runs at one point of the tester, with intervals, temperature and trend.

    Of what is not given, the value of most runs is taken.
    """
    with open_catalogue() as catalogue, catalogue.reading() as session:
        points = nominal_points(session, article, specimen)
        if not points:
            raise JointlabError(f"{article}, {specimen}: {NO_POINTS}")
        wanted = (configuration, amplitude, frequency)
        fitting = [point for point in points if all(w in (None, v) for w, v in zip(wanted, point, strict=True))]
        if not fitting:
            known = (", ".join(f"{each}" for each in sorted(set(values))) for values in zip(*points, strict=True))
            raise JointlabError(
                "{}: not measured at this point; it was in {}, at {} mm p-p and {} Hz".format(specimen, *known)
            )
        found = specimen_history(session, article, specimen, fitting[0])
    show_table(history_table(specimen, fitting[0], found))
    for sentence in trend_sentences(found):
        out.print(sentence)
