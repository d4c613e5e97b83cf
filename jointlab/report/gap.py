"""The gap diagnosis as one page, and as sections of a run's report."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jointlab.diagnosis import wording
from jointlab.diagnosis.law_text import effect_name, laws_found
from jointlab.report.gap_figures import before_and_after, curves, gap_map, law, shape
from jointlab.report.gap_tables import SIGNIFICANT, effects_table, parameters_table, places_table, ranking_table
from jointlab.report.page import write_page
from jointlab.report.section import Item, Notice, Picture, Section

SHOWN_PLACES, SHOWN_RANKS, SHOWN_CURVES = 8, 8, 2


def write_gap_report(document: Mapping[str, Any], path: Path, *, more: tuple[Section, ...] = ()) -> None:
    """Write a diagnosis as one HTML page that needs nothing from outside.

    Args:
        document: in the format jointlab-diagnosis/1.
        more: sections that come after the diagnosis's own.

    Raises:
        JointlabError: the file cannot be written.
    """
    title = f"{document.get('title', 'measurement')}: the gap between simulation and measurement"
    sections = [*gap_sections(document), *more]
    write_page(title, f"{_capital(wording.verdict_sentence(document))}.", sections, path, intervals="90 %")


def gap_sections(document: Mapping[str, Any]) -> list[Section]:
    """Verdict, places, explanations."""
    return [_verdict(document), _where(document), Section("Which effect", (ranking_table(document, SHOWN_RANKS),))]


def _verdict(document: Mapping[str, Any]) -> Section:
    status, verdict = document["verdict"]["status"], document["verdict"]
    content: list[Item] = [
        *(Notice(f"Fault in the measurement, which comes before all below: {text}.") for text in document["faults"]),
        *(f"Limit of this measurement: {text}." for text in document.get("lost", ())),
        f"{_capital(status)}: {wording.verdict_sentence(document)}.",
        f"{_capital(wording.probability_sentence(document))}.",
        f"{_capital(wording.rigs_sentence(document))}.",
        *(f"{_capital(text)}." for text in wording.beside(document)),
    ]
    if effects := effects_table(document):
        content.append(effects)
    if parameters := parameters_table(document):
        content.append(parameters)
    for each in laws_found(document):
        title = f"The law as found: {effect_name(each, document['titles'])}"
        content.append(Picture(title, law(each["law_found"], title)))
    content.append(Picture("How far: before and after", before_and_after(document["gap"])))
    content += _most_telling(document.get("curves", ()))
    if curve := wording.shape_of(document):
        title = _capital(wording.shape_title(curve))
        content.append(Picture(f"What would take up the rest: {title}", shape(curve, title)))
    if verdict["twins"]:
        content.append(f"{_capital(wording.confounded_sentence(document))}.")
    if asked := wording.next_experiment_words(document):
        content.append(f"Next experiment: {asked.rstrip('.')}.")
    return Section("The gap between simulation and measurement", tuple(content))


def _most_telling(drawn: Sequence[Mapping[str, Any]]) -> list[Item]:
    """The curves with the largest gap: one of each rig, or two of the only one."""
    firsts = [
        next(each for each in drawn if each["rig"] == rig) for rig in dict.fromkeys(each["rig"] for each in drawn)
    ]
    shown = firsts if len(firsts) > 1 else drawn[:SHOWN_CURVES]
    pictures = [Picture(_capital(wording.curve_words(each)), curves(each, wording.place_words(each))) for each in shown]
    return [wording.CURVES_NOTE, *pictures] if pictures else []


def _where(document: Mapping[str, Any]) -> Section:
    content: list[Item] = [
        f"The maps are of the paper's model without any effect. The colour of a cell is its share of all misfit beyond "
        f"noise in the map; cells below {SIGNIFICANT:g} standard deviations stay white. {wording.MAP_WARNING}",
        *(Picture(_capital(str(each["title"])), gap_map(each)) for each in document["maps"]),
    ]
    places = places_table(document, SHOWN_PLACES)
    return Section("Where it lies", (*content, *([] if places is None else [places])))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
