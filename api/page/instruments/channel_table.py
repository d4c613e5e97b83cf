"""The channel table as it is written, with units and calibrations, and what of it is not in force."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import date
from html import escape
from urllib.parse import urlencode

from api.page.formatting import due, in_unit, quantity
from api.page.frame import Frame
from api.page.markup import Cell, Link, anchor, details, show, table
from daq.channels import Channel, ChannelKind
from jointlab.channel_file import ChannelFile, checked_channels
from jointlab.report.section import Unknown
from jointlab.sensitivity import sensitivity_text
from store.states import Scope

KINDS: Mapping[str, str] = {
    ChannelKind.FORCE_IEPE: "force, IEPE",
    ChannelKind.ACCELERATION_IEPE: "acceleration, IEPE",
    ChannelKind.FORCE_BRIDGE: "force, strain bridge",
    ChannelKind.FORCE_CHARGE: "force, charge",
    ChannelKind.ACCELERATION_CHARGE: "acceleration, charge",
    ChannelKind.VOLTAGE: "voltage",
}

HEAD = (
    "channel", "input", "kind", "sensitivity", "range", "at the input", "sensor", "certificate", "calibrated on",
)  # fmt: skip
WORDS: Mapping[str, str] = {
    "physical": "input", "minimum": "range", "maximum": "range", "excitation_current": "supply", "bridge": "supply",
    "serial": "sensor", "calibrated_on": "day of calibration", "due_on": "last valid day",
}  # fmt: skip
"""By attribute of a channel its name on the page, where it is another one."""
RESTART = "the drive process and the service are started again, with the rig at rest"


def kind_words(kind: str) -> str:
    """The kind of a stored instrument in words: a channel's, or such as "thermometer"."""
    return KINDS.get(kind, kind)


@dataclass(frozen=True)
class Tables:
    """The channel tables that there are.

    Attributes:
        written: of the file; None where there is none that counts.
        drive: that the drive process measures with.
        service: that this service checks sequences with.
    """

    written: tuple[Channel, ...] | None
    drive: tuple[Channel, ...]
    service: tuple[Channel, ...]

    @property
    def are_one(self) -> bool:
        """Whether all that is written is in force."""
        written, drive, service = (
            {each.name: each for each in channels or ()} for channels in (self.written, self.drive, self.service)
        )
        return self.written is None or written == drive == service


def address_of(**query: str) -> str:
    """The address of this part of the page, or of the form of one channel."""
    return f"/page/instruments?{urlencode({'part': 'Channels', **query})}"


async def build(frame: Frame) -> None:
    """Build the table."""
    file, runs = frame.services.channel_file, frame.services.runs
    running = () if runs is None else (runs.drive.channels, runs.instruments.channels)
    if file is None:
        if running:
            show(table("Channels in force", HEAD, map(_row, running[0])))
        show('<p class="quiet">These are simulated instruments, whose channels are not changed.</p>' * bool(running))
        return
    found = await frame.read(lambda: _found(file))
    written, obstacle = found or (None, None)
    tables = Tables(written, *running or ((), ()))
    may_edit = Scope.ENGINEER in frame.caller.scopes and obstacle is None and written is not None
    if not tables.are_one:
        said = f"Runs are measured with the former values until {RESTART}."
        show(f'<p class="notice" id="not-in-force"><b>Not all of this table is in force.</b> {said}</p>')
    if written or tables.drive:
        show(_shown(tables, may_edit, file))
    if not tables.are_one and tables.drive:
        show(details("Channels in force now", table("Channels in force", HEAD, map(_row, tables.drive))))
    if may_edit:
        show(f"<p>{anchor(Link('Add a channel', address_of(add='1')))}</p>")
    elif Scope.ENGINEER not in frame.caller.scopes:
        show(f"<p>Only a key with the scope {Scope.ENGINEER} changes the table.</p>")
    elif obstacle is not None:
        show(f"<p>The table is not changed from here: {escape(obstacle)}.</p>")
    show(
        f'<p class="quiet">They are written in [[channels]] of {escape(file.path.name)}, and read when drive process '
        "and service start. The range of an input is known when the channel was looked at live, and asked for when one "
        "is changed here.</p>"
    )


