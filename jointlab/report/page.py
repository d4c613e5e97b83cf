"""Sections as one file that loads nothing from outside: HTML, or PDF, which is printed from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from jointlab.errors import JointlabError
from jointlab.report.laboratory import NO_LABORATORY, LaboratorySettings
from jointlab.report.printing import printed, wanted
from jointlab.report.section import Section
from jointlab.report.typography import kept_together
from store.extras import explained_imports
from store.version import software_version

if TYPE_CHECKING:
    import jinja2

NARROW, MEDIUM = 3, 6
"""Columns that a table may have on a phone and on a tablet: the cells of wider ones stand below each other there."""


def write_page(
    title: str,
    lead: str,
    sections: Sequence[Section],
    path: Path,
    *,
    front: Sequence[Section] = (),
    laboratory: LaboratorySettings = NO_LABORATORY,
    intervals: str = "95 %",
    still_wanted: Callable[[], object] = wanted,
) -> None:
    """Write sections as one page that loads nothing from outside.

    Args:
        title, lead: heading, and the sentence under it.
        sections: in order.
        path: the file; one that ends in .pdf is printed from the same HTML.
        front: sections of a first page of their own, after which come the contents.
        laboratory: shown at the head.
        intervals: confidence of all intervals that do not state their own.
        still_wanted: called while a PDF is printed; an error that it raises ends printing and is passed on.

    Raises:
        JointlabError: the file cannot be written, the logo cannot be read, or there is no Chromium to print with.
    """
    text = _template().render(
        title=title,
        lead=lead,
        written=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        version=software_version(),
        sections=sections,
        front=front,
        laboratory=laboratory,
        logo=laboratory.logo_data(),
        footer=_css_text(title),
        intervals=intervals,
    )
    try:
        if path.suffix.lower() == ".pdf":
            path.write_bytes(printed(text, still_wanted))
        else:
            path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error


def _css_text(text: str) -> str:
    """Text for a string of CSS."""
    return "".join(each if each.isalnum() or each == " " else f"\\{ord(each):06x}" for each in text)


def _template() -> jinja2.Template:
    with explained_imports():
        import jinja2
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("jointlab.report", ""),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["kept"] = kept_together
    environment.globals.update(narrow=NARROW, medium=MEDIUM)
    return environment.get_template("report.html")
