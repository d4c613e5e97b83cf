"""What the page does to rig and store: by whoever is logged in, holding the control lease, noted in the audit log."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol, TypeVar

from nicegui import run

from api.page.login import Visitor
from api.service.access import Caller, check_scope
from api.service.problems import AccessError
from jointlab.audit import AuditedAction
from jointlab.errors import EXPECTED
from jointlab.supervision.lease import Lease, LeaseError
from jointlab.supervision.manager import RunManager
from store.states import Scope

Made = TypeVar("Made")
REFUSALS: tuple[type[Exception], ...] = (*EXPECTED, AccessError)


class Tell(Protocol):
    """Shows a sentence where the visitor looks, and where another client drives, a way to take over from it."""

    def __call__(self, text: str, *, another_drives: bool = False) -> None:
        """Show `text`; an empty one takes the former away."""


@dataclass(frozen=True)
class Deeds:
    """Deeds of one visitor in one tab; what goes wrong is told, and the deed then returns None.

    Attributes:
        visitor: does them.
        tab: names the browser's tab, which holds the lease; the same from view to view.
        tell: shows a sentence where the visitor looks.
    """

    visitor: Visitor
    tab: Callable[[], str]
    tell: Tell

    async def drive(self, action: str, target: str, do: Callable[[RunManager, Caller], Made]) -> Made | None:
        """Do something with the rig, holding its lease."""
        tab = self.tab()
        return await self._told(lambda: self._drive(tab, action, target, do))

    async def act(self, scope: Scope, action: str, target: str, do: Callable[[Caller], Made]) -> Made | None:
        """Do something that needs `scope`."""
        return await self._told(lambda: self._act(scope, action, target, do))

    async def take_over(self) -> None:
        """Take the lease from another tab of one's own or, with the scope engineer, from anybody."""
        tab = self.tab()

        def take(caller: Caller) -> Lease:
            return self._runs().lease.take(
                _holder(caller), caller.name, token=token_of(caller, tab), by_force=True,
                from_others=Scope.ENGINEER in caller.scopes,
            )  # fmt: skip

        await self.act(Scope.CONTROL, "take lease", "rig", take)

    async def _told(self, do: Callable[[], Made]) -> Made | None:
        self.tell("")
        try:
            return await run.io_bound(do)
        except REFUSALS as error:
            self.tell(str(error), another_drives=isinstance(error, LeaseError))
            return None

    def _drive(self, tab: str, action: str, target: str, do: Callable[[RunManager, Caller], Made]) -> Made:
        runs, caller = self._runs(), self.visitor.caller()
        audited = AuditedAction(caller.name, action, target, moves=True)
        with self._refusing(audited):
            check_scope(caller, Scope.CONTROL)
            runs.lease.hold(token_of(caller, tab), _holder(caller), caller.name)
        return self._done(audited, lambda: do(runs, caller))

    def _act(self, scope: Scope, action: str, target: str, do: Callable[[Caller], Made]) -> Made:
        caller = self.visitor.caller()
        audited = AuditedAction(caller.name, action, target)
        with self._refusing(audited):
            check_scope(caller, scope)
        return self._done(audited, lambda: do(caller))

    def _runs(self) -> RunManager:
        runs = self.visitor.services.runs
        if runs is None:
            raise AccessError(409, "this service drives no rig; write [[channels]] into jointlab.toml")
        return runs

    @contextmanager
    def _refusing(self, action: AuditedAction) -> Iterator[None]:
        """Note that a deed is refused, where it is."""
        try:
            yield
        except (AccessError, LeaseError) as error:
            self.visitor.services.refusals.note(self.visitor.services.catalogue, action, str(error))
            raise

    def _done(self, action: AuditedAction, do: Callable[[], Made]) -> Made:
        """Do it, noted in the audit log."""
        catalogue = self.visitor.services.catalogue
        with catalogue.writing() as session:
            begun = action.begin(session)
        return action.carry_out(catalogue, begun, do)


def token_of(caller: Caller, tab: str) -> str:
    """The token by which a tab holds the lease; another one where somebody else logs in there."""
    return f"{caller.name} in tab {tab}"


def _holder(caller: Caller) -> str:
    return f"{caller.name} on the technician's page"
