"""Tables of a diagnosis: terminal, report and page show the same ones."""

from collections.abc import Mapping
from typing import Any

from jointlab.diagnosis import wording
from jointlab.report.section import Share, Table, number

SIGNIFICANT = 3.0
"""Standard deviations below which a cell of a map stays white: noise alone would colour it now and then."""


def ranking_table(document: Mapping[str, Any], count: int | None = None) -> Table:
    """The `count` most probable explanations, or all."""
    rows = tuple(
        (
            wording.ranked_name(each["effects"], document["titles"]),
            "; ".join(law for law in each.get("laws", {}).values() if law),
            Share.of(each["probability"], 1),
            wording.percent(each.get("held_out_gap_percent")),
            "–" if each.get("explained") is None else f"{100 * each['explained']:.0f} %",
        )
        for each in document["ranking"][:count]
    )
    head = ("explanation", "law", "probability", "gap with it", "misfit explained")
    return Table("Explanations, the most probable first", head, rows)


def effects_table(document: Mapping[str, Any]) -> Table | None:
    """Each effect that may be there; None where none is likely, or for diagnoses of earlier versions."""
    rows = tuple(
        (
            document["titles"].get(each["id"], each["id"]),
            Share.of(each["probability"], 1),
            wording.MECHANISMS[each["mechanism"]],
            wording.law_words(each),
        )
        for each in document.get("effects", ())
    )
    head = ("effect", "probability", "mechanism", "law")
    return Table("Effects, each by the probability that it is part of the explanation", head, rows) if rows else None


def parameters_table(document: Mapping[str, Any]) -> Table | None:
    """Parameters of the verdict's effects; None where no effect is named."""
    rows = tuple(wording.parameter_lines(document))
    return Table("Parameters of the effects", ("effect", "parameter", "value", "90 %"), rows) if rows else None


def places_table(document: Mapping[str, Any], count: int | None = None) -> Table | None:
    """The `count` places with the largest shares of the misfit, or all; None where there is no misfit."""
    rows = tuple(
        (
            wording.place_words(place),
            wording.band_words(place),
            str(place["part"]),
            Share.of(place["share"]),
            number(place["significance"]),
        )
        for place in document["where"][:count]
    )
    head = ("place", "band", "mostly", "share", "standard deviations")
    return Table(wording.places_caption(document), head, rows) if rows else None
