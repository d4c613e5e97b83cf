"""The hall: every rig's state from its own drive process, with a STOP for each."""

from collections.abc import Mapping
from html import escape
from urllib.parse import quote

from nicegui import ui

from api.page.formatting import moment, tripped_text
from api.page.frame import Frame, badge_of
from api.page.markup import Link, anchor, paragraph, show
from jointlab.drive.state import RigState
from jointlab.hall import Seen

INTERVAL = 1.0  # s


async def build(frame: Frame, _query: Mapping[str, str]) -> None:
    """Build the view."""
    hall = frame.services.hall
    if hall is None:
        paragraph("No other rig is known here: write [[hall]] into the configuration.")
        return
    states: dict[str, ui.html] = {}
    with ui.element("div").classes("cards"):
        for name in hall.names:
            with ui.element("section").classes("card").props(f'aria-label="rig {escape(name)}"'):
                show(f"<h2>{escape(name)}</h2>")
                states[name] = show("")
                show(stop_form(name))

    def draw() -> None:
        for seen in hall.seen():
            states[seen.given.rig].set_content(state_text(seen))

    ui.timer(INTERVAL, draw)


def stop_form(name: str) -> str:
    """The STOP of one rig: a plain form, which goes the way of HTTP."""
    return (
        f'<form class="stop-of-rig" method="post" action="/api/rigs/{quote(name)}/stop" target="stopped">'
        f'<button aria-label="STOP {escape(name)}">STOP {escape(name)}</button><output role="status"></output></form>'
    )


def state_text(seen: Seen) -> str:
    """The state of a rig; where its drive process does not answer, only that."""
    page = "" if seen.given.page is None else f"<p>{anchor(Link('Its page', str(seen.given.page), new_tab=True))}</p>"
    state = seen.state
    if state is None:
        since = "the service began" if seen.heard_at is None else moment(seen.heard_at)
        text = f"not reachable since {since}: what it does is not known"
        return f'<p><span class="badge held">{escape(text)}</span></p><p>{escape(seen.trouble)}</p>{page}'
    known = RigState(
        state.phase, tester_silent=state.tester_silent, rest_unknown=state.rest_unknown, is_driven=state.is_driven
    )
    text, colour = badge_of(known)
    if (state.interlocks or state.tripped) and state.rest_unknown is None:
        names = (name.replace("_", " ") for name in state.interlocks)
        text, colour = tripped_text(", ".join(names)), "tripped"
    lines = [state.rest_unknown or "", state.activity, state.reason or ""]
    if state.run_id is not None:
        lines.insert(0, f"run {state.run_id}")
    if state.stop is not None:
        lines.append(f"STOP is in force: {state.stop.who}: {state.stop.why}")
    paragraphs = "".join(f"<p>{escape(line)}</p>" for line in lines if line)
    return f'<p><span class="badge {colour}">{escape(text)}</span></p>{paragraphs}{page}'
