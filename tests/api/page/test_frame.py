"""The frame of a page that is fetched and never connects, as by a program that asks whether the page is there."""

import asyncio
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import pytest

from api.page.frame import Frame
from api.service.access import Caller
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState
from store.errors import SilentError


@pytest.fixture
def kept() -> list[str]:
    return []


@pytest.fixture
def frame(kept: list[str]) -> Frame:
    """One of a browser tab that is not there yet, in front of a rig."""
    made: Any = object.__new__(Frame)  # what makes the elements of a page needs a browser
    made.services = SimpleNamespace(runs=SimpleNamespace(lease=SimpleNamespace(keep=kept.append)))
    made.login, made.caller = SimpleNamespace(caller=lambda: None), Caller("ann", frozenset())
    made._client, made._connected_as = SimpleNamespace(tab_id=None), None
    made._told = made._silence = ""
    made._is_incomplete = False
    assert isinstance(made, Frame)
    return made


def carry_out(work: Coroutine[Any, Any, None]) -> None:
    """In a thread of its own: an event loop of a browser may run in this one."""
    with ThreadPoolExecutor(1) as pool:
        pool.submit(asyncio.run, work).result()


def test_it_keeps_no_lease_and_a_tab_does_that_outlives_its_connection(frame: Frame, kept: list[str]) -> None:
    client: Any = frame._client
    carry_out(frame._renew())
    assert kept == []
    client.tab_id = "tab 1"
    carry_out(frame._renew())
    client.tab_id = None
    carry_out(frame._renew())
    assert kept == ["ann in tab tab 1"] * 2


def test_it_is_drawn_again_where_the_rig_has_changed_without_an_event(frame: Frame) -> None:
    """As where the drive process is lost: nobody is left who could send an event of it."""
    shown = list[Phase]()
    runs: Any = SimpleNamespace(
        journal=SimpleNamespace(epoch="one", latest=3), lease=SimpleNamespace(holder=None), state=RigState(),
        stopped_by=None, pause_number=None, stop_epoch=None,
    )  # fmt: skip
    services: Any = SimpleNamespace(runs=runs, alarms=None)
    made: Any = frame
    made.services, made._seen, made.refreshes = services, None, []
    made._top = SimpleNamespace(set_content=lambda _: shown.append(runs.state.phase))
    made._state = made._show_stop = made._show_alarms = lambda: None
    for state in (RigState(), RigState(), RigState(Phase.UNKNOWN, tester_silent="it is lost")):
        runs.state = state
        carry_out(frame._poll())
    runs.stopped_by = "ann"
    carry_out(frame._poll())
    assert shown == [Phase.IDLE, Phase.UNKNOWN, Phase.UNKNOWN]
    runs.pause_number = 5  # paused once more: a resume from this view has to name it
    carry_out(frame._poll())
    assert len(shown) == 4


def test_a_view_that_is_not_complete_says_so_until_it_is(frame: Frame) -> None:
    """Other reads, such as that of the key, may be answered before."""
    shown = list[str]()
    made: Any = frame
    made._trouble, made._take_over = SimpleNamespace(set_content=shown.append), SimpleNamespace(set_visibility=bool)

    async def read() -> None:
        await frame.read(lambda: None)

    frame._owe(SilentError("no answer"))
    carry_out(read())
    assert "no answer" in shown[-1]
    made._is_incomplete = False
    carry_out(read())
    assert shown[-1] == ""


def test_what_is_told_beside_a_silent_database_stays_when_it_answers(frame: Frame) -> None:
    shown = list[str]()
    made: Any = frame
    made._trouble, made._take_over = SimpleNamespace(set_content=shown.append), SimpleNamespace(set_visibility=bool)

    async def read() -> None:
        await frame.read(lambda: None)

    frame._tell_silence(SilentError("no answer"))
    frame.tell("the rig is driven by another")
    carry_out(read())
    assert "driven by another" in shown[-1]
