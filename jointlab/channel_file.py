"""The channel table as the configuration file has it, and its changes: comments, order and all else of the file stay.

Functions on text are pure. `ChannelFile` reads and writes. Before anything is written, the whole configuration is
checked with the change in it.
"""

import os
import re
import stat
import tempfile
import threading
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import tomlkit
from pydantic import ValidationError
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Item

from daq.channels import Channel
from jointlab.errors import ConflictError, JointlabError, SettingsError
from jointlab.instruments import channels_of
from jointlab.settings import Settings, describe

Row = Mapping[str, Any]
"""A channel as the file has it: text, numbers, days, and the table of its bridge."""
VARIABLE = "JOINTLAB_CHANNELS"
BY_HAND = "edit the file by hand"
OTHER_FORM = f"the file has a form that is not changed from here; {BY_HAND}"
_HEAD = re.compile(r"""\s*\[\[\s*(channels|"channels"|'channels')\s*\]\]""")
_OTHER = re.compile(r"""\s*\[(?!\s*(channels|"channels"|'channels')\s*\.)""")
"""The first line of a table of another name; that of a bridge, `[channels.bridge]`, belongs to its channel."""
_NO_KEY = re.compile(r"\s*(#.*)?")


@dataclass(frozen=True)
class ChannelTable:
    """The table as it was read.

    Attributes:
        text: the whole file, for comparison when it is written.
        rows: the channels as they are written, in their order.
    """

    text: str
    rows: tuple[Row, ...]


def table_of(text: str) -> ChannelTable:
    """The channel table of a configuration file. Raises SettingsError where it is no TOML, or has another form."""
    try:
        rows = tomllib.loads(text).get("channels", [])
    except tomllib.TOMLDecodeError as error:
        raise SettingsError(f"the file is not valid TOML: {error}") from error
    if not (isinstance(rows, list) and all(isinstance(row, dict) for row in rows)):
        raise SettingsError("channels is no list of tables; write a table [[channels]] for each sensor")
    return ChannelTable(text, tuple(rows))


def with_channel(table: ChannelTable, place: int | None, row: Row) -> ChannelTable:
    """The table with `row` at `place`, counted from 0, or as a new one after the others.

    Keys whose values stay are left as they are written. Raises SettingsError where the file has a form in which this
    cannot be done.
    """
    newline, lines, spans = _located(table)
    if place is None:
        at = spans[-1][1] if spans else len(lines)
        before, after = _apart(lines[:at], newline), lines[at:]
        if after and after[0].strip():
            after = [newline, *after]
        made = _changed("[[channels]]\n", row)
        rows = (*table.rows, row)
    else:
        begin, end = spans[place]
        before, after = lines[:begin], lines[end:]
        made = _changed("".join(lines[begin:end]).replace("\r\n", "\n"), row)
        rows = (*table.rows[:place], row, *table.rows[place + 1 :])
    return _confirmed(table, "".join([*before, made.replace("\n", newline), *after]), rows)


def without_channel(table: ChannelTable, place: int) -> ChannelTable:
    """The table without the channel at `place`; comments above and below it stay. Raises as `with_channel`."""
    _, lines, spans = _located(table)
    begin, end = spans[place]
    if begin and not any(map(str.strip, [lines[begin - 1], *lines[end : end + 1]])):
        begin -= 1  # one empty line is enough
    return _confirmed(table, "".join(lines[:begin] + lines[end:]), table.rows[:place] + table.rows[place + 1 :])


def _located(table: ChannelTable) -> tuple[str, list[str], list[tuple[int, int]]]:
    """The end of a line, the lines, and of each channel its first line and the one after its last key."""
    lines = re.findall(r"[^\n]*\n|[^\n]+", table.text)
    heads = [number for number, line in enumerate(lines) if _HEAD.match(line)]
    if len(heads) != len(table.rows):
        raise SettingsError(f"the channels are not all written as tables [[channels]]; {BY_HAND}")
    spans = list[tuple[int, int]]()
    for head in heads:
        following = (number for number in range(head + 1, len(lines)) if _OTHER.match(lines[number]))
        end = next(following, len(lines))
        while _NO_KEY.fullmatch(lines[end - 1].rstrip()):
            end -= 1
        spans.append((head, end))
    return ("\r\n" if "\r\n" in table.text else "\n"), lines, spans


def _apart(lines: Sequence[str], newline: str) -> list[str]:
    """Lines with an empty one at their end, where there are any."""
    if not lines or not lines[-1].strip():
        return [*lines]
    return [*lines, newline] if lines[-1].endswith("\n") else [*lines, newline, newline]


def _changed(text: str, row: Row) -> str:
    """The lines of one channel with the values of `row`. Raises SettingsError where they are not one table."""
    try:
        document = tomlkit.parse(text if text.endswith("\n") else f"{text}\n")
    except TOMLKitError as error:
        raise SettingsError(OTHER_FORM) from error
    tables = document["channels"]
    assert isinstance(tables, list), "it begins with [[channels]]"
    _fit(tables[0], row)
    return document.as_string()


def _fit(table: Any, row: Row) -> None:
    """Give a table of tomlkit the keys and values of `row`; what is the same is not touched."""
    for key in [key for key in table if key not in row]:
        del table[key]
    for key, value in row.items():
        known = table.get(key)
        if isinstance(known, Mapping) and isinstance(value, Mapping):
            _fit(known, value)
        elif known != value:
            table[key] = _item(value)


def _item(value: Any) -> Item:
    if isinstance(value, Mapping):
        made = tomlkit.inline_table()
        made.update(value)
        return made
    item: Item = tomlkit.item(value)
    return item


