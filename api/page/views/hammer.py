"""The hammer session: the next point, each blow with its verdict, and the accelerance so far."""

from collections.abc import Mapping
from html import escape
from typing import NamedTuple

import numpy as np
from nicegui import ui

from api.page.address import current_run
from api.page.charts import blows as charts
from api.page.charts.beam import beam_drawing
from api.page.controls import chart, redraw
from api.page.formatting import accepted_text, quantity
from api.page.frame import Frame
from api.page.markup import show, table
from api.page.repeat_point import RepeatPoint
from api.page.steering import steering
from jointlab.report.section import number
from jointlab.supervision.hammer_progress import HammerProgress, hammer_progress
from store.measurements.blows import Blow

CAPTIONS = {
    "force": "Force of the last blow",
    "accelerance": "Accelerance so far",
    "spectrum": "Spectrum",
    "coherence": "Coherence so far",
}
"""Captions of the charts that are seen while somebody strikes: the coherence under its accelerance."""


class _Charts(NamedTuple):
    """Those charts, in this order."""

    force: ui.echart
    accelerance: ui.echart
    spectrum: ui.echart
    coherence: ui.echart


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view of the run that the address names, or of the present or the latest one."""
    with ui.element("div").classes("live"):
        with ui.element("div").classes("live-orders"):
            steering(frame, query)
        verdict = show("").classes("live-outcome").props('aria-live="polite"')
        drawing = show("").classes("live-place")
        with ui.element("div").classes("live-charts"):
            drawn = _Charts(*(chart(caption, {}, name, height="var(--chart)") for name, caption in CAPTIONS.items()))
    response = chart("Response to the last blow", {}, "response", height="15rem")
    listed = show("")
    repeat = RepeatPoint(frame)

    async def refresh() -> None:
        read = await frame.read(lambda: _progress(frame, query))
        if read is None:
            return
        if not read:
            drawing.set_content("<p>No hammer session yet. Press <a href='/page/measure'>Measure</a> to start one.</p>")
            return
        (found,) = read
        drawing.set_content(_drawing(found))
        verdict.set_content(_verdict(found))
        listed.set_content(_list(found))
        repeat.offer(found)
        _draw(drawn, response, found)

    frame.refreshes.append(refresh)


def _progress(frame: Frame, query: Mapping[str, str]) -> tuple[HammerProgress, ...]:
    """The progress of the run that the view shows, if there is one."""
    run_id = current_run(frame.services, query)
    if run_id is None:
        return ()
    return (hammer_progress(frame.services.catalogue, run_id, _present_point(frame, run_id)),)


def _present_point(frame: Frame, run_id: int) -> str | None:
    """The point that is being struck, where the run is carried out."""
    runs = frame.services.runs
    return runs.state.point if runs is not None and runs.state.run_id == run_id else None


def _drawing(found: HammerProgress) -> str:
    article = found.article
    drawn = beam_drawing(
        article.node_positions,
        {joint.name: joint.node for joint in article.joints},
        f"{article.accelerometer.node}{article.accelerometer.direction}",
        found.counts,
        found.next_point,
    )
    return f'<div class="beam" tabindex="0" role="region" aria-label="points on the beam">{drawn}</div>'


def _verdict(found: HammerProgress) -> str:
    count = f'<span id="count">{accepted_text(found.counts)} in set {found.set_number}.</span>'
    if not found.blows:
        first = "No blow yet: strike the highlighted point once, straight and short."
        return f"<p>{first}</p><p>{count}</p>"
    blow, inconsistency = found.blows[-1]
    text, colour = verdict_of(blow, inconsistency)
    return (
        f'<p class="big" id="verdict"><span class="badge {colour}">{escape(text)}</span></p>'
        f"<p>Blow {blow.number} at {blow.point}, peak {quantity(blow.peak_force, 'N')}. {count}</p>"
    )


def verdict_of(blow: Blow, inconsistency: str | None) -> tuple[str, str]:
    """The verdict on a blow in words, and the CSS class that colours them."""
    if not blow.accepted:
        return f"✗ refused: {blow.reason}", "refused"
    if inconsistency is not None:
        return f"✗ left out: {inconsistency}", "refused"
    return "✓ accepted", "accepted"


def _list(found: HammerProgress) -> str:
    if not found.blows:
        return ""
    point = found.blows[0][0].point
    rows = [
        (str(blow.number), number(blow.peak_force or np.nan), verdict_of(blow, why)[0]) for blow, why in found.blows
    ]  # fmt: skip
    return table(f"Blows at {point}", ("blow", "peak force (N)", "verdict"), reversed(rows))


def _draw(drawn: _Charts, response: ui.echart, found: HammerProgress) -> None:
    if found.last is not None:
        pulse = found.last.pulse
        force = charts.force(found.last.time, found.last.force)
        redraw(drawn.force, force, f"{CAPTIONS['force']}: {quantity(1e3 * pulse.duration, 'ms')}")
        redraw(drawn.spectrum, charts.spectrum(pulse), f"{CAPTIONS['spectrum']}: {charts.reach_text(pulse)}")
        redraw(response, charts.response(found.last.time, found.last.acceleration))
    if found.responses is not None:
        redraw(drawn.accelerance, charts.accelerance(found.responses.frequency, np.abs(found.responses.accelerance[0])))
        if found.responses.coherence is not None:
            redraw(drawn.coherence, charts.coherence(found.responses.frequency, found.responses.coherence[0]))
