"""Requests that act: done once however often they are sent, and noted in the audit log with what came of them.

Each brings an `Idempotency-Key` of its sender's choice. Sent again with the same key, it gets the first answer. A page
of somebody else's cannot send that header across origins, so it cannot act in the name of whoever is reading it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends, Request, Response
from pydantic import BaseModel

from api.errors import ConflictError
from api.service.access import Caller, caller
from api.service.context import Context, Services
from api.service.documents import IdempotencyKey
from store.audit import add_audit_entry
from store.requests import answer_request, begin_request, forget_request

REPLAYED = "Idempotency-Replayed"


class KeyReusedError(ConflictError):
    """The idempotency key was used for another request, or for one whose answer is not known."""


@dataclass(frozen=True)
class Act:
    """A request that acts.

    Attributes:
        who: asks.
        key: its idempotency key.
        fingerprint: of what is asked for.
    """

    services: Services
    who: Caller
    key: str
    fingerprint: str

    def once(
        self,
        action: str,
        target: str,
        do: Callable[[], BaseModel | None],
        status: int = 200,
        *,
        secret: str | None = None,
        **details: Any,
    ) -> Response:
        """Do it, if it was not done before, and answer with what it returns.

        Args:
            action: what is done, and `target` to what, for the audit log.
            do: does it.
            status: of the answer.
            secret: a field of the answer that is kept nowhere; a repeat has null there.
            details: further ones for the audit log.

        Raises:
            KeyReusedError: the key belongs to another request, or to one that is under way or was cut off.
            Exception: what `do` raises; the request may be sent again then.
        """
        with self.services.catalogue.writing() as session:
            before = begin_request(session, self.who.name, self.key, self.fingerprint)
        if before is not None:
            if before.fingerprint != self.fingerprint:
                raise KeyReusedError(f"Idempotency-Key {self.key!r} was used for another request; use a new one")
            if before.status is None or before.body is None:
                raise KeyReusedError(
                    f"the request with Idempotency-Key {self.key!r} is under way, or was cut off; see what came of it, "
                    "then use a new key"
                )
            return _answer(before.body, before.status, {REPLAYED: "true"})
        try:
            made = do()
        except Exception as error:
            self._note(action, target, str(error) or type(error).__name__, details)
            with self.services.catalogue.writing() as session:
                forget_request(session, self.who.name, self.key)
            raise
        body = "" if made is None else made.model_dump_json()
        kept = body if made is None or secret is None else made.model_copy(update={secret: None}).model_dump_json()
        with self.services.catalogue.writing() as session:
            answer_request(session, self.who.name, self.key, status, kept)
            add_audit_entry(session, who=self.who.name, action=action, target=target, outcome="done", details=details)
        return _answer(body, status, {})

    def _note(self, action: str, target: str, outcome: str, details: dict[str, Any]) -> None:
        with self.services.catalogue.writing() as session:
            add_audit_entry(session, who=self.who.name, action=action, target=target, outcome=outcome, details=details)


async def act(request: Request, context: Context, who: Annotated[Caller, Depends(caller)], key: IdempotencyKey) -> Act:
    """The act that a request asks for."""
    asked = f"{request.method} {request.url.path}?{request.url.query}\n".encode() + await request.body()
    return Act(context, who, key, hashlib.sha256(asked).hexdigest())


Once = Annotated[Act, Depends(act)]


def _answer(body: str, status: int, headers: dict[str, str]) -> Response:
    return Response(body, status, headers, "application/json" if body else None)
