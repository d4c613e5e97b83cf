"""The frame of every view: state of the rig, STOP, links to the other views, and a place for messages."""

from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from html import escape
from typing import TypeVar
from urllib.parse import quote

from nicegui import ui

from api.page.actions import PageActions, token_of
from api.page.controls import button
from api.page.formatting import tripped_text
from api.page.login import Login, file_text, stop_button
from api.page.markup import show, tabs
from api.service.access import Caller
from api.service.deadlines import within
from api.service.problems import AccessError
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState
from jointlab.errors import EXPECTED
from rig.tester.status import interlock_text
from store.errors import ConnectionLostError, SilentError
from store.service.alarms import NewAlarm
from store.states import Scope

VIEWS = {
    "Dashboard": "/page/",
    "Measure": "/page/measure",
    "Hammer": "/page/hammer",
    "Sweep": "/page/sweep",
    "Runs": "/page/runs",
    "Results": "/page/results",
    "Gap": "/page/gap",
    "Instruments": "/page/instruments",
    "Laboratory": "/page/laboratory",
    "Alarms": "/page/alarms",
    "Hall": "/page/hall",
}
POLL_INTERVAL = 0.25
"""Seconds between two checks for events of the rig."""
RENEW_INTERVAL = 10.0
"""Seconds between two renewals of the lease, at which the key is checked, too."""
LONGEST_READ = 8.0
"""Seconds that a view waits for the database; then it says so, and asks again."""
_readers = ThreadPoolExecutor(4, thread_name_prefix="page")
ONLY_STOP = "Only STOP works. If STOP does not answer, press the red button on the machine."
PHASES = {
    Phase.IDLE: ("at rest", "idle"),
    Phase.STARTING: ("starting", "moving"),
    Phase.RUNNING: ("running", "moving"),
    Phase.PAUSED: ("paused", "held"),
    Phase.STOPPING: ("stopping", "held"),
    Phase.EXAMINING: ("being examined", "moving"),
    Phase.UNKNOWN: ("not known: the drive process does not answer", "tripped"),
}
Refresh = Callable[[], Awaitable[None]]
DATABASE_AWAY = SilentError, ConnectionLostError
"""Errors of a database that may answer when it is asked again."""
ResultT = TypeVar("ResultT")


def badge_of(state: RigState | None) -> tuple[str, str]:
    """The state of the rig in a word or two, and the CSS class that colours it."""
    if state is None:
        return "no rig here", "idle"
    if state.rest_unknown is not None:
        return "rest not confirmed", "tripped"
    if state.phase is Phase.UNKNOWN:
        return PHASES[state.phase]
    if state.is_tripped:
        return tripped_text(interlock_text(state.interlocks) if state.interlocks else ""), "tripped"
    if state.tester_silent is not None:
        return "the tester does not answer", "held"
    if state.phase is Phase.IDLE and not state.is_driven:
        return "not driven from here", "idle"
    return PHASES[state.phase]


def banner(standing: Sequence[NewAlarm]) -> str:
    """The text of every view about the alarms that nobody has acknowledged, newest first."""
    if not standing:
        return ""
    count = "An alarm is active" if len(standing) == 1 else f"{len(standing)} alarms are active"
    text = escape(standing[0].text)
    address = VIEWS["Alarms"]
    return (
        f'<div class="notice trouble" id="alarms-standing"><b>{count}:</b> {text}. <a href="{address}">See it</a></div>'
    )