def _found(file: ChannelFile) -> tuple[tuple[Channel, ...] | None, str | None]:
    """The channels that are written, None where they do not count, and why they are not changed here, if they are not.

    Raises SettingsError, ChannelError where they are not valid.
    """
    written = None if file.is_overruled else checked_channels(file.read().rows)
    return written, file.obstacle()


def _shown(tables: Tables, may_edit: bool, file: ChannelFile) -> str:
    """The table with links to the forms and, where not all is in force, a column that says what is not."""
    if tables.written is None:
        return table("Channels in force", HEAD, map(_row, tables.drive))
    rows = list[Sequence[Cell]]()
    for channel in tables.written:
        name, *others = _row(channel)
        edit = Link(f"Edit {channel.name}", address_of(channel=channel.name)) if may_edit else name
        rows.append((in_force(channel, tables), edit, *others))
    names = {channel.name for channel in tables.written}
    gone = Unknown("until the next start", f"it is not in {file.path.name} any more")
    rows += [(gone, *_row(each)) for each in tables.drive if each.name not in names]
    if tables.are_one:
        return table(f"Channels of {file.path.name}, all in force", HEAD, [row[1:] for row in rows])
    return table(f"Channels of {file.path.name}", ("in force", *HEAD), rows)


def in_force(channel: Channel, tables: Tables) -> Cell:
    """Whether a channel that is written is in force, and what differs where it is not."""
    drive, service = (_named(channel.name, each) for each in (tables.drive, tables.service))
    if drive == service:
        if drive is None:
            return Unknown("no", "it is new")
        other = differing(channel, drive)
        return Unknown("no", f"measured with another {other}") if other else "yes"
    faults = list[str]()
    for who, known in (("the drive process", drive), ("the service", service)):
        if known is None:
            faults.append(f"{who} does not know it")
        elif other := differing(channel, known):
            faults.append(f"{who} has another {other}")
    return Unknown("no", "; ".join(faults))


def differing(one: Channel, other: Channel) -> str:
    """What is different in two channels, in words; empty where nothing is."""
    names = (each.name for each in fields(Channel) if getattr(one, each.name) != getattr(other, each.name))
    return ", ".join(dict.fromkeys(WORDS.get(name, name) for name in names))


def _named(name: str, channels: Iterable[Channel]) -> Channel | None:
    return next((each for each in channels if each.name == name), None)


def _row(channel: Channel) -> tuple[Cell, ...]:
    at_input = channel.kind.input_unit
    ends = [in_unit(channel.sensitivity * end, at_input) for end in (channel.minimum, channel.maximum)]
    uncertainty = "" if channel.uncertainty is None else f", ±{quantity(100 * channel.uncertainty, '%')}"
    return (
        channel.name,
        channel.physical,
        KINDS[channel.kind] + _supply(channel),
        sensitivity_text(channel.sensitivity, channel.unit, at_input) + (", inverted" if channel.polarity < 0 else ""),
        f"{in_unit(channel.minimum, channel.unit)} … {in_unit(channel.maximum, channel.unit)}",
        " … ".join(ends),
        channel.serial or "not given",
        f"{channel.certificate or 'not given'}{uncertainty}",
        due(channel.calibrated_on, channel.due_on) + _until(channel.due_on),
    )


def _supply(channel: Channel) -> str:
    if channel.bridge is None:
        return f", {in_unit(channel.excitation_current, 'A')}" * bool(channel.excitation_current)
    bridge = channel.bridge
    return f": {bridge.configuration}, {quantity(bridge.resistance, 'Ω')}, {in_unit(bridge.excitation, 'V')}"


def _until(due_on: date | None) -> str:
    return "" if due_on is None or date.today() > due_on else f", valid until {due_on}"
