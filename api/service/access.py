"""Access: a key in the `Authorization` header, and the scope that each route asks for.

As long as no key was ever made, a service on the loopback address is open to everybody at its computer: to requests for
a name of the loopback that no proxy has passed on.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends, Request
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from sqlalchemy.orm import Session
from starlette.requests import HTTPConnection

from api.service.context import Context, Services, services
from api.service.deadlines import looked_up, looked_up_soon
from api.service.problems import AccessError
from store.service.keys import ApiKey, count_keys, find_key
from store.states import Scope

LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
FORWARDED = frozenset({"forwarded", "via", "x-real-ip"})
"""Headers that proxies add, beside those that begin with X-Forwarded."""
# Apart from the threads in which requests wait for the store, so that a stop waits for none of those.
_key_lookup = ThreadPoolExecutor(2, thread_name_prefix="key lookup")
_bearer = HTTPBearer(
    auto_error=False, scheme_name="key", description="A key made by `jointlab key create`, with its scopes."
)


@dataclass(frozen=True)
class Caller:
    """The sender of a request.

    Attributes:
        name: for the audit log and the history of runs.
        scopes: permissions.
    """

    name: str
    scopes: frozenset[Scope]


def is_at_this_computer(connection: HTTPConnection) -> bool:
    """Whether a request or socket is addressed to the loopback by name, and no proxy says that it comes from elsewhere.

    A page of another origin would use another name. A proxy at this computer connects from here for everybody.
    """
    passed_on = any(name in FORWARDED or name.startswith("x-forwarded") for name in connection.headers)
    return connection.url.hostname in LOOPBACK_NAMES and not passed_on


def stranger(connection: HTTPConnection) -> str:
    """A caller without a key, by its address, for the audit log."""
    return "unknown caller" if connection.client is None else f"unknown caller at {connection.client.host}"


def authenticate(context: Services, secret: str | None, here: bool) -> Caller:
    """The caller with this key, or anybody at this computer where no key is needed.

    Args:
        secret: of the key; None where none was given.
        here: whether the caller is at this computer; elsewhere a key is always needed.

    Raises:
        AccessError: the key is unknown, has ended or was revoked, or one is needed.
    """
    if secret is None:
        if context.loopback and here and not has_keys(context):
            return Caller("at this computer", frozenset(Scope))
        raise AccessError(401, "give a key: Authorization: Bearer jl_...; jointlab key create makes one")
    key = context.catalogue.read(known_key, secret)
    context.recent_keys.add(secret, key)
    return caller_with(context, key)


def known_key(session: Session, secret: str) -> ApiKey:
    """The key of a secret, valid or not. Raises AccessError where there is none."""
    key = find_key(session, secret)
    if key is None:
        raise AccessError(401, "this key is not known here; jointlab key create makes one")
    return key


def has_keys(context: Services) -> bool:
    """Whether a key was ever made. The database is asked until there is one: keys are revoked, but not removed."""
    if not context.has_keys.is_set():
        with context.catalogue.reading() as session:
            if count_keys(session):
                context.has_keys.set()
    return context.has_keys.is_set()


def caller_with(context: Services, key: ApiKey) -> Caller:
    """The caller with this key. Raises AccessError where it has ended or was revoked."""
    if key.revoked_at is not None:
        raise AccessError(401, f"{name_of(key)} was revoked at {key.revoked_at:%Y-%m-%d %H:%M} UTC")
    if not key.is_valid(context.now()):
        raise AccessError(401, f"{name_of(key)} ended at {key.expires_at:%Y-%m-%d %H:%M} UTC")
    return Caller(name_of(key), key.scopes)


def name_of(key: ApiKey) -> str:
    """The name of the caller with a key."""
    return f"key {key.id} ({key.name})"


async def caller_of(request: Request, *, soon: bool = False) -> Caller:
    """The sender of a request, who is looked up once.

    Raises:
        AccessError: as in `authenticate`.
        StoreError: the database does not answer, or not in time, which is shorter where it has to be `soon`.
    """
    if not hasattr(request.state, "caller"):
        given = await _bearer(request)
        secret = None if given is None else given.credentials
        context = await services(request)
        if request.method == "GET" and secret is not None and (recent := context.recent_keys.get(secret)) is not None:
            request.state.caller = caller_with(context, recent)
        else:
            here = is_at_this_computer(request)
            wait = looked_up_soon if soon else looked_up
            request.state.caller = await wait(_key_lookup, authenticate, context, secret, here)
    found: Caller = request.state.caller
    return found


async def caller(request: Request, _given: Annotated[HTTPAuthorizationCredentials | None, Depends(_bearer)]) -> Caller:
    """A dependency: the sender of a request. The schema has from `_given` that a key is wanted."""
    return await caller_of(request)


def check_scope(who: Caller, scope: Scope) -> None:
    """Check that a caller has a scope.

    Raises:
        AccessError: the caller has not.
    """
    if scope not in who.scopes:
        raise AccessError(403, f"this needs the scope {scope}; {who.name} has {', '.join(sorted(who.scopes))}")


def needs(scope: Scope) -> Any:
    """A dependency: the caller, if it has `scope`."""

    async def check(who: Annotated[Caller, Depends(caller)]) -> Caller:  # waits for nothing, so it needs no thread
        check_scope(who, scope)
        return who

    return Depends(check)


Reader = Annotated[Caller, needs(Scope.READ)]
Controller = Annotated[Caller, needs(Scope.CONTROL)]
Admin = Annotated[Caller, needs(Scope.ADMIN)]


async def _for_readers(_caller: Reader, context: Context) -> Services:
    return context


ReaderContext = Annotated[Services, Depends(_for_readers)]
"""The services, for a caller who may read."""
