"""Routes of sequences by name: those that are stored, and the built-in `paper` and `suspended`."""

from typing import Annotated

from fastapi import APIRouter, Path, Response
from sqlalchemy.orm import Session

from api.service.access import ReaderContext
from api.service.etags import IfMatch, TaggedRoute, check_unchanged, tag_of
from api.service.idempotent_requests import IdempotentRequest, idempotent
from api.service.pages import Page, Paging
from api.service.parameters import links
from api.service.problems import problems
from jointlab.documents.fields import Name, WholeSequence
from jointlab.documents.runs import NamedSequence, SequenceSummary
from jointlab.sequences import delete_sequence, list_sequences, save_sequence, sequence_named
from store.errors import NotFoundError
from store.service.sequence_documents import lock_sequence
from store.states import Scope

router = APIRouter(prefix="/sequences", tags=["sequences"], route_class=TaggedRoute)
NEXT = links(200, "name", "sequences-get", "sequences-delete", field="name")
SequenceName = Annotated[Name, Path(description="name of the sequence")]


@router.get("", responses=problems())
def list_(context: ReaderContext, paging: Paging) -> Page[SequenceSummary]:
    """List all sequences, stored and built-in ones, by name."""
    after = paging.key or ""
    if "\0" in after:
        raise paging.foreign_cursor()
    return paging.of_rows(context.catalogue.read(list_sequences, after=after, limit=paging.rows), "name")


@router.get("/{name}", responses=problems(404))
def get(context: ReaderContext, name: SequenceName) -> NamedSequence:
    """One sequence, as a run carries it out."""
    with context.catalogue.reading() as session:
        return NamedSequence(name=name, sequence=sequence_named(session, name))


@router.put("/{name}", response_model=NamedSequence, responses=problems(409, 412) | NEXT)
def put(
    request: Annotated[IdempotentRequest, idempotent("save sequence", "sequence {name}", Scope.CONTROL)],
    name: SequenceName,
    sequence: WholeSequence,
    if_match: IfMatch = None,
) -> Response:
    """Store a sequence under a name, in place of the one that was there."""

    def save() -> NamedSequence:
        with request.services.catalogue.writing() as session:
            check_unchanged(if_match, _tag(session, name))
            save_sequence(session, name, sequence)
        return NamedSequence(name=name, sequence=sequence)

    return request.once(save)


@router.delete("/{name}", status_code=204, response_class=Response, responses=problems(404, 409, 412))
def delete(
    request: Annotated[IdempotentRequest, idempotent("delete sequence", "sequence {name}", Scope.CONTROL)],
    name: SequenceName,
    if_match: IfMatch = None,
) -> Response:
    """Delete a stored sequence; runs keep their own copy."""

    def remove() -> None:
        with request.services.catalogue.writing() as session:
            check_unchanged(if_match, _tag(session, name))
            delete_sequence(session, name)

    return request.once(remove, 204)


def _tag(session: Session, name: str) -> str | None:
    """The tag of a sequence, None where there is none; it stays that until the transaction ends."""
    lock_sequence(session, name)
    try:
        kept = NamedSequence(name=name, sequence=sequence_named(session, name))
    except NotFoundError:
        return None
    return tag_of(kept.model_dump_json().encode())
