"""Routes for administrators: keys of the service, and the audit log."""

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from pydantic import AwareDatetime, BaseModel, Field

from api.service.access import Admin
from api.service.context import Context
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest, idempotent
from api.service.pages import Page, Paging
from api.service.parameters import document, links, number_of
from api.service.problems import problems
from jointlab import access_keys
from jointlab.documents.fields import OneLine, Request
from jointlab.errors import JointlabError
from store.service.audit import list_audit_entries
from store.service.keys import ApiKey, add_key, list_keys
from store.states import Scope

keys = APIRouter(prefix="/keys", tags=["keys"], route_class=TaggedRoute)
audit = APIRouter(prefix="/audit", tags=["audit"], route_class=TaggedRoute)


class KeyDocument(BaseModel):
    """A key, without its secret; times are UTC."""

    id: int
    name: str
    scopes: list[Scope]
    created_at: datetime
    expires_at: datetime | None
    revoked_at: datetime | None


class MadeKey(KeyDocument):
    """A new key; its secret is shown this once, and null in a repeat of the answer."""

    secret: str | None


class NewKey(Request):
    """Name, scopes and end of a new key."""

    name: OneLine
    scopes: list[Scope] = Field(min_length=1, max_length=len(Scope))
    expires_at: AwareDatetime | None = None


class AuditDocument(BaseModel):
    """One entry of the audit log; times are UTC."""

    id: int
    at: datetime
    who: str
    action: str
    target: str
    outcome: str = Field(description="begun, done, refused and why, or why it failed")
    details: dict[str, Any] = Field(
        description="what else was given; `begun` is the entry of the beginning of the action"
    )


@keys.get("", name="list_", responses=problems())
def list_all_keys(_caller: Admin, context: Context, paging: Paging) -> Page[KeyDocument]:
    """List keys, newest first, revoked and ended ones too."""
    found = context.catalogue.read(list_keys, before=paging.number, limit=paging.rows)
    return paging.of_rows([_key(each) for each in found])


@keys.post("", status_code=201, response_model=MadeKey, responses=problems(409) | links(201, "key_id", "keys-revoke"))
def create(
    request: Annotated[IdempotentRequest, idempotent("create key", "keys", Scope.ADMIN)], given: NewKey
) -> Response:
    """Make a key; its secret is in this answer and nowhere else."""

    def make() -> MadeKey:
        with request.services.catalogue.writing() as session:
            key, secret = add_key(session, given.name, given.scopes, given.expires_at)
        return MadeKey(**_key(key).model_dump(), secret=secret)

    if given.expires_at is not None and given.expires_at <= request.services.now():
        raise JointlabError(f"a key that ends at {given.expires_at} would open nothing; give a later time")
    return request.once(make, 201, secret="secret", **given.model_dump(mode="json"))


@keys.post("/{key_id}/revoke", response_model=KeyDocument, responses=problems(404, 409))
def revoke(
    request: Annotated[IdempotentRequest, idempotent("revoke key", "key {key_id}", Scope.ADMIN)],
    key_id: Annotated[int, number_of("key")],
) -> Response:
    """Let a key open nothing from now on."""

    def end() -> KeyDocument:
        with request.services.catalogue.writing() as session:
            revoked = access_keys.revoke(session, key_id)
        request.services.recent_keys.clear()
        return _key(revoked)

    return request.once(end)


@audit.get("", name="list_", responses=problems())
def list_entries(
    _caller: Admin,
    context: Context,
    paging: Paging,
    action: Annotated[OneLine | None, Query(description="start run, stop, ...")] = None,
) -> Page[AuditDocument]:
    """List entries of the audit log, newest first."""
    found = context.catalogue.read(list_audit_entries, action=action, before=paging.number, limit=paging.rows)
    return paging.of_rows([document(AuditDocument, each) for each in found])


def _key(key: ApiKey) -> KeyDocument:
    return document(KeyDocument, key, scopes=sorted(key.scopes))
