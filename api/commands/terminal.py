"""What the commands share: consoles, the catalogue that the configuration names, files that they write."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path
from typing import Any

from rich.console import Console

from jointlab.errors import JointlabError
from jointlab.settings import Settings, load_settings
from store.catalogue import Catalogue

# names and paths may hold brackets, which are no markup
out = Console(soft_wrap=True, highlight=False, markup=False)
progress_console = Console(stderr=True, highlight=False, markup=False)
LARGEST_RUN = 999_999_999  # an integer in every database


def open_catalogue(settings: Settings | None = None) -> Catalogue:
    """The catalogue that the configuration names.

    Raises:
        SettingsError: the configuration does not fit.
        StoreError: the database cannot be opened.
    """
    settings = settings or load_settings()
    return Catalogue.open(settings.database_url, settings.waveform_folder)


def run_number(target: str) -> int | None:
    """The number of a run where `target` is one, None where it is something else, such as a longer row of digits."""
    return int(target) if target.isdecimal() and len(target) <= len(str(LARGEST_RUN)) else None


def check_writable(path: Path) -> None:
    """Let a path pass that a file can be written to, before work is done whose result it is to hold.

    Raises:
        JointlabError: it cannot.
    """
    scratch = path.with_name(path.name + ".part")
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        scratch.touch()
        scratch.unlink()
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error


def write_json(document: dict[str, Any], path: Path) -> None:
    """Write a document for other programs; a file is whole or not there.

    Raises:
        JointlabError: the file cannot be written.
    """
    text = json.dumps(document, indent=1, allow_nan=False) + "\n"
    scratch = path.with_name(path.name + ".part")
    try:
        scratch.write_text(text, encoding="utf-8")
        scratch.replace(path)
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error
