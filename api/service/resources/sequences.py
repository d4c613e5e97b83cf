"""Sequences: documents that say what is measured, kept under names; `paper` and `suspended` are always there."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Path, Response
from pydantic import BaseModel
from sqlalchemy.orm import Session

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import Name, WholeSequence
from api.service.etags import IfMatch, TaggedRoute, check_unchanged, tag_of
from api.service.idempotent_requests import Act, acting
from api.service.links import links
from api.service.pages import Cursor, Limit, Page, from_cursor, page_of
from api.service.problems import problems
from jointlab.errors import ConflictError, JointlabError
from jointlab.sequences import NAMES, built_in
from rig.sequence import Sequence, sequence_from
from store.errors import NotFoundError
from store.sequence_documents import SequenceDocument, get_sequence, list_sequences, remove_sequence, save_sequence
from store.states import Scope

router = APIRouter(prefix="/sequences", tags=["sequences"], route_class=TaggedRoute)
NEXT = links(200, "name", "sequences-get", "sequences-delete", field="name")
SequenceName = Annotated[Name, Path(description="name of the sequence")]


class SequenceSummary(BaseModel):
    """A sequence's name, and when it was changed."""

    name: str
    title: str
    changed_at: datetime

    @classmethod
    def of(cls, kept: SequenceDocument) -> SequenceSummary:
        """What is shown of a document in a list."""
        return cls(name=kept.name, title=str(kept.document.get("title", "")), changed_at=kept.changed_at)


class NamedSequence(BaseModel):
    """A sequence and its name."""

    name: str
    sequence: Sequence


@router.get("", responses=problems(401, 403))
def list_(_who: Reader, context: Context, limit: Limit = 100, cursor: Cursor = None) -> Page[SequenceSummary]:
    """List the sequences that are kept, by name; the built-in ones are not among them."""
    after = from_cursor(cursor) or ""
    if "\0" in after:
        raise JointlabError(f"{cursor!r} is no cursor of this list; give `next` of the page before")
    with context.catalogue.reading() as session:
        found = list_sequences(session, after=after, limit=limit + 1)
    return page_of([SequenceSummary.of(each) for each in found], limit, lambda each: each.name)


@router.get("/{name}", responses=problems(401, 403, 404))
def get(_who: Reader, context: Context, name: SequenceName) -> NamedSequence:
    """One sequence, as a run carries it out."""
    with context.catalogue.reading() as session:
        return NamedSequence(name=name, sequence=sequence_named(session, name))


@router.put("/{name}", response_model=NamedSequence, responses=problems(401, 403, 409, 412) | NEXT)
def put(
    act: Annotated[Act, acting("keep sequence", "sequence {name}", Scope.CONTROL)],
    context: Context,
    name: SequenceName,
    sequence: WholeSequence,
    if_match: IfMatch = None,
) -> Response:
    """Keep a sequence under a name, in place of what was there."""
    if name in NAMES:
        raise ConflictError(f"{name} is built in; choose another name")

    def keep() -> NamedSequence:
        with context.catalogue.writing() as session:
            check_unchanged(if_match, _tag(session, name))
            save_sequence(session, name, sequence.model_dump(mode="json"))
        return NamedSequence(name=name, sequence=sequence)

    return act.once(keep)


@router.delete("/{name}", status_code=204, response_class=Response, responses=problems(401, 403, 404, 409, 412))
def delete(
    act: Annotated[Act, acting("forget sequence", "sequence {name}", Scope.CONTROL)],
    context: Context,
    name: SequenceName,
    if_match: IfMatch = None,
) -> Response:
    """Forget a sequence; runs keep their own copy."""

    def remove() -> None:
        with context.catalogue.writing() as session:
            check_unchanged(if_match, _tag(session, name))
            remove_sequence(session, name)

    return act.once(remove, 204)


def sequence_named(session: Session, name: str) -> Sequence:
    """A sequence by its name.

    Raises:
        NotFoundError: there is none.
        SequenceError: what is kept under it is no sequence any more.
    """
    if name in NAMES:
        return built_in(name)
    return sequence_from(get_sequence(session, name).document, f"sequence {name}")


def _tag(session: Session, name: str) -> str | None:
    try:
        kept = NamedSequence(name=name, sequence=sequence_named(session, name))
    except NotFoundError:
        return None
    return tag_of(kept.model_dump_json().encode())
