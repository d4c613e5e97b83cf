"""Keys of the service: made, listed and revoked by whoever has the scope admin."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Response
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from api.service.access import Admin
from api.service.context import Context
from api.service.documents import Words, number_of
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act, acting
from api.service.links import links
from api.service.pages import Cursor, Limit, Page, number_from, page_of
from api.service.problems import problems
from jointlab.errors import JointlabError
from store.keys import ApiKey, add_key, list_keys, revoke_key
from store.states import Scope

router = APIRouter(prefix="/keys", tags=["keys"], route_class=TaggedRoute)


class KeyDocument(BaseModel):
    """A key, without its secret; times are UTC."""

    id: int
    name: str
    scopes: list[Scope]
    created_at: datetime
    expires_at: datetime | None
    revoked_at: datetime | None

    @classmethod
    def of(cls, key: ApiKey) -> KeyDocument:
        """What is shown of a key."""
        return cls(**(vars(key) | {"scopes": sorted(key.scopes)}))


class MadeKey(KeyDocument):
    """A key that was made just now; its secret is shown this once, and null in a repeat of the answer."""

    secret: str | None


class NewKey(BaseModel):
    """What a key is for."""

    model_config = ConfigDict(extra="forbid")

    name: Words
    scopes: list[Scope] = Field(min_length=1, max_length=len(Scope))
    expires_at: AwareDatetime | None = None


@router.get("", responses=problems(401, 403))
def list_(_who: Admin, context: Context, limit: Limit = 100, cursor: Cursor = None) -> Page[KeyDocument]:
    """List keys, newest first, revoked and ended ones too."""
    with context.catalogue.reading() as session:
        found = list_keys(session, before=number_from(cursor), limit=limit + 1)
    return page_of([KeyDocument.of(key) for key in found], limit, lambda key: key.id)


@router.post(
    "", status_code=201, response_model=MadeKey, responses=problems(401, 403, 409) | links(201, "key_id", "keys-revoke")
)
def create(
    act: Annotated[Act, acting("create key", "keys", Scope.ADMIN)], context: Context, wanted: NewKey
) -> Response:
    """Make a key; its secret is in this answer and nowhere else."""

    def make() -> MadeKey:
        with context.catalogue.writing() as session:
            key, secret = add_key(session, wanted.name, wanted.scopes, wanted.expires_at)
        return MadeKey(**KeyDocument.of(key).model_dump(), secret=secret)

    if wanted.expires_at is not None and wanted.expires_at <= context.now():
        raise JointlabError(f"a key that ends at {wanted.expires_at} would open nothing; give a later time")
    return act.once(make, 201, secret="secret", **wanted.model_dump(mode="json"))


@router.post("/{key_id}/revoke", response_model=KeyDocument, responses=problems(401, 403, 404, 409))
def revoke(
    act: Annotated[Act, acting("revoke key", "key {key_id}", Scope.ADMIN)],
    context: Context,
    key_id: Annotated[int, number_of("key")],
) -> Response:
    """Let a key open nothing from now on."""

    def end() -> KeyDocument:
        with context.catalogue.writing() as session:
            return KeyDocument.of(revoke_key(session, key_id))

    return act.once(end)
