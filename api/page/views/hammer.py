"""The hammer session: where to strike next, each blow with its verdict, and what the blows say so far."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import numpy as np
from nicegui import ui

from api.page.charts import blows as charts
from api.page.charts.beam import beam_drawing
from api.page.controls import chart, redraw
from api.page.current_run import current_run
from api.page.formatting import quantity
from api.page.frame import Frame
from api.page.hammer_session import HammerSession, hammer_session
from api.page.markup import show, table
from api.page.repeat_point import Redo
from api.page.steering import steering
from jointlab.report.section import number
from store.blows import Blow


def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view of the run that the address names, or of the one that is carried out or was last."""
    steering(frame, query)
    drawing = show("")
    verdict = show("").props('aria-live="polite"')
    with ui.element("div").classes("cards"):
        drawn = [
            chart("Force of the last blow", {}, "force", height="15rem"),
            chart("Response to it", {}, "response", height="15rem"),
            chart("Accelerance so far", {}, "accelerance", height="15rem"),
            chart("Coherence so far", {}, "coherence", height="15rem"),
        ]
    listed = show("")
    redo = Redo(frame)

    async def refresh() -> None:
        run_id = current_run(frame.services, query)
        if run_id is None:
            drawing.set_content("<p>No hammer session yet. Press <a href='/page/measure'>Measure</a> to start one.</p>")
            return
        found = await frame.read(lambda: hammer_session(frame.services.catalogue, run_id, _at_work(frame, run_id)))
        if found is None:
            return
        drawing.set_content(_drawing(found))
        verdict.set_content(_verdict(found))
        listed.set_content(_list(found))
        redo.offer(found)
        _draw(drawn, found)

    frame.refreshes.append(refresh)


def _at_work(frame: Frame, run_id: int) -> str | None:
    """The point that is struck now, where the run is the one that is carried out."""
    runs = frame.services.runs
    return runs.state.point if runs is not None and runs.state.run_id == run_id else None


def _drawing(found: HammerSession) -> str:
    article = found.article
    drawn = beam_drawing(
        article.node_positions,
        {joint.name: joint.node for joint in article.joints},
        f"{article.accelerometer.node}{article.accelerometer.direction}",
        found.counts,
        found.following,
    )
    done, wanted = (sum(count[index] for count in found.counts.values()) for index in (0, 1))
    return f'{drawn}<p id="count">{done} of {wanted} blows accepted in set {found.set_number}.</p>'


def _verdict(found: HammerSession) -> str:
    if not found.blows:
        return "<p>No blow yet: strike the lit point once, straight and short, as hard as before.</p>"
    blow, suspicion = found.blows[-1]
    text, colour = verdict_of(blow, suspicion)
    return (
        f'<p class="big" id="verdict"><span class="badge {colour}">{escape(text)}</span></p>'
        f"<p>Blow {blow.number} at {blow.point}, peak {quantity(blow.peak_force, 'N')}</p>"
    )


def verdict_of(blow: Blow, suspicion: str | None) -> tuple[str, str]:
    """What became of a blow, in words, and the class that colours them."""
    if not blow.accepted:
        return f"✗ refused: {blow.reason}", "refused"
    if suspicion is not None:
        return f"✗ left out: {suspicion}", "refused"
    return "✓ accepted", "accepted"


def _list(found: HammerSession) -> str:
    if not found.blows:
        return ""
    point = found.blows[0][0].point
    rows = [
        (str(blow.number), number(blow.peak_force or np.nan), verdict_of(blow, why)[0]) for blow, why in found.blows
    ]  # fmt: skip
    return table(f"Blows at {point}", ("blow", "peak force (N)", "verdict"), reversed(rows))


def _draw(drawn: list[ui.echart], found: HammerSession) -> None:
    force, response, accelerance, coherence = drawn
    if found.last is not None:
        redraw(force, charts.force(found.last.time, found.last.force))
        redraw(response, charts.response(found.last.time, found.last.acceleration))
    if found.so_far is not None:
        redraw(accelerance, charts.accelerance(found.so_far.frequency, np.abs(found.so_far.accelerance[0])))
        if found.so_far.coherence is not None:
            redraw(coherence, charts.coherence(found.so_far.frequency, found.so_far.coherence[0]))
