"""The dashboard: state of the rig, interlocks, temperature, progress and time left, and the latest runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from html import escape

from nicegui import ui

from api.page.formatting import UNKNOWN, duration, moment, quantity, run_state, trip_sentences
from api.page.frame import Frame, badge_of
from api.page.markup import Link, show, table
from api.page.steering import ENDED, reset_button, without_counts
from api.service.context import Services
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState
from jointlab.report.section import THIN
from jointlab.supervision.run_progress import points_taken, time_left
from rig.tester.monitor import LOOK_INTERVAL
from store.measurements.runs import Run, list_runs


@dataclass(frozen=True)
class Overview:
    """The data of the dashboard beside the state of the rig.

    Attributes:
        runs: the latest.
        temperature: of the latest blow or sine point in degrees Celsius, and when that was; None where there is none.
        seconds_left: of the present run, at its latest pace.
    """

    runs: tuple[Run, ...]
    temperature: tuple[float, datetime] | None
    seconds_left: float | None


def overview(services: Services, state: RigState | None) -> Overview:
    """Read the data of the dashboard."""
    with services.catalogue.reading() as session:
        runs = tuple(list_runs(session, limit=6))
    number = runs[0].id if runs and (state is None or state.run_id is None) else state.run_id if state else None
    if number is None:
        return Overview(runs, None, None)
    taken = points_taken(services.catalogue, number)
    known = [(celsius, at) for at, celsius in taken if celsius is not None]
    left = 0 if state is None else state.blows_wanted + state.sines_wanted - state.blows - state.sines
    busy = state is not None and state.phase.is_of_a_run
    return Overview(runs, known[-1] if known else None, time_left([at for at, _ in taken], left) if busy else None)


async def build(frame: Frame, _query: Mapping[str, str]) -> None:
    """Build the view."""
    services = frame.services
    with ui.element("div").classes("cards"):
        with ui.element("section").classes("card"):
            now = show(_now(services.rig_state, None))
            with ui.element("div").classes("row-of"):
                next_links = ui.element("div").classes("row-of")
        with ui.element("section").classes("card"):
            trouble = show(interlocks_text(services.rig_state))
            reset = ui.element("div").classes("row-of")
        with ui.element("section").classes("card"):
            warm = show("<h2>Temperature</h2><p>…</p>")
    latest = show("")
    shown: list[RigState | None] = []

    async def refresh() -> None:
        state = services.rig_state
        found = await frame.read(lambda: overview(services, state))
        if found is None:
            return
        now.set_content(_now(state, found.seconds_left))
        trouble.set_content(interlocks_text(state))
        warm.set_content(_temperature(found.temperature))
        latest.set_content(_latest(found.runs, state, frame.services.rig_name))
        steady = None if state is None else without_counts(state)
        if [steady] == shown:
            return
        shown[:] = [steady]
        next_links.clear()
        with next_links:
            _next_links(state)
        reset.clear()
        if state is not None and state.is_tripped and state.phase is Phase.IDLE:
            with reset:
                reset_button(frame)

    frame.refreshes.append(refresh)


def _next_links(state: RigState | None) -> None:
    if state is None:
        return
    if state.phase is Phase.IDLE:
        show('<a class="act main" href="/page/measure">Measure something</a>')
        return
    if state.phase is Phase.UNKNOWN:
        return
    if state.phase is Phase.EXAMINING:
        show('<a class="act main" href="/page/instruments">Look at the examination</a>')
        return
    if state.blows_wanted:
        show('<a class="act main" href="/page/hammer">Hammer session</a>')
    if state.sines_wanted:
        show('<a class="act main" href="/page/sweep">Sweep</a>')


def _now(state: RigState | None, seconds_left: float | None) -> str:
    if state is None:
        return (
            "<h2>Rig</h2><p>This service drives no rig: its channel table is empty. Write [[channels]] into "
            "jointlab.toml and start it again, or start <code>jointlab serve --simulated</code>.</p>"
        )
    text, colour = badge_of(state)
    parts = [f'<h2>Rig</h2><p class="big"><span class="badge {colour}">{escape(text)}</span></p>']
    if state.run_id is None:
        parts.append("<p>The service has measured nothing since it was started. Press “Measure something”.</p>")
    else:
        parts.append(f"<p>Run {state.run_id}: {escape(state.title)}</p>")
    if state.activity:
        parts.append(f"<p>{escape(state.activity)}</p>")
    parts += [_progress(name, *counts) for name, counts in _counts(state).items() if counts[1]]
    if seconds_left is not None:
        parts.append(f'<p>Time left at this pace: <b id="time-left">{duration(seconds_left)}</b></p>')
    if state.ended_as is not None:
        parts.append(f'<p id="ended">It {ENDED[state.ended_as]}{_because(state.reason)}.</p>')
    return "".join(parts)


def _counts(state: RigState) -> dict[str, tuple[int, int]]:
    return {"blows": (state.blows, state.blows_wanted), "sine points": (state.sines, state.sines_wanted)}


def _progress(name: str, done: int, required: int) -> str:
    return (
        f"<p><label>{done} of {required} {name}"
        f'<progress value="{done}" max="{required}">{done} of {required}</progress></label></p>'
    )


def _because(reason: str | None) -> str:
    return "" if reason is None else f": {escape(reason)}"


def interlocks_text(state: RigState | None) -> str:
    """What has stopped the actuator, and what is not known of it."""
    trouble = []
    if state is not None and state.rest_unknown is not None:
        trouble.append(
            f'<div class="notice trouble" id="rest-unknown"><b>The actuator was not confirmed at rest.</b> Keep away '
            f"from it, and press the red button. ({escape(state.rest_unknown)})</div>"
        )
    if state is not None and state.phase is Phase.UNKNOWN:
        trouble.append(
            f'<div class="notice trouble" id="silent"><b>{UNKNOWN}</b> ({escape(state.tester_silent or "")})</div>'
        )
    elif state is not None and state.tester_silent is not None:
        trouble.append(
            f'<div class="notice trouble" id="silent"><b>The tester does not answer.</b> Look at its power and its '
            f"line; it is asked again every {LOOK_INTERVAL:g}{THIN}s. ({escape(state.tester_silent)})</div>"
        )
    if state is not None and state.is_tripped:
        said = "".join(f"<li><b>{each}</b></li>" for each in trip_sentences(state))
        trouble.append(f'<div class="notice trouble"><ul>{said}</ul>Remove the cause, then reset.</div>')
    if state is None or not state.is_driven:
        trouble.append("<p>Nothing is known of a machine that is not driven from here.</p>")
    return "<h2>Interlocks</h2>" + ("".join(trouble) or "<p>No interlock has stopped the actuator.</p>")


def _temperature(found: tuple[float, datetime] | None) -> str:
    if found is None:
        return "<h2>Temperature</h2><p>None is stored yet: it is read with every blow and sine point of a run.</p>"
    celsius, at = found
    return f'<h2>Temperature</h2><p class="big">{quantity(celsius, "°C", 3)}</p><p>{moment(at)}</p>'


def _latest(runs: tuple[Run, ...], rig: RigState | None, name: str | None) -> str:
    if not runs:
        return (
            "<h2>Runs</h2><p>There are none. First: check that hammer, accelerometer and tester are connected, then "
            'press <a href="/page/measure">Measure</a>. A bundle from elsewhere comes in with '
            "<code>jointlab import</code>.</p>"
        )
    return table("Latest runs", ("run", "title", "article", "state", "started"), [_row(run, rig, name) for run in runs])


def _row(run: Run, rig: RigState | None, name: str | None) -> tuple[Link | str, ...]:
    return (
        Link(str(run.id), f"/page/results?run={run.id}"),
        run.title,
        run.article,
        run_state(run, rig, name),
        moment(run.began_at),
    )