@dataclass(eq=False)
class Frame:
    """The frame of one page in one tab; a view adds its own elements.

    Attributes:
        login, caller: of the browser.
        title: of the view, one of `VIEWS`; another one is of no view.
        refreshes: functions that are called once at the beginning, and after every event of the rig.
    """

    login: Login
    caller: Caller
    title: str
    refreshes: list[Refresh] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.services = self.login.services
        self._client = ui.context.client
        self._connected_as: str | None = None
        self.actions = PageActions(self.login, self.caller, self._tab, self.tell)
        ui.add_css(file_text("page.css"))
        ui.add_head_html(f"<script>{file_text('page.js')}</script>")
        said = "No connection to the service. The values shown may be old."
        if self.services.runs is not None or self.services.hall is not None:
            said = f"{said} {ONLY_STOP}"
        ui.add_body_html(f'{stop_button(self.services)}<div id="dead" role="alert">{said}</div>')
        with ui.header() as self._header:
            self._top = show(self._state())
            show(tabs("views", VIEWS, self.title))
        show(f"<h1>{escape(self.title)}</h1>")
        self._trouble = show("").props('role="alert"')
        self._stopped = show("").props('role="status"')
        self._alarms = show("").props('role="status"')
        self._reset_stop = button("I have looked: reset STOP", self._let_go)
        self._show_stop()
        self._show_alarms()
        self._take_over = button("Drive from here", self.actions.take_over)
        self._take_over.set_visibility(False)
        self._seen: tuple[object, ...] | None = None
        self._told = self._silence = ""
        self._is_incomplete = False
        self._unread: Exception | None = None
        self._filling: ui.timer | None = None
        ui.timer(POLL_INTERVAL, self._poll)
        ui.timer(RENEW_INTERVAL, self._renew, immediate=False)

    def tell(self, text: str, *, another_drives: bool = False) -> None:
        """Show a sentence of trouble at the top of the view; an empty one removes it.

        Where another client drives, and this login may take over from it, the button for that is shown, too.
        """
        self._told = text
        self._trouble.set_content(f'<p class="notice trouble">{escape(text)}</p>' if text else "")
        self._take_over.set_visibility(another_drives and self._may_take_over())

    async def read(self, query: Callable[[], ResultT]) -> ResultT | None:
        """The result of `query`, which runs in another thread; None where it fails, and the page then shows why."""
        try:
            found = await self.reading(query)
        except DATABASE_AWAY as error:
            self._tell_silence(error)
            return None
        except EXPECTED as error:
            self._silence = ""
            self.tell(str(error))
            return None
        if not self._is_incomplete:
            self._end_silence()
        return found

    async def build(self, draw: Refresh) -> None:
        """Draw the view, and again from the beginning as long as the database does not answer what `draw` reads."""
        content = self._client.content
        of_frame = set(content)

        async def attempt() -> None:
            self.refreshes.clear()
            for element in set(content) - of_frame:
                element.delete()
            self._unread = None
            with content:
                await draw()
            if self._unread is not None:
                raise self._unread

        try:
            await attempt()
        except DATABASE_AWAY as error:
            self._owe(error)
            self._ask(self._header, attempt)  # in the content it would end with the view

    def fill(self, refresh: Refresh) -> None:
        """Call `refresh` once the browser has connected, and again as long as the database does not answer it.

        Errors of `DATABASE_AWAY` have to come out of `refresh`, and it has to draw from the beginning each time. A fill
        that is under way ends: both would draw into the same place.
        """
        if self._filling is not None:
            self._filling.cancel(with_current_invocation=True)
        # not in the place that is drawn again, which ends with its timers
        self._filling = self._ask(self._client.content, refresh)

    def _ask(self, place: ui.element, refresh: Refresh) -> ui.timer:
        """Call `refresh` by a timer in `place`, which is returned, until the database answers it."""

        async def ask() -> None:
            try:
                await refresh()
            except DATABASE_AWAY as error:
                self._owe(error)
                return
            timer.cancel()
            self._is_incomplete = False
            self._end_silence()

        with place:
            timer = ui.timer(POLL_INTERVAL, ask)
        return timer

    def _owe(self, error: Exception) -> None:
        """Tell that the database was silent where it was asked for a part of the view, which is still to be drawn."""
        self._is_incomplete = True
        self._tell_silence(error)

    def _tell_silence(self, error: Exception) -> None:
        self._silence = str(error)
        self.tell(self._silence)

    def _end_silence(self) -> None:
        """Remove the sentence about a silent database; another one that has been shown since stays."""
        if self._silence and self._told == self._silence:
            self.tell("")
        self._silence = ""

    async def reading(self, query: Callable[[], ResultT]) -> ResultT:
        """The result of `query`, which runs in another thread.

        Raises:
            SilentError: the database has not answered within `LONGEST_READ`.
            Exception: what `query` raises.
        """
        try:
            return await within(LONGEST_READ, _readers, query)
        except DATABASE_AWAY as error:
            self._unread = error
            raise

    def _may_take_over(self) -> bool:
        runs = self.services.runs
        driver = None if runs is None else runs.lease.caller
        return driver is not None and (driver == self.caller.name or Scope.ENGINEER in self.caller.scopes)

    def _tab(self) -> str:
        """The name of the browser's tab, which outlives its connection."""
        tab = self._known_tab()
        assert tab is not None, "no button is pressed before the browser has connected"
        return tab

    def _known_tab(self) -> str | None:
        """The same; None for a page that was fetched by something that has not connected."""
        self._connected_as = self._client.tab_id or self._connected_as
        return self._connected_as

    def _show_stop(self) -> None:
        """Show the STOP that is in force, with the button to reset it."""
        stop = None if self.services.runs is None else self.services.runs.stopped_by
        why = "" if stop is None else f"{escape(stop.who)}: {escape(stop.why)}"
        state = self.services.rig_state
        is_known = state is not None and _is_rest_known(state)
        so = "nothing moves" if is_known else "no run begins"
        notice = f'<div class="notice trouble" id="stop-in-force"><b>STOP is in force: {so}.</b> {why}.</div>'
        self._stopped.set_content(notice if why else "")
        self._reset_stop.set_visibility(stop is not None)

    def _show_alarms(self) -> None:
        """Show that alarms are active, and the newest of them."""
        self._alarms.set_content(banner(self._standing()))

    def _standing(self) -> tuple[NewAlarm, ...]:
        return () if self.services.alarms is None else self.services.alarms.standing

    async def _let_go(self) -> None:
        """Reset the STOP that is shown."""
        stop = None if self.services.runs is None else self.services.runs.stopped_by
        if stop is not None:
            epoch = stop.epoch
            await self.actions.drive("reset stop", "rig", lambda runs, _, lease: runs.reset_stop(epoch, lease))

    async def _poll(self) -> None:
        """Refresh the view where something has happened at the rig, or its state has changed, since the last time."""
        runs = self.services.runs
        now: tuple[object, ...] = tuple(alarm.uid for alarm in self._standing())
        if runs is not None:
            # not everything that changes the state is an event: a drive process that is lost sends none
            now += (runs.journal.epoch, runs.journal.latest, runs.lease.holder, runs.state, runs.stopped_by)
            now += (runs.pause_number, runs.stop_epoch)
        if now == self._seen and not self._silence:
            return
        self._seen = now
        self._top.set_content(self._state())
        self._show_stop()
        self._show_alarms()
        for refresh in self.refreshes:
            await refresh()

    async def _renew(self) -> None:
        """Keep the lease for a tab that stays open, as long as its key opens the page; else go to the form."""
        runs = self.services.runs
        tab = self._known_tab()
        if runs is not None and tab is not None:
            runs.lease.keep(token_of(self.caller, tab))
        try:
            await self.read(self.login.caller)
        except AccessError as error:
            ui.navigate.to(f"/log-in?why={quote(str(error))}")

    def _state(self) -> str:
        runs = self.services.runs
        state = self.services.rig_state
        text, colour = badge_of(state)
        activity = state.activity if state is not None else "this service shows results and drives nothing"
        holder = None if runs is None else runs.lease.holder
        return (
            f'<div class="top"><a class="brand" href="/page/">Jointlab</a>'
            f'<span class="badge {colour}" id="rig-state">{escape(text)}</span><span>{escape(activity)}</span>'
            f'<span class="quiet">{escape(self.caller.name)}{_driven(holder)}</span></div>'
        )


def _is_rest_known(state: RigState) -> bool:
    return state.is_driven and state.phase is not Phase.UNKNOWN and not (state.rest_unknown or state.tester_silent)


def _driven(holder: str | None) -> str:
    return "" if holder is None else f" · driven by {escape(holder)}"
