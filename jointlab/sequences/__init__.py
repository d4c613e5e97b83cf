"""Sequences by name: the built-in ones of the paper and of the suspended beam, and those in the store."""

from collections.abc import Mapping
from importlib import resources
from typing import Any

import yaml
from sqlalchemy.orm import Session

from jointlab.documents.runs import SequenceSummary
from jointlab.errors import ConflictError
from rig.sequences.sequence import Sequence, SequenceError, sequence_from
from rig.sequences.sequence_file import load_sequence
from store.exchange.bundle_setup import Article
from store.measurements.runs import Run
from store.service.sequence_documents import (
    SequenceDocument,
    get_sequence,
    list_with_names,
    remove_sequence_document,
    save_sequence_document,
)

BUILT_IN = "paper"
SUSPENDED = "suspended"
NAMES = (BUILT_IN, SUSPENDED)


def sequence_of(run: Run) -> Sequence | None:
    """The sequence of a run, on the article as it was amended last; None where it was imported.

    Raises SequenceError where it cannot be run as it stands.
    """
    if not run.sequence:
        return None
    amended = {name: run.setup[name] for name in Article.model_fields if name in run.setup}
    article = run.sequence.get("article", {}) | amended
    try:
        return sequence_from(run.sequence | {"article": article}, f"sequence of run {run.id}")
    except SequenceError as error:
        raise SequenceError(f"{error}; jointlab amend {run.id} corrects values of the article") from error


def built_in(name: str) -> Sequence:
    """One of `NAMES`. Raises SequenceError where the document cannot be run as it stands."""
    with resources.as_file(resources.files(__name__) / f"{name}.yaml") as path:
        return load_sequence(path)


def list_sequences(session: Session, *, after: str, limit: int) -> list[SequenceSummary]:
    """Built-in and stored sequences by name, from the one behind `after` on; one stored as a built-in one is hidden."""
    return [_summary(name, stored) for name, stored in list_with_names(session, NAMES, after=after, limit=limit)]


def _summary(name: str, stored: SequenceDocument | None) -> SequenceSummary:
    if stored is None or name in NAMES:
        return SequenceSummary(name=name, title=built_in(name).title, built_in=True, changed_at=None)
    title = str(stored.document.get("title", ""))
    return SequenceSummary(name=name, title=title, built_in=False, changed_at=stored.changed_at)


def text_of(session: Session, name: str) -> str:
    """The YAML text of a built-in sequence, as it was written, or of a stored one, which may have become invalid.

    Raises NotFoundError where there is none of this name.
    """
    if name in NAMES:
        return resources.files(__name__).joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    return to_yaml(get_sequence(session, name).document)


def to_yaml(document: Mapping[str, Any]) -> str:
    """The YAML text of a document of plain values, without the keys that have no value."""
    return yaml.safe_dump(
        {key: value for key, value in document.items() if value is not None},
        sort_keys=False, allow_unicode=True, width=110, default_flow_style=None,
    )  # fmt: skip


def save_sequence(session: Session, name: str, sequence: Sequence) -> None:
    """Store a sequence under a name, in place of the one that was there. Raises ConflictError where it is built in."""
    if name in NAMES:
        raise ConflictError(f"{name} is built in; choose another name")
    save_sequence_document(session, name, sequence.model_dump(mode="json", exclude_none=True))


def delete_sequence(session: Session, name: str) -> None:
    """Delete a stored sequence. Raises ConflictError where it is built in, NotFoundError where there is none."""
    if name in NAMES:
        raise ConflictError(f"{name} is built in and cannot be deleted")
    remove_sequence_document(session, name)


def sequence_named(session: Session, name: str) -> Sequence:
    """A built-in sequence, or a stored one.

    Raises NotFoundError where there is none of this name, SequenceError where the stored document is no sequence any
    more.
    """
    if name in NAMES:
        return built_in(name)
    return sequence_from(get_sequence(session, name).document, f"sequence {name}")
