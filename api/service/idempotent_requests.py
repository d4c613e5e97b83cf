"""Requests that act: each is done once however often it is sent, and noted in the audit log with its outcome.

Each has an `Idempotency-Key` of its sender's choice. Sent again with the same key, it gets the first answer. A page of
another origin cannot send that header, so it cannot act in the name of the person who reads it.

A route declares its action by a dependency: `idempotent` asks for a scope, `driving` for the control lease, too. So a
refused action has the same name in the log as one that is done.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any
from urllib.parse import quote

from anyio import to_thread
from fastapi import Depends, Header, Request, Response
from pydantic import BaseModel
from sqlalchemy.orm import Session

from api.service.access import Caller, caller, check_scope
from api.service.context import Context, Rig, Services
from api.service.parameters import IdempotencyKey
from api.service.problems import AccessError
from jointlab.audit import AuditedAction
from jointlab.errors import ConflictError
from jointlab.supervision.lease import LeaseError
from store.service.requests import Answered, answer_request, begin_request, find_request, forget_request
from store.states import Scope

REPLAYED = "Idempotency-Replayed"
LONGEST = 100
"""The most characters of a path's parameter that the audit log keeps."""
LeaseToken = Annotated[str | None, Header(alias="Control-Lease", description="token of the control lease")]


class KeyReusedError(ConflictError):
    """The idempotency key was used for another request, or for one whose answer is not known."""


@dataclass(frozen=True)
class IdempotentRequest:
    """A request that acts.

    Attributes:
        services: of the application that it came to.
        caller: who sent it.
        action: that is asked for, as the audit log has it.
        key: its idempotency key.
        fingerprint: of what is asked for.
        lease: number of the lease that its caller has; None where it needs none.
    """

    services: Services
    caller: Caller
    action: AuditedAction
    key: str
    fingerprint: str
    lease: int | None = None

    def once(
        self, do: Callable[[], BaseModel | None], status: int = 200, *, secret: str | None = None, **details: Any
    ) -> Response:
        """Do it, if it was not done before, and answer with the document that `do` returns.

        Args:
            status: of the answer.
            secret: a field of the answer that is not stored; a repeat has null there.

        Raises:
            KeyReusedError: the key belongs to another request, or to one that is under way or was cut off.
            Exception: what `do` raises; the request may be sent again then.
        """
        action, begun, catalogue = replace(self.action, details=details), None, self.services.catalogue
        with catalogue.writing() as session:
            before = begin_request(session, self.caller.name, self.key, self.fingerprint)
            if before is None:
                begun = action.begin(session)
        if before is not None:
            return self._first_answer(before)

        def keep_answer(session: Session, made: BaseModel | None) -> None:
            kept = made if made is None or secret is None else made.model_copy(update={secret: None})
            answer_request(session, self.caller.name, self.key, status, _body(kept))

        def forget(session: Session) -> None:
            forget_request(session, self.caller.name, self.key)

        return _answer(_body(action.carry_out(catalogue, begun, do, keep_answer, forget)), status, {})

    def is_answered(self) -> bool:
        """Whether its key has an answer already; then nothing is done, whatever is asked for with it."""
        before = self.services.catalogue.read(find_request, self.caller.name, self.key)
        return before is not None and before.status is not None

    async def refuse_unless_answered(self, error: LeaseError) -> None:
        """Note that it was refused for `error`, and raise that; a request that was answered before gets its answer."""
        if not await to_thread.run_sync(self.is_answered):
            await self.refused(error)
            raise error

    async def refused(self, error: AccessError | LeaseError) -> None:
        """Note that it was refused."""
        await to_thread.run_sync(self.services.refusals.note, self.services.catalogue, self.action, str(error))

    def _first_answer(self, before: Answered) -> Response:
        if before.fingerprint != self.fingerprint:
            raise KeyReusedError(f"Idempotency-Key {self.key!r} was used for another request; use a new one")
        if before.status is None or before.body is None:
            raise KeyReusedError(
                f"the request with Idempotency-Key {self.key!r} is under way, or was cut off; see what came of it, "
                "then use a new key"
            )
        return _answer(before.body, before.status, {REPLAYED: "true"})


def idempotent(action: str, target: str, scope: Scope, *, moves: bool = False) -> Any:
    """A dependency: the request to act, if `scope` is open to its caller.

    Args:
        action: such as "start run".
        target: such as "run {run_id}", with parameters of the path.
        scope: that opens it.
        moves: whether it moves the machine.
    """

    async def permitted(
        request: Request, context: Context, who: Annotated[Caller, Depends(caller)], key: IdempotencyKey
    ) -> IdempotentRequest:
        asked = f"{request.method} {request.url.path}?{request.url.query}\n".encode() + await request.body()
        audited = AuditedAction(who.name, action, _filled(target, request.path_params), moves)
        found = IdempotentRequest(context, who, audited, key, hashlib.sha256(asked).hexdigest())
        try:
            check_scope(who, scope)
        except AccessError as error:
            await found.refused(error)
            raise
        return found

    return Depends(permitted)


def driving(action: str, target: str = "run {run_id}") -> Any:
    """A dependency: the request to act on `target`, if its caller has the control lease of the rig, or the request was
    answered before. The lease is checked when the request is complete.
    """
    permitted = idempotent(action, target, Scope.CONTROL, moves=True)

    async def by_the_driver(
        runs: Rig, found: IdempotentRequest = permitted, token: LeaseToken = None
    ) -> IdempotentRequest:
        try:
            return replace(found, lease=runs.lease.check(token))
        except LeaseError as error:
            await found.refuse_unless_answered(error)
            return found

    return Depends(by_the_driver)


def _filled(target: str, parameters: dict[str, Any]) -> str:
    """A target with the parameters of a path, which is not validated yet, as plain text of limited length."""
    return target.format_map({name: quote(str(value), safe=" ")[:LONGEST] for name, value in parameters.items()})


def _body(made: BaseModel | None) -> str:
    return "" if made is None else made.model_dump_json()


def _answer(body: str, status: int, headers: dict[str, str]) -> Response:
    return Response(body, status, headers, "application/json" if body else None)
