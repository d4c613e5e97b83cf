"""Shared by the commands: consoles, sections as text, the catalogue that the configuration names, files to write.

What takes long to import is imported where it is used, here and in the commands, so that `--help` answers at once.
"""

from __future__ import annotations

import errno
import json
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryDirectory
from typing import TYPE_CHECKING, Any

from api.commands.console import PlainConsole, visible
from jointlab.errors import JointlabError
from store.progress import Advance

if TYPE_CHECKING:
    from jointlab.report.section import Cell, Section, Table
    from jointlab.settings import Settings
    from store.catalogue import Catalogue
    from store.exchange.bundle import Bundle

out = PlainConsole(soft_wrap=True)
progress_console = PlainConsole(stderr=True)
LARGEST_RUN = 999_999_999  # an integer in every database
PICTURES = (".svg", ".png")
"""Endings of pictures that a command draws."""


def open_catalogue(settings: Settings | None = None) -> Catalogue:
    """The catalogue that the configuration names.

    Raises:
        SettingsError: the configuration does not fit.
        StoreError: the database cannot be opened.
    """
    from jointlab.settings import load_settings
    from store.catalogue import Catalogue

    settings = settings or load_settings()
    return Catalogue.open(settings.database_url, settings.waveform_folder, settings.database_limits, settings.rig)


def check_line(text: str, option: str) -> None:
    """Check a name that a person has written in one line. Raises JointlabError, which names the option."""
    from pydantic import TypeAdapter, ValidationError

    from jointlab.documents.fields import OneLine
    from store.validation import faults_text

    try:
        TypeAdapter[str](OneLine).validate_python(text)
    except ValidationError as error:
        raise JointlabError(faults_text(error.errors(), option)) from error


def run_number(target: str) -> int | None:
    """The number of a run where `target` is one, None where it is something else, such as a longer row of digits."""
    return int(target) if target.isdecimal() and len(target) <= len(str(LARGEST_RUN)) else None


def bundle_with_notes(target: str) -> Bundle:
    """The bundle at a path; what was ignored, converted or taken otherwise in it is said on standard error.

    Raises:
        StoreError: it is refused; the message names the file, and the key or the line.
    """
    from store.exchange.bundle import read_bundle

    found = read_bundle(Path(target))
    for warning in found.warnings:
        progress_console.print(f"note: {warning}", soft_wrap=True, markup=False)
    return found


@contextmanager
def progress_bar(what: str, total: int) -> Iterator[Advance]:
    """A progress bar with what is done now under it; where standard error is no terminal, one line at the end."""
    from api.commands.worded_progress import WordedProgress

    with WordedProgress(what, total, progress_console) as bar:
        try:
            yield bar.tell
        finally:
            bar.words = ""  # a first answer does not outlive the work
    if not progress_console.is_terminal:
        progress_console.print(f"{what}: {total} in {bar.seconds:.1f} s")


def show_sections(sections: Sequence[Section]) -> None:
    """Print sections without their pictures; one that holds nothing else is left out."""
    from jointlab.report.section import Notice, Picture, Table

    for section in sections:
        shown = [item for item in section.content if not isinstance(item, Picture)]
        if shown:
            out.print(f"\n{section.title}", style="bold")
        for item in shown:
            match item:
                case Table():
                    show_table(item)
                case Notice(text, failed):
                    out.print(text, style="red" if failed else "yellow")
                case text:
                    out.print(text)


def show_table(table: Table) -> None:
    """Print a table; one of a single column is a list."""
    from rich import table as rich

    out.print(f"{table.caption}:")
    rows = [[_text(cell) for cell in row] for row in table.rows]
    if len(table.head) == 1:
        for (cell,) in rows:
            out.print(f"  {cell}")
        return
    widths, between = _widths(table.head, rows, INTERVAL, out.width - 2 * len(table.head)), INTERVAL
    if sum(widths) > out.width - 2 * len(table.head):
        between, rows = "…", [[cell.replace(INTERVAL, "…") for cell in row] for row in rows]
        widths = _widths(table.head, rows, between, out.width - len(table.head))
    columns = [rich.Column(head, width=width, overflow="fold") for head, width in zip(table.head, widths, strict=True)]
    printed = rich.Table(*columns, box=None, pad_edge=False, padding=(0, 2 if between == INTERVAL else 1, 0, 0))
    for row in rows:
        printed.add_row(*row)
    out.print(printed)


INTERVAL = " … "


def _widths(head: Sequence[str], rows: Sequence[Sequence[str]], between: str, room: int) -> list[int]:
    """Widths of columns that fit into `room` if words, and intervals with `between` their ends, can stay whole."""
    from rich.cells import cell_len

    whole = re.compile(rf"\S+{between}\S+|\S+")
    columns = list(zip(head, *rows, strict=True))
    widths = [max(map(cell_len, cells)) for cells in columns]
    least = [max(cell_len(part) for cell in cells for part in whole.findall(cell) or [""]) for cells in columns]
    while sum(widths) > room and widths != least:
        slack = [width if width > at_least else 0 for width, at_least in zip(widths, least, strict=True)]
        widths[slack.index(max(slack))] -= 1
    return widths


def _text(cell: Cell) -> str:
    from jointlab.report.section import Unknown

    if isinstance(cell, str):
        return visible(cell)
    return visible(f"{cell.text} ({cell.why})" if isinstance(cell, Unknown) else cell.text)


def check_writable(*paths: Path | None, read: Iterable[Path | None] = ()) -> None:
    """Check that files can be written, before their content is computed; None stands for no file.

    Args:
        paths: to write.
        read: what the command reads, which is not to be lost.

    Raises:
        JointlabError: one cannot be written, is read as well, or is named twice.
    """
    wanted = [path.resolve() for path in paths if path is not None]
    kept = [path.resolve() for path in read if path is not None]
    for path in wanted:
        if path in kept:
            raise JointlabError(f"{path.name} is what this command reads; name another file to write")
        if wanted.count(path) > 1:
            raise JointlabError(f"{path.name} is to be written twice; give each result a file of its own")
    for path in filter(None, paths):
        try:
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            with NamedTemporaryFile(dir=path.parent):
                pass
        except OSError as error:
            raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error


def write_json(document: dict[str, Any], path: Path) -> None:
    """Write a document for other programs; a file is whole or not there.

    Raises:
        JointlabError: the file cannot be written.
    """
    text = json.dumps(document, indent=1, allow_nan=False) + "\n"
    try:
        with TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as folder:  # of the same disk
            scratch = Path(folder) / path.name
            scratch.write_text(text, encoding="utf-8")
            scratch.replace(path)
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error
