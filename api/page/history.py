"""The history of a specimen over its runs, of which the view of runs shows one where the address names it."""

from collections.abc import Mapping
from html import escape

from nicegui import ui

from api.page.charts.history import over_time
from api.page.controls import chart
from api.page.frame import Frame
from api.page.markup import Link, filters, paragraph, show, table
from jointlab.report.history import history_table, history_title, trend_sentences
from jointlab.specimen_history import NO_POINTS, SpecimenHistory
from store.results.specimen_history import NominalPoint, nominal_points, specimen_history

MEGA = 1e6
LABELS = {"configuration": "Configuration", "amplitude_pp_mm": "Amplitude (mm p-p)", "frequency": "Frequency (Hz)"}


async def build(frame: Frame, article: str, specimen: str, query: Mapping[str, str]) -> None:
    """Build the history of a specimen at the nominal point that the address names, or the one of most runs."""
    show(f"<h2>{escape(article)}, {escape(specimen)} over its runs</h2>")
    wanted = {name: query.get(name, "") for name in NominalPoint._fields}

    def look() -> tuple[list[NominalPoint], SpecimenHistory | None]:
        with frame.services.catalogue.reading() as session:
            points = nominal_points(session, article, specimen)
            # by the texts of the address, which have six digits of a number
            fitting = [point for point in points if all(wanted[n] in ("", t) for n, t in _texts(point).items())]
            found = [specimen_history(session, article, specimen, point) for point in fitting[:1]]
            return points, SpecimenHistory(fitting[0], tuple(found[0])) if found else None

    read = await frame.read(look)
    if read is None:
        return
    points, history = read
    if not points:
        paragraph(NO_POINTS, "notice")
        return
    shown = wanted if history is None else _texts(history.point)
    fields = {
        name: (label, shown[name], tuple(dict.fromkeys(_texts(point)[name] for point in sorted(points))))
        for name, label in LABELS.items()
    }
    show(filters(fields, kept={"article": article, "history": specimen}))
    if history is None:
        paragraph("Not measured at this point. Choose all for one of the three, and press Show.", "notice")
        return
    for sentence in trend_sentences(history):
        paragraph(sentence)
    _draw(specimen, history)


def _draw(specimen: str, history: SpecimenHistory) -> None:
    results, where = history.results, history_title(specimen, history.point)
    at = [each.measured_at for each in results]
    stiffness = [(_over(each.stiffness_low, MEGA), _over(each.stiffness_high, MEGA)) for each in results]
    loss = [(each.loss_factor_low, each.loss_factor_high) for each in results]
    with ui.element("div").classes("cards"):
        k = over_time("k (MN/m)", at, [each.stiffness / MEGA for each in results], stiffness)
        chart(f"k, {where}", k, "history-k")
        chart(f"γ, {where}", over_time("γ", at, [each.loss_factor for each in results], loss), "history-gamma")
        if any(each.temperature_c is not None for each in results):
            warm = over_time("temperature (°C)", at, [each.temperature_c for each in results])
            chart("Temperature", warm, "history-temperature")
    made = history_table(specimen, history)
    rows = ((Link(str(row[0]), f"/page/results?run={row[0]}&part=Tester"), *row[1:]) for row in made.rows)
    show(table(made.caption, made.head, rows))


def _texts(point: NominalPoint) -> dict[str, str]:
    """The values of the point as the address has them."""
    return {
        "configuration": point.configuration,
        "amplitude_pp_mm": f"{point.amplitude_pp_mm:g}",
        "frequency": f"{point.frequency:g}",
    }


def _over(value: float | None, scale: float) -> float | None:
    return None if value is None else value / scale
