"""The list of all sequences that have a name."""

from sqlalchemy.orm import Session

from jointlab.documents.runs import SequenceSummary
from jointlab.sequences import NAMES, built_in
from store.service.sequence_documents import SequenceDocument, list_with_names


def list_sequences(session: Session, *, after: str, limit: int) -> list[SequenceSummary]:
    """Built-in and stored sequences by name, from the one behind `after` on; one stored as a built-in one is hidden."""
    return [_summary(name, stored) for name, stored in list_with_names(session, NAMES, after=after, limit=limit)]


def _summary(name: str, stored: SequenceDocument | None) -> SequenceSummary:
    if stored is None or name in NAMES:
        return SequenceSummary(name=name, title=built_in(name).title, built_in=True, changed_at=None)
    title = str(stored.document.get("title", ""))
    return SequenceSummary(name=name, title=title, built_in=False, changed_at=stored.changed_at)
