"""The form of one channel: what is wrong is said at its field, and nothing is written that its input does not take."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

from nicegui import ui
from pydantic import ValidationError

from api.page.controls import button, choice, enable
from api.page.formatting import in_unit
from api.page.frame import Frame
from api.page.instruments.channel_table import KINDS, RESTART, address_of
from api.page.markup import Link, anchor, show
from api.service.access import Caller
from daq.channels import Channel, ChannelKind
from daq.errors import ChannelError
from jointlab.channel_file import ChannelFile, ChannelTable, Row, noted, with_channel, without_channel
from jointlab.channel_texts import NEW, WHOLE, Texts, has_field, row_of, texts_of
from jointlab.errors import JointlabError, SettingsError
from jointlab.instruments import channel_of
from jointlab.settings import ChannelSettings, describe
from jointlab.supervision.manager import RunManager
from store.states import Scope

ADD, CHANNEL = "add", "channel"
"""Fields of the address: a new channel, and the name of one that is changed."""
LABELS = {
    "name": "Name, such as hammer",
    "physical": "Input, such as cDAQ1Mod1/ai0",
    "sensitivity": "Sensitivity, such as 100 mV/g",
    "minimum": "Lowest value, with its unit",
    "maximum": "Highest value, with its unit",
    "excitation_current": "IEPE supply (mA)",
    "excitation": "Supply of the bridge (V)",
    "resistance": "Resistance of an arm (Ω)",
    "noise": "Noise at rest, rms, with its unit",
    "serial": "Serial number of the sensor",
    "certificate": "Certificate",
    "uncertainty": "Uncertainty (%, k = 2)",
    "calibrated_on": "Calibrated on",
    "due_on": "Valid until",
}
DAYS = ("calibrated_on", "due_on")
CONFIGURATIONS = {"full": "full bridge", "half": "half bridge", "quarter": "quarter bridge"}
WITHIN = 1e-6
"""Relative part by which a range may be beyond that of its input, for rounding."""


@dataclass(frozen=True)
class InputCheck:
    """What the acquisition device says of a channel.

    Attributes:
        fits: whether its input takes it; None where that is not known.
        text: the same in a sentence.
    """

    fits: bool | None
    text: str


async def build(frame: Frame, name: str | None) -> None:
    """Build the form of channel `name`, or of a new one, with a link back to the table."""
    show(f"<p>{anchor(Link('Back to the channels', address_of()))}</p>")
    file = frame.services.channel_file
    if file is None:
        show("<p>These are simulated instruments, whose channels are not changed.</p>")
    elif Scope.ENGINEER not in frame.caller.scopes:
        show(f"<p>Only a key with the scope {Scope.ENGINEER} changes the table.</p>")
    elif (found := await frame.read(lambda: _opened(file, name))) is not None:
        ChannelForm(frame, file, *found)


def _opened(file: ChannelFile, name: str | None) -> tuple[ChannelTable, int | None]:
    """The table, and the place of the channel in it.

    Raises JointlabError where the table is not changed from here, or has no such channel.
    """
    if (obstacle := file.obstacle()) is not None:
        raise JointlabError(obstacle)
    table = file.read()
    if name is None:
        return table, None
    place = next((number for number, row in enumerate(table.rows) if row.get("name") == name), None)
    if place is None:
        raise JointlabError(f"{file.path.name} has no channel {name} any more")
    try:
        texts_of(table.rows[place])
    except ValidationError as error:
        raise SettingsError(f"channel {name} of {file.path.name}: {describe(error)}; edit the file by hand") from error
    return table, place


class ChannelForm:
    """The fields, filled from the file, and the buttons that write and remove."""

    def __init__(self, frame: Frame, file: ChannelFile, table: ChannelTable, place: int | None) -> None:
        self._frame, self._file, self._table, self._place = frame, file, table, place
        self._before: Row | None = None if place is None else table.rows[place]
        texts = NEW if self._before is None else texts_of(self._before)
        self._kind, self._configuration = texts["kind"], texts["configuration"]
        self._refused: Row | None = None
        self._fields = dict[str, ui.input]()
        with ui.element("div").classes("w-full") as self._content:
            show(f"<h2>{'A new channel' if place is None else 'Channel ' + escape(texts['name'])}</h2>")
            with ui.element("div").classes("row-of"):
                self._add(texts, "name", "physical")
                choice("Kind", "kind", KINDS, self._choose, self._kind)
            with ui.element("div").classes("row-of"):
                self._add(texts, "sensitivity", "minimum", "maximum", "excitation_current", "excitation")
                with ui.element("div") as self._bridge:
                    choice("Bridge", "bridge", CONFIGURATIONS, self._choose_bridge, self._configuration)
                self._add(texts, "resistance", "noise")
            self._inverted = ui.checkbox("Inverted: a negative voltage for a positive quantity")
            self._inverted.value = texts["polarity"] == "-1"
            with ui.element("div").classes("row-of"):
                self._add(texts, "serial", "certificate", "calibrated_on", "due_on", "uncertainty")
            self._trouble = show("").props('role="alert"')
            self._anyway = ui.checkbox("Write it all the same, for an input that is not there yet")
            self._anyway.set_visibility(False)
            with ui.element("div").classes("row-of"):
                self._main = button(f"Write to {file.path.name}", self._write_once, main=True)
                if place is not None:
                    _asking("Remove this channel", f"Yes, remove it from {file.path.name}", self._remove)
        self._choose(self._kind)

    def _add(self, texts: Texts, *names: str) -> None:
        for name in names:
            field = ui.input(LABELS[name], value=texts[name]).props("outlined hide-bottom-space")
            if name in DAYS:
                field.props("type=date stack-label")
            self._fields[name] = field

    def _choose(self, kind: str) -> None:
        self._kind = kind
        for name, field in self._fields.items():
            field.set_visibility(has_field(ChannelKind(kind), name))
        self._bridge.set_visibility(has_field(ChannelKind(kind), "configuration"))

    def _choose_bridge(self, configuration: str) -> None:
        self._configuration = configuration

    def _texts(self) -> Texts:
        given = {name: str(field.value or "") for name, field in self._fields.items()}
        polarity = "-1" if self._inverted.value else "1"
        return {**given, "kind": self._kind, "configuration": self._configuration, "polarity": polarity}

    def _tell(self, text: str) -> None:
        self._trouble.set_content(f'<p class="notice trouble">{escape(text)}</p>' if text else "")

    async def _write_once(self) -> None:
        """Write, and take no second press meanwhile."""
        enable(self._main, False)
        try:
            await self._write()
        finally:
            if not self._main.is_deleted:  # the form is away where it was written
                enable(self._main, True)

    async def _write(self) -> None:
        self._tell("")
        row, faults = row_of(self._texts(), self._before)
        for name, field in self._fields.items():
            field.error = faults.get(name)
        if faults:
            others = {name: fault for name, fault in faults.items() if name not in self._fields}
            self._tell("; ".join(fault if name == WHOLE else f"{name}: {fault}" for name, fault in others.items()))
            return
        if row == self._before:
            self._tell("nothing was changed")
            return
        found = await check_input(self._frame, channel_of(ChannelSettings.model_validate(row)))
        if found.fits is False and not (self._anyway.value and self._refused == row):
            self._tell(found.text)
            self._refused, self._anyway.value = row, False  # the consent is for what was refused
            self._anyway.set_visibility(True)
            return
        table, place, file = self._table, self._place, self._file
        details = {"before": None if self._before is None else noted(self._before), "after": noted(row)}
        kept = await self._act(
            "add channel" if place is None else "change channel",
            str(row["name"]),
            lambda: file.write(with_channel(table, place, row), table),
            details,
        )
        if kept is not None:
            self._end(f"{row['name']} is written to {file.path.name}", kept, found.text)

    async def _remove(self) -> None:
        table, place, file = self._table, self._place, self._file
        assert place is not None, "a new channel has no button to remove it"
        row = table.rows[place]
        kept = await self._act(
            "remove channel",
            str(row["name"]),
            lambda: file.write(without_channel(table, place), table),
            {"before": noted(row), "after": None},
        )
        if kept is not None:
            self._end(f"{row['name']} is removed from {file.path.name}", kept, "")

    async def _act(self, action: str, name: str, do: Callable[[], Path], details: Mapping[str, object]) -> Path | None:
        def carry_out(_caller: Caller) -> Path:
            return do()

        actions = self._frame.actions.telling(self._tell)
        return await actions.act(Scope.ENGINEER, action, f"channel {name}", carry_out, **details)

    def _end(self, done: str, kept: Path, checked: str) -> None:
        """Show what was done in place of the form."""
        self._content.clear()
        with self._content:
            show(
                f'<p class="notice" id="written">{escape(done)}. <b>It is in force when {RESTART}</b>; until then runs '
                f"are measured with the former values. The file as it was is kept as {escape(kept.name)}.</p>"
                f"<p>{escape(checked)}</p>"
            )


async def check_input(frame: Frame, channel: Channel) -> InputCheck:
    """Whether the input takes the range of `channel`, by its acquisition device; it is asked where nobody else is."""
    said = list[str]()

    def ask(runs: RunManager, _caller: Caller, lease: int) -> tuple[float, float] | str:
        try:
            return runs.input_range(channel, lease)
        except ChannelError as error:
            return str(error)

    if frame.services.runs is None:
        return InputCheck(None, "Its range was not checked: this service drives no rig. Examine the rig later.")
    found = await frame.actions.telling(said.append).drive("ask for range of input", channel.name, ask)
    if found is None:
        return InputCheck(None, f"Its range was not checked: {said[-1]}. Examine the rig before it is used.")
    return (
        InputCheck(False, f"The acquisition device refuses it: {found}")
        if isinstance(found, str)
        else _fit(channel, *found)
    )


def _fit(channel: Channel, low: float, high: float) -> InputCheck:
    takes = f"{in_unit(low, channel.unit)} … {in_unit(high, channel.unit)}"
    margin = WITHIN * (high - low)
    if channel.minimum < low - margin or channel.maximum > high + margin:
        return InputCheck(False, f"Its input takes {takes} only; correct the range, or take another input.")
    return InputCheck(True, f"Its range fits its input, which takes {takes}.")


def _asking(text: str, confirmed: str, do: Callable[[], Awaitable[None]]) -> None:
    """A button that asks before it does something."""

    def ask(is_asked: bool) -> None:
        first.set_visibility(not is_asked)
        for each in (yes, keep):
            each.set_visibility(is_asked)

    first = button(text, lambda: ask(True))
    yes = button(confirmed, do)
    keep = button("Keep it", lambda: ask(False))
    ask(False)
