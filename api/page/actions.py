"""Actions of the page on rig and store, by the key that is logged in, and noted in the audit log."""

from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

from anyio import CapacityLimiter, to_thread
from nicegui import run

from api.page.login import Login
from api.service.access import Caller, check_scope
from api.service.deadlines import looked_up_soon
from api.service.problems import AccessError
from jointlab.audit import AuditedAction
from jointlab.errors import EXPECTED
from jointlab.supervision.lease import Lease, LeaseError
from jointlab.supervision.manager import RunManager
from rig.errors import with_notes
from store.errors import StoreError
from store.states import Scope

ResultT = TypeVar("ResultT")
CallerCheck = Callable[[Caller], None]
SHOWN_ERRORS: tuple[type[Exception], ...] = (*EXPECTED, AccessError)
"""Errors whose message the page shows."""
_key_lookup = ThreadPoolExecutor(2, thread_name_prefix="key lookup of the page")


class Tell(Protocol):
    """Shows a sentence at the top of the view, and where another client drives, a button to take over from it."""

    def __call__(self, text: str, *, another_drives: bool = False) -> None:
        """Show `text`; an empty one removes the former."""


@dataclass(frozen=True)
class PageActions:
    """Actions in one tab. Where one fails, the page shows why, and the action returns None.

    Attributes:
        login: of the browser.
        opened_by: the caller who has opened the view.
        tab: names the browser's tab, which holds the lease; the same from view to view.
        tell: shows a sentence at the top of the view.
    """

    login: Login
    opened_by: Caller
    tab: Callable[[], str]
    tell: Tell

    def telling(self, tell: Callable[[str], None]) -> "PageActions":
        """The same actions, whose errors `tell` shows, as beside a form; it offers no button to take over."""

        def told(text: str, *, another_drives: bool = False) -> None:  # noqa: ARG001 - `Tell` has it, for that button
            tell(text)

        return replace(self, tell=told)

    async def drive(self, action: str, target: str, do: Callable[[RunManager, Caller, int], ResultT]) -> ResultT | None:
        """Carry out an action on the rig, with the number of its lease."""
        tab, leases = self.tab(), list[int]()
        audited = AuditedAction("", action, target, moves=True)
        return await self._do(
            audited,
            lambda caller: leases.append(self._lease(caller, tab)),
            lambda caller: do(self._runs(), caller, *leases),
        )

    async def pause(self, run_id: int) -> None:
        """Pause the run, and note it afterwards: the actuator waits neither for the database nor for other actions.

        Where the database does not say who asks, it is paused for the caller who has opened the view.
        """
        tab = self.tab()

        async def at_once() -> None:
            try:
                caller = await looked_up_soon(_key_lookup, self.login.caller)
            except StoreError:
                caller = self.opened_by
            await to_thread.run_sync(self._pause, caller, tab, run_id, limiter=CapacityLimiter(1))

        await self._told(at_once())

    async def act(
        self, scope: Scope, action: str, target: str, do: Callable[[Caller], ResultT], **details: object
    ) -> ResultT | None:
        """Carry out an action that needs `scope`; `details` go to the audit log."""
        return await self._do(AuditedAction("", action, target, details=details), lambda c: check_scope(c, scope), do)

    async def take_over(self) -> None:
        """Take the lease from another tab of the same key or, with the scope engineer, from any client."""
        tab = self.tab()

        def take(caller: Caller) -> Lease:
            return self._runs().lease.take(
                _holder(caller), caller.name, token=token_of(caller, tab), by_force=True,
                from_others=Scope.ENGINEER in caller.scopes,
            )  # fmt: skip

        await self.act(Scope.CONTROL, "take lease", "rig", take)

    async def _do(self, action: AuditedAction, check: CallerCheck, do: Callable[[Caller], ResultT]) -> ResultT | None:
        return await self._told(run.io_bound(self._audited, action, check, do))

    async def _told(self, doing: Awaitable[ResultT]) -> ResultT | None:
        self.tell("")
        try:
            return await doing
        except SHOWN_ERRORS as error:
            self.tell(with_notes(str(error), error), another_drives=isinstance(error, LeaseError))
            return None

    def _audited(self, action: AuditedAction, check: CallerCheck, do: Callable[[Caller], ResultT]) -> ResultT:
        """Do it if `check` raises nothing; a refusal and the outcome are noted."""
        catalogue, caller = self.login.services.catalogue, self.login.caller()
        if action.moves:
            self._runs()  # without a rig there is nothing to refuse
        audited = replace(action, caller=caller.name)
        self._check(audited, lambda: check(caller))
        with catalogue.writing() as session:
            begun = audited.begin(session)
        return audited.carry_out(catalogue, begun, lambda: do(caller))

    def _pause(self, caller: Caller, tab: str, run_id: int) -> None:
        runs, action = self._runs(), AuditedAction(caller.name, "pause run", f"run {run_id}")
        self._check(action, lambda: self._lease(caller, tab))
        try:
            action.carry_out(self.login.services.catalogue, None, lambda: runs.pause(run_id))
        except StoreError as error:
            raise StoreError(f"run {run_id} is paused; but this is not in the audit log: {error}") from error

    def _check(self, action: AuditedAction, check: Callable[[], object]) -> None:
        services = self.login.services
        try:
            check()
        except (AccessError, LeaseError) as error:
            services.refusals.note(services.catalogue, action, str(error))
            raise

    def _lease(self, caller: Caller, tab: str) -> int:
        """The number of the lease of a tab, which takes it where it is free."""
        check_scope(caller, Scope.CONTROL)
        return self._runs().lease.hold(token_of(caller, tab), _holder(caller), caller.name).number

    def _runs(self) -> RunManager:
        runs = self.login.services.runs
        if runs is None:
            raise AccessError(409, "this service drives no rig; write [[channels]] into jointlab.toml")
        return runs


def token_of(caller: Caller, tab: str) -> str:
    """The token by which a tab holds the lease; another one where another key logs in there."""
    return f"{caller.name} in tab {tab}"


def _holder(caller: Caller) -> str:
    return f"{caller.name} on the technician's page"
