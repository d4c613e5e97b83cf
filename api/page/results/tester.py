"""Results of the tester, and both experiments against each other."""

from nicegui import ui

from api.page.charts import sines
from api.page.controls import chart
from api.page.markup import paragraph, show, show_table
from api.page.results.part import Part, newest_of, show_origin, where_known
from jointlab.identification.direct import Direct, series_of
from jointlab.identification.inverse import LIKELIHOOD, METHODS
from jointlab.identification.read import newest_joints, read_direct, why_not_compared
from jointlab.identification.save import NOT_COMPARED
from jointlab.identification.sine_points import sine_point
from jointlab.report.curves import (
    Panel,
    curves,
    loss_factor,
    loss_factor_panels,
    stiffness,
    stiffness_panels,
    superposition_curves,
)
from jointlab.report.plots import METHOD_COLOURS, TESTER_COLOURS
from jointlab.report.summary import not_compared, superposition_texts, tester_notices
from jointlab.report.tables import comparison_table, unit_notices
from rig.operator import loading_text
from store.catalogue import Catalogue
from store.measurements.runs import Run
from store.results.analyses import Analysis
from store.results.comparisons import Comparison, list_comparisons
from store.results.dynamic_stiffness import StoredStiffness, list_dynamic_stiffness
from store.states import AnalysisKind

BOTH = {"inverse": METHOD_COLOURS[0], "direct": TESTER_COLOURS[0]}
FoundPoints = tuple[Analysis, list[StoredStiffness], dict[str, Direct]]


def _read_points(catalogue: Catalogue, run: Run) -> FoundPoints:
    newest = newest_of(catalogue, run, AnalysisKind.DYNAMIC_STIFFNESS, "dynamic stiffness")
    return newest, catalogue.read(list_dynamic_stiffness, newest.id), where_known(read_direct, catalogue, run) or {}


def _draw_points(_run: Run, found: FoundPoints) -> None:
    analysis, points, direct = found
    show(f"<p>{len(points)} sine points; bars are 95 % intervals. The legend hides and shows amplitudes.</p>")
    with ui.element("div").classes("cards"):
        for specimen, by_configuration in series_of(map(sine_point, points)).items():
            looks = sines.amplitude_looks(by_configuration.values())
            for configuration, series in by_configuration.items():
                where, name = f"joint {specimen} {loading_text(configuration)}", f"{specimen}-{configuration}"
                k, gamma = (sines.by_amplitude_words(curves(series, quantity)) for quantity in (stiffness, loss_factor))
                chart(f"k, {where}", sines.over_frequency(k, "k (MN/m)", 1e6, looks), f"k-{name}")
                chart(f"γ, {where}", sines.over_frequency(gamma, "γ", looks=looks), f"gamma-{name}")
    for name, cylinders in direct.items():
        for notice in tester_notices(name, cylinders):
            paragraph(notice.text, "notice")
        if cylinders.superposition:
            caption = f"Fig. 12: joint {name}, superposition of the cylinders at 45 degrees"
            chart(caption, sines.superposition(*superposition_curves(cylinders.superposition)), f"fig-12-{name}")
            paragraph(" ".join(superposition_texts(cylinders)))
    show_origin(analysis)


ComparisonPanels = tuple[Analysis, list[Comparison], list[Panel], list[Panel]]


def _read_comparison(catalogue: Catalogue, run: Run) -> ComparisonPanels:
    if catalogue.read(why_not_compared, run.id):  # an older comparison is not of these joints
        return newest_joints(catalogue, run)[LIKELIHOOD][0], [], [], []
    newest = newest_of(catalogue, run, AnalysisKind.COMPARISONS, "comparison")
    compared = catalogue.read(list_comparisons, newest.id)
    joints = {METHODS.get(name, name): own for name, (_, own) in newest_joints(catalogue, run).items()}
    direct = where_known(read_direct, catalogue, run)
    if not direct:
        return newest, compared, [], []
    return newest, compared, stiffness_panels(joints, direct), loss_factor_panels(joints, direct)


def _draw_comparison(_run: Run, found: ComparisonPanels) -> None:
    analysis, compared, stiffness_found, loss_found = found
    if not compared:
        paragraph(not_compared(analysis.settings[NOT_COMPARED]).text)
        show_origin(analysis)
        return
    for start, title in (("k", "Stiffness"), ("gamma", "Loss factor")):
        own = {
            f"{each.element} {each.joint}": {"inverse": each.inverse, "direct": each.direct}
            for each in compared
            if each.element.startswith(start) and each.inverse is not None
        }
        if own:
            caption, height = f"{title}: 95 % intervals of both methods", sines.intervals_height(len(own), len(BOTH))
            chart(caption, sines.intervals(own, BOTH), f"comparison-{start}", height=height)
    with ui.element("div").classes("cards"):
        for caption, drawn in sines.panels(stiffness_found, "k (MN/m)", 1e6):
            chart(f"Fig. 13: {caption}", drawn, f"fig-13-{_slug(caption)}")
        for caption, drawn in sines.panels(loss_found, "γ"):
            chart(f"Fig. 14: {caption}", drawn, f"fig-14-{_slug(caption)}")
    for notice in unit_notices(compared):
        paragraph(notice.text, "notice")
    show_table(comparison_table(compared))
    show_origin(analysis)


def _slug(title: str) -> str:
    return "-".join(title.replace(",", "").split())


TESTER = Part(
    "Tester",
    "Press Identify: k and gamma are computed from the records of the sweep.",
    "sweep",
    _read_points,
    _draw_points,
)
COMPARISON = Part(
    "Direct against inverse",
    "Measure both, hammer and sweep, in one run; then press Identify.",
    "",
    _read_comparison,
    _draw_comparison,
)
