"""Direct against inverse, element by element, with the verdict and its reason."""

from __future__ import annotations

from api.page.charts import comparison as charts
from api.page.controls import chart
from api.page.markup import Cell, show, table
from api.page.results.section import Section, newest_of, show_origin
from api.page.words import interval
from store.analyses import Analysis, AnalysisKind
from store.catalogue import Catalogue
from store.comparisons import Comparison, list_comparisons
from store.runs import Run

MARKS = {"agree": "✓ agree", "differ": "✗ differ"}
Found = tuple[Analysis, list[Comparison]]


def _read(catalogue: Catalogue, run: Run) -> Found:
    newest = newest_of(catalogue, run, AnalysisKind.COMPARISONS, "comparison")
    with catalogue.reading() as session:
        return newest, list_comparisons(session, newest.id)


def _draw(_run: Run, found: Found) -> None:
    analysis, compared = found
    for start, unit in (("k", "MN/m"), ("gamma", "")):
        own = [each for each in compared if each.element.startswith(start) and each.inverse is not None]
        if own:
            scale = 1e6 if start == "k" else 1.0
            title = "Stiffness, MN/m" if start == "k" else "Loss factor"
            chart(f"{title}: 95 % intervals of both methods", charts.intervals(own, scale, unit), f"comparison-{start}")
    head = ("joint", "element", "inverse, 95 %", "direct, 95 %", "verdict", "why")
    show(table("Element by element", head, map(_row, compared)))
    show_origin(analysis)


def _row(each: Comparison) -> tuple[Cell, ...]:
    scale, unit = (1.0, "") if each.element.startswith("gamma") else (1e6, "MN/m")
    low, high = each.inverse or (None, None)
    return (
        each.joint,
        each.element,
        interval(low, high, scale, unit),
        interval(*each.direct, scale, unit),
        MARKS.get(each.verdict, each.verdict),
        each.reason or "",
    )


SECTION = Section(
    "Direct against inverse", "Measure both, hammer and sweep, in one run; then press Identify.", _read, _draw
)
