"""Alarms: the active ones, with a button to acknowledge each, who was notified, and earlier ones."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from functools import partial

from nicegui import ui

from api.page.address import number
from api.page.controls import button
from api.page.formatting import moment
from api.page.frame import Frame
from api.page.markup import Link, paragraph, show, table
from api.service.access import Caller
from api.service.context import Services
from jointlab.alarms.channel import TITLES
from store.service.alarms import Alarm, Delivery, acknowledge_alarm, list_alarms, list_deliveries
from store.states import Scope

LARGEST_PAGE = 50


@dataclass(frozen=True)
class ShownAlarms:
    """The alarms to show, and the messages about them by the number of the alarm."""

    standing: list[Alarm]
    before: list[Alarm]
    deliveries: dict[int, list[Delivery]]


def find(services: Services, before: int | None) -> ShownAlarms:
    """Read the alarms of every rig; of those that were acknowledged, a page that begins before a number."""
    with services.catalogue.reading() as session:
        standing = list_alarms(session, standing=True, limit=LARGEST_PAGE)
        others = list_alarms(session, standing=False, before=before, limit=LARGEST_PAGE)
        return ShownAlarms(standing, others, list_deliveries(session, [alarm.id for alarm in standing]))


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view."""
    before = number(query, "before")
    show(
        "<p>An alarm stays until somebody acknowledges it. It does not stop the machine: if the machine moves "
        "unexpectedly, press STOP or the red button.</p>"
    )
    note = ui.input("Note: what you have seen or done").props("outlined").classes("w-full")
    standing = ui.element("div").classes("w-full").props('aria-live="polite"')
    others = show("")
    shown: list[ShownAlarms] = []

    async def draw() -> None:
        found = await frame.read(lambda: find(frame.services, before))
        if found is None or [found] == shown:
            return
        shown[:] = [found]
        standing.clear()
        with standing:
            note.set_visibility(bool(found.standing))
            if not found.standing:
                paragraph("No alarm is active.", "big")
            for alarm in found.standing:
                with ui.element("section").classes("card w-full").props(f'aria-label="alarm {alarm.id}"'):
                    paragraph(f"{TITLES[alarm.kind].capitalize()}, {moment(alarm.happened_at)}", "big")
                    paragraph(alarm.text)
                    paragraph(deliveries_text(found.deliveries.get(alarm.id, [])), "quiet")
                    acknowledge = partial(_acknowledge, frame, alarm.id, lambda: note.value or "", draw)
                    button(f"Acknowledge alarm {alarm.id}", acknowledge, main=True)
        others.set_content(_others(found.before))

    frame.refreshes.append(draw)


def deliveries_text(deliveries: list[Delivery]) -> str:
    """Who was notified of an alarm, in a sentence."""
    if not deliveries:
        return "Nobody was notified by a message."
    said = [
        f"{each.channel} at {moment(each.delivered_at)}"
        if each.delivered_at is not None
        else f"{each.channel} not yet ({each.result or 'under way'}, attempt {each.attempts})"
        for each in deliveries
    ]
    return f"Notified by {'; '.join(said)}."


async def _acknowledge(
    frame: Frame, alarm_id: int, note: Callable[[], str], draw: Callable[[], Awaitable[None]]
) -> None:
    def do(caller: Caller) -> Alarm:
        with frame.services.catalogue.writing() as session:
            alarm = acknowledge_alarm(session, alarm_id, caller.name, note()[:500])
        if frame.services.alarms is not None:
            frame.services.alarms.look()
        return alarm

    if await frame.actions.act(Scope.CONTROL, "acknowledge alarm", f"alarm {alarm_id}", do) is not None:
        await draw()


def _others(alarms: list[Alarm]) -> str:
    if not alarms:
        return ""
    rows = [
        (str(each.id), moment(each.happened_at), each.text, moment(each.acknowledged_at), each.acknowledged_by or "",
         each.note or "")
        for each in alarms
    ]  # fmt: skip
    made = table("Acknowledged, newest first", ("alarm", "at", "what", "acknowledged", "by", "note"), rows)
    if len(alarms) == LARGEST_PAGE:
        older = Link("show older alarms", f"/page/alarms?before={alarms[-1].id}")
        made += table("Older alarms", ("",), [(older,)])
    return made
