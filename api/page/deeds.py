"""What the page does to rig and store: by whoever is logged in, holding the control lease, noted in the audit log."""

from __future__ import annotations

import threading
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TypeVar

from nicegui import run

from api.errors import EXPECTED
from api.page.visitor import Visitor
from api.runs.lease import LeaseError
from api.runs.manager import RunManager
from api.service.access import Caller
from api.service.problems import AccessError
from store.audit import add_audit_entry
from store.keys import Scope

Made = TypeVar("Made")
REFUSALS: tuple[type[Exception], ...] = (*EXPECTED, AccessError)
HOLDER = "{} on the technician's page"
_tokens: dict[str, str] = {}
_lock = threading.Lock()


@dataclass(frozen=True)
class Deeds:
    """Deeds of one visitor; what goes wrong is told, and the deed then returns None.

    Attributes:
        visitor: does them.
        tell: shows a sentence where the visitor looks.
    """

    visitor: Visitor
    tell: Callable[[str], None]

    def drive(
        self, action: str, target: str, do: Callable[[RunManager, Caller], Made]
    ) -> Awaitable[Made | None]:  # fmt: skip
        """Do something with the rig, holding its lease."""

        def carry_out(caller: Caller) -> Made:
            runs = self.visitor.services.runs
            if runs is None:
                raise AccessError(409, "this service drives no rig; write [[channels]] into jointlab.toml")
            hold_lease(runs, caller.name)
            return do(runs, caller)

        return self.act(Scope.CONTROL, action, target, carry_out)

    async def act(self, scope: Scope, action: str, target: str, do: Callable[[Caller], Made]) -> Made | None:
        """Do something that needs `scope`."""
        self.tell("")
        try:
            return await run.io_bound(self._act, scope, action, target, do)
        except REFUSALS as error:
            self.tell(str(error))
            return None

    def _act(self, scope: Scope, action: str, target: str, do: Callable[[Caller], Made]) -> Made:
        caller = self.visitor.caller()
        if scope not in caller.scopes:
            raise AccessError(403, f"{action}: this needs the scope {scope}; {caller.name} has it not")
        try:
            made = do(caller)
        except EXPECTED as error:
            self._note(caller, action, target, str(error))
            raise
        self._note(caller, action, target, "done")
        return made

    def _note(self, caller: Caller, action: str, target: str, outcome: str) -> None:
        with self.visitor.services.catalogue.writing() as session:
            add_audit_entry(session, who=caller.name, action=action, target=target, outcome=outcome)


def hold_lease(runs: RunManager, name: str) -> None:
    """Renew the lease of whoever is called `name`, or take it where it is free.

    Raises:
        LeaseError: somebody else drives.
    """
    with _lock:
        try:
            runs.lease.renew(_tokens.get(name))
        except LeaseError:
            _tokens[name] = runs.lease.take(HOLDER.format(name)).token


def keep_lease(runs: RunManager, name: str) -> None:
    """Renew the lease where `name` has it: whoever looks on while a run goes keeps driving it."""
    if runs.lease.holder == HOLDER.format(name):
        hold_lease(runs, name)
