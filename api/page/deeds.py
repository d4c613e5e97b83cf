"""What the page does to rig and store: by whoever is logged in, holding the control lease, noted in the audit log."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from nicegui import run

from api.errors import EXPECTED
from api.page.visitor import Visitor
from api.runs.lease import LeaseError
from api.runs.manager import RunManager
from api.service.access import Caller, check_scope
from api.service.deeds import Deed
from api.service.problems import AccessError
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

    async def drive(self, action: str, target: str, do: Callable[[RunManager, Caller], Made]) -> Made | None:
        """Do something with the rig, holding its lease."""
        return await self._told(lambda: self._drive(action, target, do))

    async def act(self, scope: Scope, action: str, target: str, do: Callable[[Caller], Made]) -> Made | None:
        """Do something that needs `scope`."""
        return await self._told(lambda: self._act(scope, action, target, do))

    async def _told(self, do: Callable[[], Made]) -> Made | None:
        self.tell("")
        try:
            return await run.io_bound(do)
        except REFUSALS as error:
            self.tell(str(error))
            return None

    def _drive(self, action: str, target: str, do: Callable[[RunManager, Caller], Made]) -> Made:
        runs = self.visitor.services.runs
        if runs is None:
            raise AccessError(409, "this service drives no rig; write [[channels]] into jointlab.toml")
        caller = self.visitor.caller()
        deed = Deed(caller.name, action, target, moves=True)
        with self._refusing(deed):
            check_scope(caller, Scope.CONTROL)
            hold_lease(runs, caller.name)
        return self._done(deed, lambda: do(runs, caller))

    def _act(self, scope: Scope, action: str, target: str, do: Callable[[Caller], Made]) -> Made:
        caller = self.visitor.caller()
        deed = Deed(caller.name, action, target)
        with self._refusing(deed):
            check_scope(caller, scope)
        return self._done(deed, lambda: do(caller))

    @contextmanager
    def _refusing(self, deed: Deed) -> Iterator[None]:
        """Note that a deed is refused, where it is."""
        try:
            yield
        except (AccessError, LeaseError) as error:
            self.visitor.services.refusals.note(self.visitor.services.catalogue, deed, str(error))
            raise

    def _done(self, deed: Deed, do: Callable[[], Made]) -> Made:
        """Do it, noted in the audit log."""
        catalogue = self.visitor.services.catalogue
        with catalogue.writing() as session:
            begun = deed.begin(session)
        try:
            made = do()
        except Exception as error:
            with catalogue.writing() as session:
                deed.end(session, str(error) or type(error).__name__, begun)
            raise
        with catalogue.writing() as session:
            deed.end(session, "done", begun)
        return made


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
