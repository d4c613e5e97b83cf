"""The channels: one of them live with the others of its module, and their table."""

from collections import deque
from collections.abc import Mapping
from html import escape

import numpy as np
from nicegui import run, ui

from analysis.chain import power_density
from analysis.frequency_response import Real
from api.page.actions import SHOWN_ERRORS
from api.page.charts import live
from api.page.controls import button, chart, choice, enable, redraw
from api.page.formatting import in_unit
from api.page.frame import Frame
from api.page.instruments import channel_form, channel_table
from api.page.instruments.examinations import progress_text
from api.page.markup import Cell, show, table
from daq.channels import Channel
from jointlab.drive.phase import Phase
from jointlab.supervision.manager import RunManager
from rig.checks.live import LiveBlock, LiveLevel
from store.states import Scope

INTERVAL = 0.1
"""Seconds from one block to the next at least; an instrument that takes longer sets the pace."""
AVERAGED = 10
"""Blocks that the spectrum is the mean of."""


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the part: the form of a channel where the address names one, else the live view and the table."""
    runs = frame.services.runs
    if channel_form.ADD in query or channel_form.CHANNEL in query:
        await channel_form.build(frame, query.get(channel_form.CHANNEL))
        return
    if runs is None or not runs.instruments.channels:
        show("<p>This service drives no rig: it was started without channels.</p>")
    elif Scope.CONTROL in frame.caller.scopes:
        LiveView(frame, runs)
    else:
        show(f"<p>Only a key with the scope {Scope.CONTROL} looks at channels live.</p>")
    await channel_table.build(frame)


class LiveView:
    """One channel live, for the tab that drives, while nothing is carried out; it ends by itself where that changes."""

    def __init__(self, frame: Frame, runs: RunManager) -> None:
        self._frame, self._runs = frame, runs
        self._channels = {each.name: each for each in runs.drive.channels}
        self._channel = next(iter(self._channels))
        self._lease: int | None = None
        self._spectra = deque[Real](maxlen=AVERAGED)
        self._overloaded = set[str]()
        with ui.element("div").classes("row-of"):
            choice("Channel", "channel", {name: name for name in self._channels}, self._choose)
            self._start = button("Look at the channels", self._begin, main=True)
            self._stop = button("Stop looking", self._end)
        self._why = show("").props('aria-live="polite"')
        self._levels = show("")
        with ui.element("div").classes("cards") as self._drawn:
            self._trace = chart("Latest block", {}, "live-signal", height="13rem")
            self._spectrum = chart(f"Mean spectrum of the last {AVERAGED} blocks", {}, "live-spectrum", height="13rem")
        self._drawn.set_visibility(False)
        self._stop.set_visibility(False)
        self._timer = ui.timer(INTERVAL, self._look, active=False)
        frame.refreshes.append(self._follow)

    def _choose(self, name: str) -> None:
        self._channel = name
        self._spectra.clear()

    async def _begin(self) -> None:
        name = self._channel
        self._lease = await self._frame.actions.drive("look at channels", name, lambda _runs, _caller, lease: lease)
        if self._lease is not None:
            self._spectra.clear()
            self._overloaded.clear()
            self._show(True)

    def _end(self) -> None:
        self._lease = None
        self._show(False)

    def _show(self, looking: bool) -> None:
        self._timer.active = looking
        self._start.set_visibility(not looking)
        self._stop.set_visibility(looking)
        self._drawn.set_visibility(looking)
        if not looking:
            self._levels.set_content("")

    async def _follow(self) -> None:
        """Follow the state of the rig."""
        state = self._runs.state
        if state.phase is not Phase.IDLE:
            self._end()
        enable(self._start, state.phase is Phase.IDLE)
        self._why.set_content(progress_text(state))

    async def _look(self) -> None:
        lease, name = self._lease, self._channel
        if lease is None:
            return
        try:
            block = await run.io_bound(self._runs.look, name, lease)
        except SHOWN_ERRORS as error:
            if self._lease is not None and self._runs.state.phase is Phase.IDLE:
                self._frame.tell(str(error))
            self._end()
            return
        if block is not None and self._lease == lease and self._channel == name:
            self._draw(block)

    def _draw(self, block: LiveBlock) -> None:
        unit, samples = self._channels[block.channel].unit, np.asarray(block.samples)
        frequency, power = power_density(samples, block.sample_rate)
        self._spectra.append(power)
        self._overloaded |= {each.name for each in block.levels if each.overloaded}
        self._levels.set_content(levels_table(block.levels, self._channels, self._overloaded))
        redraw(self._trace, live.trace(samples, block.sample_rate, unit))
        redraw(self._spectrum, live.spectrum(frequency, np.mean(self._spectra, axis=0), unit))


def levels_table(levels: tuple[LiveLevel, ...], channels: Mapping[str, Channel], overloaded: set[str]) -> str:
    """Present levels of the channels of a module; `overloaded`: those that were overloaded since the start."""
    rows = [_level(each, channels[each.name], each.name in overloaded) for each in levels]
    head = ("channel", "overload", "mean", "rms about it", "lowest … highest", "bias", "range of the input")
    now = ", ".join(each.name for each in levels if each.overloaded)
    said = f'<p class="notice trouble"><b>Overload: {escape(now)}</b></p>' if now else ""
    return f'<div id="levels">{said}{table("Now, with the others of its module", head, rows)}</div>'


def _level(level: LiveLevel, channel: Channel, was_overloaded: bool) -> tuple[Cell, ...]:
    unit = channel.unit
    overload = "OVERLOAD" if level.overloaded else "was overloaded" if was_overloaded else "none"
    return (
        level.name,
        overload,
        in_unit(level.mean, unit),
        in_unit(level.rms, unit),
        f"{in_unit(level.lowest, unit)} … {in_unit(level.highest, unit)}",
        bias_text(level, channel),
        range_text(level, channel),
    )


def bias_text(level: LiveLevel, channel: Channel) -> str:
    """The bias voltage of an IEPE sensor, where the input lets it pass; a bridge has a supply instead."""
    if channel.bridge is not None:
        return f"bridge, fed with {in_unit(channel.bridge.excitation, 'V')}"
    if not channel.excitation_current:
        return "no IEPE supply"
    match level.dc_coupled:
        case True:
            return in_unit(level.volts, "V")
        case False:
            return "coupled off by the module"
        case None:
            return "the module does not say whether it is coupled off"


def range_text(level: LiveLevel, channel: Channel) -> str:
    """The range of the input in the channel's unit, and whether the range that the table asks for is beyond it."""
    text = f"{in_unit(level.input_low, channel.unit)} … {in_unit(level.input_high, channel.unit)}"
    beyond = channel.minimum < level.input_low or channel.maximum > level.input_high
    return f"{text}: the range asked for is beyond it" if beyond else text
