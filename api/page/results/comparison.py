"""Direct against inverse, element by element, with the verdict and its reason."""

from __future__ import annotations

from nicegui import ui

from api.page.charts import comparison as charts
from api.page.charts.sines import panel
from api.page.controls import chart
from api.page.formatting import interval
from api.page.markup import Cell, show, table
from api.page.results.section import Section, direct_where_known, newest_of, show_origin
from jointlab.identification.read import METHODS, newest_joints
from jointlab.report.curves import Panel, loss_factor_panels, stiffness_panels
from store.analyses import Analysis
from store.catalogue import Catalogue
from store.comparisons import Comparison, list_comparisons
from store.runs import Run
from store.states import AnalysisKind

MARKS = {"agree": "✓ agree", "differ": "✗ differ"}
Found = tuple[Analysis, list[Comparison], list[Panel], list[Panel]]


def _read(catalogue: Catalogue, run: Run) -> Found:
    newest = newest_of(catalogue, run, AnalysisKind.COMPARISONS, "comparison")
    with catalogue.reading() as session:
        compared = list_comparisons(session, newest.id)
    joints = {METHODS.get(name, name): own for name, (_, own) in newest_joints(catalogue, run).items()}
    direct = direct_where_known(catalogue, run)
    if not direct:
        return newest, compared, [], []
    return newest, compared, stiffness_panels(joints, direct), loss_factor_panels(joints, direct)


def _draw(_run: Run, found: Found) -> None:
    analysis, compared, stiffness, loss = found
    for start, unit in (("k", "MN/m"), ("gamma", "")):
        own = [each for each in compared if each.element.startswith(start) and each.inverse is not None]
        if own:
            scale = 1e6 if start == "k" else 1.0
            title = "Stiffness, MN/m" if start == "k" else "Loss factor"
            chart(f"{title}: 95 % intervals of both methods", charts.intervals(own, scale, unit), f"comparison-{start}")
    with ui.element("div").classes("cards"):
        for each in stiffness:
            chart(f"Fig. 13: {each.title}", panel(each, "k (MN/m)", 1e6), f"fig-13-{_slug(each.title)}")
        for each in loss:
            chart(f"Fig. 14: {each.title}", panel(each, "γ"), f"fig-14-{_slug(each.title)}")
    head = ("joint", "element", "inverse, 95 %", "direct, 95 %", "verdict", "why")
    show(table("Element by element", head, map(_row, compared)))
    show_origin(analysis)


def _slug(title: str) -> str:
    return "-".join(title.replace(",", "").split())


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
