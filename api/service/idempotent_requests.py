"""Requests that act: done once however often they are sent, and noted in the audit log with what came of them.

Each brings an `Idempotency-Key` of its sender's choice. Sent again with the same key, it gets the first answer. A page
of somebody else's cannot send that header across origins, so it cannot act in the name of whoever is reading it.

A route says what it does by the dependency that makes its act: `acting` asks for a scope, `driving` for the control
lease beside it. So a deed that is refused is in the log under the same name as one that is done.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any
from urllib.parse import quote

from anyio import to_thread
from fastapi import Depends, Header, Request, Response
from pydantic import BaseModel

from api.service.access import Caller, caller, check_scope
from api.service.context import Context, Rig, Services
from api.service.documents import IdempotencyKey
from api.service.problems import AccessError
from jointlab.audit import Deed
from jointlab.errors import ConflictError
from jointlab.supervision.lease import LeaseError
from store.requests import Answered, answer_request, begin_request, find_request, forget_request
from store.states import Scope

REPLAYED = "Idempotency-Replayed"
LONGEST = 100  # characters of a path's parameter in the log
LeaseToken = Annotated[str | None, Header(alias="Control-Lease", description="token of the control lease")]


class KeyReusedError(ConflictError):
    """The idempotency key was used for another request, or for one whose answer is not known."""


@dataclass(frozen=True)
class Act:
    """A request that acts.

    Attributes:
        who: asks.
        deed: what is asked for, as the audit log has it.
        key: its idempotency key.
        fingerprint: of what is asked for.
    """

    services: Services
    who: Caller
    deed: Deed
    key: str
    fingerprint: str

    def once(
        self, do: Callable[[], BaseModel | None], status: int = 200, *, secret: str | None = None, **details: Any
    ) -> Response:
        """Do it, if it was not done before, and answer with what it returns.

        Args:
            do: does it.
            status: of the answer.
            secret: a field of the answer that is kept nowhere; a repeat has null there.
            details: for the audit log.

        Raises:
            KeyReusedError: the key belongs to another request, or to one that is under way or was cut off.
            Exception: what `do` raises; the request may be sent again then.
        """
        deed, begun = replace(self.deed, details=details), None
        with self.services.catalogue.writing() as session:
            before = begin_request(session, self.who.name, self.key, self.fingerprint)
            if before is None:
                begun = deed.begin(session)
        if before is not None:
            return self._again(before)
        try:
            made = do()
        except Exception as error:
            with self.services.catalogue.writing() as session:
                deed.end(session, str(error) or type(error).__name__, begun)
                forget_request(session, self.who.name, self.key)
            raise
        body = "" if made is None else made.model_dump_json()
        kept = body if made is None or secret is None else made.model_copy(update={secret: None}).model_dump_json()
        with self.services.catalogue.writing() as session:
            answer_request(session, self.who.name, self.key, status, kept)
            deed.end(session, "done", begun)
        return _answer(body, status, {})

    def is_answered(self) -> bool:
        """Whether its key has an answer, which stays: then nothing will be done, whatever is asked for with it."""
        with self.services.catalogue.reading() as session:
            before = find_request(session, self.who.name, self.key)
        return before is not None and before.status is not None

    async def refused(self, error: AccessError | LeaseError) -> None:
        """Note that it was refused."""
        await to_thread.run_sync(self.services.refusals.note, self.services.catalogue, self.deed, str(error))

    def _again(self, before: Answered) -> Response:
        if before.fingerprint != self.fingerprint:
            raise KeyReusedError(f"Idempotency-Key {self.key!r} was used for another request; use a new one")
        if before.status is None or before.body is None:
            raise KeyReusedError(
                f"the request with Idempotency-Key {self.key!r} is under way, or was cut off; see what came of it, "
                "then use a new key"
            )
        return _answer(before.body, before.status, {REPLAYED: "true"})


def acting(action: str, target: str, scope: Scope, *, moves: bool = False) -> Any:
    """A dependency: the act that a request asks for, if `scope` is open to whoever asks.

    Args:
        action: such as "start run".
        target: such as "run {run_id}", with parameters of the path.
        scope: that opens it.
        moves: whether it moves the machine.
    """

    async def act(
        request: Request, context: Context, who: Annotated[Caller, Depends(caller)], key: IdempotencyKey
    ) -> Act:
        asked = f"{request.method} {request.url.path}?{request.url.query}\n".encode() + await request.body()
        deed = Deed(who.name, action, _filled(target, request.path_params), moves)
        found = Act(context, who, deed, key, hashlib.sha256(asked).hexdigest())
        try:
            check_scope(who, scope)
        except AccessError as error:
            await found.refused(error)
            raise
        return found

    return Depends(act)


def driving(action: str) -> Any:
    """A dependency: the act on a run that a request asks for, if whoever asks holds the control lease of the rig, or
    has the answer already; looked at when the request is whole.
    """
    permitted = acting(action, "run {run_id}", Scope.CONTROL, moves=True)

    async def act(runs: Rig, found: Act = permitted, token: LeaseToken = None) -> Act:
        try:
            runs.lease.check(token)
        except LeaseError as error:
            if not await to_thread.run_sync(found.is_answered):
                await found.refused(error)
                raise
        return found

    return Depends(act)


def _filled(target: str, parameters: dict[str, Any]) -> str:
    """A target with the parameters of a path, which nobody has looked at yet, as plain text of a decent length."""
    return target.format_map({name: quote(str(value), safe=" ")[:LONGEST] for name, value in parameters.items()})


def _answer(body: str, status: int, headers: dict[str, str]) -> Response:
    return Response(body, status, headers, "application/json" if body else None)
