"""`jointlab history`: a specimen over its runs."""

from typing import Annotated

import typer

from api.commands.terminal import open_catalogue, out, show_table
from jointlab.report.history import history_table, trend_sentences
from jointlab.specimen_history import history_of


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
        found = history_of(session, article, specimen, configuration, amplitude, frequency)
    show_table(history_table(specimen, found))
    for sentence in trend_sentences(found):
        out.print(sentence)
