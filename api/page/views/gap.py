"""The gap between measurement and simulation: where it is, which effect explains it, and the next experiment."""

from collections.abc import Mapping
from html import escape
from typing import Any

from nicegui import ui

from api.page.address import number
from api.page.charts import gap as charts
from api.page.controls import chart
from api.page.formatting import moment
from api.page.frame import Frame
from api.page.gap_curves import gap_curves
from api.page.markup import Link, paragraph, show, show_table, table
from api.page.results.part import show_origin
from api.page.views import investigation
from api.service.context import Services
from jointlab.diagnosis import wording
from jointlab.diagnosis.law_text import effect_name, laws_found
from jointlab.errors import EXPECTED
from jointlab.report.gap_tables import effects_table, parameters_table, places_table, ranking_table
from store.errors import NotFoundError
from store.results.analyses import Analysis, get_analysis
from store.results.diagnoses import StoredDiagnosis, StoredVerdict, get_diagnosis, list_diagnoses

STATUS = {
    "none": "nothing beyond noise",
    "explained": "explained",
    "partial": "partly explained",
    "unknown": "not explained",
}


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view of the diagnosis or the investigation that the address names, or the list of them."""
    try:
        if (chosen := number(query, "investigation")) is not None:
            await investigation.build(frame, chosen)
            return
        asked = await frame.reading(lambda: _asked(frame.services, query))
    except NotFoundError as error:
        frame.tell(f"{error}; the list below has those that there are")
        asked = None
    except EXPECTED as error:
        frame.tell(str(error))
        return
    if asked is None:
        await _list(frame)
    else:
        _draw(*asked)
        await _investigations(frame, asked[1])


async def _investigations(frame: Frame, analysis: Analysis) -> None:
    """Investigations of the run of a diagnosis, and the button for a new one."""
    run = analysis.runs[0]
    found = await frame.read(lambda: investigation.investigations_of(frame, run))
    show("<h2>Investigations</h2>")
    paragraph(
        "An investigation asks for the experiment that tells most for its time, and diagnoses all data together. It "
        "moves no machine.",
        "quiet",
    )
    investigation.show_list(f"Investigations of run {run}", found or ())
    investigation.begin_button(frame, run)


def _asked(services: Services, query: Mapping[str, str]) -> tuple[StoredDiagnosis, Analysis] | None:
    asked = number(query, "diagnosis")
    if asked is None:
        return None
    with services.catalogue.reading() as session:
        return get_diagnosis(session, asked), get_analysis(session, asked)


def _stored(services: Services) -> list[StoredVerdict]:
    return services.catalogue.read(list_diagnoses)


async def _list(frame: Frame) -> None:
    read = await frame.read(lambda: (_stored(frame.services), investigation.investigations_of(frame)))
    if read is None:
        return
    found, investigated = read
    investigation.show_list("Investigations", investigated)
    if not found:
        show(
            "<p>No diagnosis yet. Measure hammer and sweep in one run, open its <a href='/page/results'>results</a>, "
            "and press “Diagnose the gap”.</p>"
        )
        return
    rows = [
        (
            Link(f"diagnosis {each.analysis_id}", f"/page/gap?diagnosis={each.analysis_id}"),
            STATUS.get(each.status, each.status),
            ", ".join(each.effects) or "–",
            wording.percent(each.gap_before_percent),
            wording.percent(each.gap_after_percent),
            moment(each.created_at),
        )
        for each in found
    ]
    show(table("Diagnoses", ("", "verdict", "effects", "gap before", "after", "made"), rows))


def _draw(found: StoredDiagnosis, analysis: Analysis) -> None:
    document = found.document
    verdict = document["verdict"]
    colour = "refused" if verdict["status"] in ("partial", "unknown") else "accepted"
    show(
        f'<p class="big" id="verdict"><span class="badge {colour}">{escape(STATUS[verdict["status"]])}</span></p>'
        f"<p>{escape(_sentence(wording.verdict_sentence(document)))}</p>"
        f"<p>{escape(_sentence(wording.probability_sentence(document)))}</p>"
    )
    for fault in document.get("faults", ()):
        paragraph(f"Wrong with the measurement itself: {fault}.", "notice trouble")
    for sentence in document.get("lost", ()):
        paragraph(f"Limit of this measurement: {sentence}.", "notice")
    _next(document, analysis)
    show("<h2>How far</h2>")
    chart("Gap before and after, on held-out data", charts.before_and_after(document["gap"]), "gap", height="16rem")
    gap_curves(document.get("curves", ()))
    for sentence in (wording.rigs_sentence(document), *wording.beside(document)):
        paragraph(_sentence(sentence))
    if found_laws := laws_found(document):
        show("<h2>Laws as found</h2>")
        with ui.element("div").classes("cards"):
            for each in found_laws:
                name = effect_name(each, document["titles"])
                for quantity, words in (("stiffness", "Stiffness"), ("loss_factor", "Loss factor")):
                    mark = f"gap-law-{each['id']}-{quantity}".replace("_", "-")
                    chart(f"{words}: {name}", charts.law(each["law_found"], quantity), mark, height="19rem")
    if curve := wording.shape_of(document):
        show("<h2>What would take up the rest</h2>")
        with ui.element("div").classes("cards"):
            for part in ("real", "imaginary"):
                title = f"{_sentence(wording.shape_title(curve))[:-1]}: {part} part"
                chart(title, charts.shape(curve, part), f"gap-shape-{part}", height="19rem")
    show("<h2>Which</h2>")
    if effects := effects_table(document):
        show_table(effects)
    show_table(ranking_table(document))
    if parameters := parameters_table(document):
        show_table(parameters)
    show("<h2>Where</h2>")
    paragraph(wording.MAP_WARNING, "quiet")
    with ui.element("div").classes("cards"):
        for index, drawn in enumerate(document.get("maps", ())):
            chart(drawn["title"], charts.gap_map(drawn), f"map-{index + 1}", height="24rem")
    if places := places_table(document):
        show_table(places)
    show_origin(analysis)


def _next(document: Mapping[str, Any], analysis: Analysis) -> None:
    """Confounded effects, and the next experiment with a link to its sequence."""
    if confounded := wording.confounded_sentence(document):
        paragraph(f"{_sentence(confounded)}", "notice")
    asked = wording.next_experiment_words(document)
    if not asked:
        return
    show(f"<p>Next experiment: {escape(asked)}.</p>")
    if document["verdict"]["status"] != "none":  # then nothing is asked for
        address = f"/page/measure?next={analysis.id}"
        show(f'<p><a class="act main" href="{address}">Open the sequence for it</a></p>')


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
