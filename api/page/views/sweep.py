"""The sweep: live displacement and force, amplitude reached against asked, k and gamma growing point by point."""

from collections.abc import Mapping

import numpy as np
from nicegui import ui

from api.page.address import current_run
from api.page.charts import sines
from api.page.charts.axes import low
from api.page.controls import chart, redraw
from api.page.formatting import duration, quantity, scaled
from api.page.frame import Frame
from api.page.markup import show, tabs
from api.page.steering import steering
from jointlab.drive.state import RigState
from jointlab.supervision.run_progress import time_left
from jointlab.supervision.sweep_progress import Signals, SweepProgress, UncorrectedPoint, sweep_progress
from rig.operator import loading_text

LOOP = "Force over displacement"
BELOW = "max(var(--chart), 11rem)"
"""CSS height of the two lower charts; on a low screen they are visible only after scrolling."""


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the view of the run and the mounting that the address names, or of what is carried out or was last."""
    with ui.element("div").classes("live"):
        with ui.element("div").classes("live-orders"):
            steering(frame, query)
        progress = show("").classes("live-outcome")
        choice = show("").classes("live-place")
        with ui.element("div").classes("live-charts with-loop"):
            drawn = [
                chart(LOOP, {}, "loop", height="var(--tall)"),
                chart("Stiffness k, uncorrected", {}, "stiffness", height="var(--chart)"),
                chart("Loss factor γ, uncorrected", {}, "loss-factor", height="var(--chart)"),
                chart("Signals of the latest point", {}, "signals", height=BELOW),
                chart("Amplitude reached over asked", {}, "amplitude", height=BELOW),
            ]
    mounting = (query["specimen"], query["configuration"]) if {"specimen", "configuration"} <= set(query) else None

    def look() -> tuple[SweepProgress, ...]:
        run_id = current_run(frame.services, query)
        return () if run_id is None else (sweep_progress(frame.services.catalogue, run_id, mounting),)

    async def refresh() -> None:
        read = await frame.read(look)
        if read is None:
            return
        if not read:
            progress.set_content("<p>No sweep yet. Press <a href='/page/measure?parts=sweep'>Measure</a>.</p>")
            return
        (found,) = read
        progress.set_content(_progress(found, frame.services.rig_state))
        choice.set_content(_choice(found))
        _draw(drawn, found)

    frame.refreshes.append(refresh)


def _progress(found: SweepProgress, state: RigState | None) -> str:
    done, step = len(found.taken_at), found.step
    wanted = state.sines_wanted if state is not None and state.run_id == found.run.id else step.points if step else done
    busy = state is not None and state.phase.is_of_a_run and state.run_id == found.run.id
    left = time_left(found.taken_at, wanted - done) if busy else None
    text = f'<p id="count">{done} of {wanted} sine points{"" if left is None else f"; {duration(left)} left"}</p>'
    bar = f'<progress value="{done}" max="{max(wanted, 1)}" aria-label="sine points">{done} of {wanted}</progress>'
    return f"<div>{text}{bar}</div>{_latest(found.points[-1]) if found.points else ''}"


def _latest(point: UncorrectedPoint) -> str:
    record = point.record
    return (
        f'<p id="latest">Latest: {quantity(record.frequency, "Hz")}, '
        f"{quantity(record.reached_pp_mm, 'mm')} reached of {quantity(record.commanded_pp_mm, 'mm')} asked; "
        f"k = {scaled(point.stiffness, 'N/m')}, γ = {quantity(point.loss_factor, '')}</p>"
    )


def _loop_caption(signals: Signals) -> str:
    if signals.loop is None:
        return LOOP
    return f"{LOOP}: {scaled(signals.loop.dissipated, 'J')} a cycle"


def _choice(found: SweepProgress) -> str:
    if not found.mountings:
        return "<p>No sine point yet. Mount what is asked for above, then press Done.</p>"
    links = {
        f"{specimen} {loading_text(configuration)}": (
            f"/page/sweep?run={found.run.id}&specimen={specimen}&configuration={configuration}"
        )
        for specimen, configuration in found.mountings
    }
    return tabs("mountings", links, " in ".join(found.mounting))


def _draw(drawn: list[ui.echart], found: SweepProgress) -> None:
    loop, stiffness, loss, signals, amplitude = drawn
    if found.signals is not None:
        redraw(loop, sines.loop(found.signals), _loop_caption(found.signals))
        redraw(signals, sines.signals(found.signals.time, found.signals.displacement, found.signals.force))
    if not found.points:
        return  # axes without a point tell nothing
    asked = [(point.record.commanded_pp_mm, point.record.frequency, point) for point in found.points]
    reached = [(a, f, (p.record.reached_pp_mm or np.nan) / a) for a, f, p in asked]
    redraw(amplitude, low(sines.amplitudes(sines.by_amplitude(reached))))
    k = [(a, f, p.stiffness / 1e6) for a, f, p in asked if p.stiffness is not None]
    gamma = [(a, f, p.loss_factor) for a, f, p in asked if p.loss_factor is not None]
    redraw(stiffness, low(sines.over_frequency(sines.by_amplitude_words(sines.by_amplitude(k)), "k (MN/m)")))
    redraw(loss, low(sines.over_frequency(sines.by_amplitude_words(sines.by_amplitude(gamma)), "γ")))