def _confirmed(table: ChannelTable, text: str, rows: Sequence[Row]) -> ChannelTable:
    """The table of `text`, where it has `rows` and all else as before. Raises SettingsError where it has not."""
    try:
        before, after = tomllib.loads(table.text), tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SettingsError(OTHER_FORM) from error
    if after.pop("channels", []) != list(rows) or (before.pop("channels", []), after) != (list(table.rows), before):
        raise SettingsError(OTHER_FORM)
    return ChannelTable(text, tuple(rows))


@dataclass(frozen=True)
class ChannelFile:
    """The configuration file of this program. Any thread may call it.

    Attributes:
        path: of the file; absolute, so that it does not depend on the working folder.
    """

    path: Path
    _lock: threading.Lock = field(default_factory=threading.Lock, compare=False, repr=False)

    def read(self) -> ChannelTable:
        """The table as it is written now. Raises SettingsError where there is none."""
        try:
            return table_of(self.path.read_bytes().decode())
        except (OSError, UnicodeDecodeError) as error:
            why = error.strerror if isinstance(error, OSError) else str(error)
            raise SettingsError(f"{self.path} cannot be read: {why}") from error
        except SettingsError as error:
            raise SettingsError(f"{self.path}: {error}") from error

    @property
    def is_overruled(self) -> bool:
        """Whether the environment has channels, so that those of the file do not count."""
        return VARIABLE in map(str.upper, os.environ)

    def obstacle(self) -> str | None:
        """Why the table cannot be changed here; None where it can."""
        if self.is_overruled:
            return f"the channels are those of the environment variable {VARIABLE}, which wins over {self.path}"
        if not self.path.is_file():
            return f"{self.path} does not exist; write it first"
        if not (os.access(self.path, os.W_OK) and os.access(self._target.parent, os.W_OK)):
            return f"this service may not write {self.path} and its folder; {BY_HAND}, or let its user write both"
        return None

    def write(self, changed: ChannelTable, read: ChannelTable) -> Path:
        """Write `changed`, and return where the file as it was is kept.

        Args:
            changed: made of `read`.
            read: what the file has to be still.

        Raises:
            SettingsError, ChannelError: the configuration would not be valid; nothing is written.
            ConflictError: the file has been changed since.
            JointlabError: it cannot be written.
        """
        with self._lock:
            if (obstacle := self.obstacle()) is not None:
                raise JointlabError(obstacle)
            if self.read().text != read.text:
                raise ConflictError(f"{self.path} has been changed since it was read; look at it again")
            refuse_new_twins(read.rows, changed.rows)
            checked_channels(changed.rows)
            try:
                kept = self._replace(read.text, changed.text)
            except OSError as error:
                raise JointlabError(
                    f"{self.path} cannot be written: {error.strerror or error}; nothing was changed, {BY_HAND}"
                ) from error
            _settle(kept.parent)
            return kept

    @property
    def _target(self) -> Path:
        """The file itself, where the path is a link."""
        return self.path.resolve()

    def _replace(self, former: str, text: str) -> Path:
        """Put `text` in the place of the file in one step, and `former` beside it."""
        target = self._target
        status = target.stat()
        kept = target.with_name(f"{target.name}.before-{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}")
        files = list[str]()
        try:
            for content in (former, text):
                files.append(_written(target, content, status))
            os.rename(files[0], kept)
            files[0] = str(kept)
            os.replace(files[1], target)
        except BaseException:
            for file in files:
                Path(file).unlink(missing_ok=True)
            raise
        return kept


def _settle(folder: Path) -> None:
    """Wait until the names of the files of `folder` are on the disk; JointlabError where that is not confirmed."""
    try:
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)
    except OSError as error:
        raise JointlabError(
            f"the file is written, and its disk does not confirm it ({error.strerror or error}); look at {folder}"
        ) from error


def _written(target: Path, content: str, status: os.stat_result) -> str:
    """A new file beside `target` with `content`, and its owner and permissions; it is on the disk."""
    number, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with open(number, "wb") as file:
            made = os.fstat(file.fileno())
            if (made.st_uid, made.st_gid) != (status.st_uid, status.st_gid):
                os.fchown(file.fileno(), status.st_uid, status.st_gid)
            os.fchmod(file.fileno(), stat.S_IMODE(status.st_mode))
            file.write(content.encode())
            file.flush()
            os.fsync(file.fileno())
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return name


def checked_channels(rows: Iterable[Row]) -> tuple[Channel, ...]:
    """The channels of `rows`, in the configuration of this program.

    Raises SettingsError, ChannelError where it is not valid with them.
    """
    given: dict[str, Any] = {"channels": tuple(rows)}
    try:
        return channels_of(Settings(**given))
    except ValidationError as error:
        raise SettingsError(f"the configuration would not be valid: {describe(error)}") from error


def refuse_new_twins(before: Iterable[Row], after: Iterable[Row]) -> None:
    """Raise SettingsError where two rows have one name or input now, and had not before."""
    for key, what in (("name", "name"), ("physical", "input")):
        counts, known = (Counter(str(row.get(key)) for row in rows) for rows in (after, before))
        if twice := sorted(value for value, count in counts.items() if count > max(known[value], 1)):
            raise SettingsError(f"another channel has the {what} {', '.join(twice)} already; use each once")


def noted(row: Row) -> dict[str, Any]:
    """A row as the audit log keeps it: days as text."""
    return {key: value if isinstance(value, str | int | float | Mapping) else str(value) for key, value in row.items()}
