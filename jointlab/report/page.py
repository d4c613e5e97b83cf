"""Sections as one file that loads nothing from outside: HTML, or PDF, which Chromium prints from it."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from jointlab.errors import JointlabError
from jointlab.report.laboratory import NO_LABORATORY, LaboratorySettings
from jointlab.report.section import Section
from jointlab.report.typography import kept_together
from store.extras import explained_imports
from store.version import software_version

if TYPE_CHECKING:
    import jinja2

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
INSTALL = "apt install chromium, or dnf install chromium"
LONGEST = 120.0  # s; a report with all its pictures takes a few
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
) -> None:
    """Write sections as one page that loads nothing from outside.

    Args:
        title, lead: heading, and the sentence under it.
        sections: in order.
        path: the file; one that ends in .pdf is printed from the same HTML.
        front: sections of a first page of their own, after which come the contents.
        laboratory: shown at the head.
        intervals: confidence of all intervals that do not state their own.

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
            path.write_bytes(printed(text))
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


def printed(html: str) -> bytes:
    """A page as PDF.

    Raises:
        JointlabError: there is no Chromium here, or it does not print.
    """
    program = next((found for name in PROGRAMS if (found := shutil.which(name))), None)
    if program is None:
        raise JointlabError(
            f"printing a PDF needs Chromium, and none of {', '.join(PROGRAMS)} is on the path of this computer; "
            f"install Chromium ({INSTALL}) or Google Chrome, or write HTML and print it from a browser"
        )
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page, made = Path(folder, "report.html"), Path(folder, "report.pdf")
        page.write_text(html, encoding="utf-8")
        command = [
            program, "--headless", "--disable-gpu", "--no-pdf-header-footer", "--generate-pdf-document-outline",
            f"--user-data-dir={folder}/profile", f"--print-to-pdf={made}", page.as_uri(),
        ]  # fmt: skip
        if os.name == "posix" and os.geteuid() == 0:
            command.insert(1, "--no-sandbox")  # as root it starts in no other way; the page has no scripts
        try:
            ended = subprocess.run(command, capture_output=True, timeout=LONGEST, check=False)
        except subprocess.TimeoutExpired as error:
            raise JointlabError(f"{program} has not printed the report within {LONGEST:g} s") from error
        if ended.returncode or not made.is_file():
            said = ended.stderr.decode(errors="replace").strip().splitlines()
            raise JointlabError(f"{program} does not print the report: {said[-1] if said else ended.returncode}")
        return made.read_bytes()
