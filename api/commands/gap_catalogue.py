"""The effects that a diagnosis knows, as a table."""

from collections.abc import Iterable

from rich.table import Column, Table

from jointlab.diagnosis import wording
from jointlab.diagnosis.catalogue import CatalogueEntry, range_of

MOST_NAMES = 3


def catalogue_table(known: Iterable[CatalogueEntry]) -> Table:
    """Every law of every effect; of parameters with a range in common, such as those of all points, the first."""
    table = Table(Column("effect", no_wrap=True), "what it is", "law", "parameter", "range", box=None)
    before: CatalogueEntry | None = None
    for entry in known:
        same = before is not None and before.effect == entry.effect
        head = ("", "") if same else (entry.effect, entry.title)
        lines = parameter_ranges(entry) or [("-", "nothing this measurement could show")]
        table.add_row(*head, entry.law, *lines[0])
        for line in lines[1:]:
            table.add_row("", "", "", *line)
        before = entry
    return table


def parameter_ranges(entry: CatalogueEntry) -> list[tuple[str, str]]:
    """Parameters of a law with their ranges; parameters alike in range and unit share a line."""
    alike = dict[str, list[str]]()
    for parameter in entry.parameters:
        low, high = range_of(parameter)
        alike.setdefault(wording.interval_with_unit((low, high), parameter.unit), []).append(parameter.name)
    return [(_short(names), text) for text, names in alike.items()]


def _short(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= MOST_NAMES else f"{names[0]} ... {names[-1]} ({len(names)})"
