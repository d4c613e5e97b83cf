"""The channel table in its file: what is changed, what stays, and what is refused with the file untouched."""

import os
import stat
import tomllib
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from daq.errors import ChannelError
from jointlab.channel_file import (
    ChannelFile,
    ChannelTable,
    Row,
    checked_channels,
    noted,
    table_of,
    with_channel,
    without_channel,
)
from jointlab.errors import ConflictError, JointlabError, SettingsError
from jointlab.settings import CONFIG_VARIABLE, load_settings

TEXT = """# The rig in room 12.
rig = "north"   # as on its door
daq_address = "local"

# hammers
[[channels]]
name = "hammer"      # the small one
physical = "cDAQ1Mod1/ai0"
kind = "force_iepe"
sensitivity = "2.25 mV/N"   # K-17
unit = "N"
# noise = 0.02
minimum = -2_000
maximum = 2e3

# accelerometers
[[channels]]
name = "accelerometer"
physical = "cDAQ1Mod1/ai1"
kind = "acceleration_iepe"
sensitivity = "100 mV/g"
unit = "m/s^2"
minimum = -450
maximum = 450
excitation_current = 0.002

# what is told
[log]
form = "json"   # for the collector
"""
LOAD_CELL: Row = {
    "name": "force", "physical": "cDAQ1Mod3/ai0", "kind": "force_bridge", "unit": "N", "sensitivity": "0.4 mV/V/kN",
    "minimum": -5000, "maximum": 5000.0, "calibrated_on": date(2026, 3, 2), "bridge": {"excitation": 5.0},
}  # fmt: skip


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ChannelFile:
    """The configuration file of this process."""
    for name in [name for name in os.environ if name.startswith("JOINTLAB_")]:
        monkeypatch.delenv(name)
    path = tmp_path / "jointlab.toml"
    path.write_bytes(TEXT.encode())
    monkeypatch.setenv(CONFIG_VARIABLE, str(path))
    return ChannelFile(path)


def changed(table: ChannelTable, place: int, **values: Any) -> ChannelTable:
    return with_channel(table, place, {**table.rows[place], **values})


def test_a_changed_value_leaves_every_other_character() -> None:
    made = changed(table_of(TEXT), 0, sensitivity="2.31 mV/N")
    assert made.text == TEXT.replace("2.25 mV/N", "2.31 mV/N")


def test_a_new_key_stands_with_its_channel_and_comments_with_theirs() -> None:
    made = changed(table_of(TEXT), 0, serial="4711", calibrated_on=date(2026, 3, 2))
    after = 'maximum = 2e3\nserial = "4711"\ncalibrated_on = 2026-03-02\n\n# accelerometers\n'
    assert made.text == TEXT.replace("maximum = 2e3\n\n# accelerometers\n", after)


def test_a_key_is_removed_alone() -> None:
    table = table_of(TEXT)
    made = with_channel(table, 1, {key: value for key, value in table.rows[1].items() if key != "excitation_current"})
    assert made.text == TEXT.replace("excitation_current = 0.002\n", "")


def test_a_new_channel_comes_after_the_others_and_before_the_comment_of_the_next_table() -> None:
    made = with_channel(table_of(TEXT), None, LOAD_CELL)
    begin, end = TEXT[: TEXT.index("\n# what is told")], TEXT[TEXT.index("\n# what is told") :]
    assert made.text.startswith(f'{begin}\n[[channels]]\nname = "force"\nphysical = "cDAQ1Mod3/ai0"\n')
    assert made.text.endswith("calibrated_on = 2026-03-02\nbridge = {excitation = 5.0}\n" + end)
    assert tomllib.loads(made.text)["channels"] == [*table_of(TEXT).rows, LOAD_CELL]


@pytest.mark.parametrize("text", [TEXT, TEXT[: TEXT.index("\n# what is told")], "", 'rig = "north"\n'])
def test_a_channel_that_is_added_and_removed_leaves_the_file_as_it_was(text: str) -> None:
    table = table_of(text)
    assert without_channel(with_channel(table, None, LOAD_CELL), len(table.rows)).text == text


def test_comments_around_a_removed_channel_stay() -> None:
    first = without_channel(table_of(TEXT), 0)
    assert "# hammers\n\n# accelerometers\n[[channels]]\n" in first.text
    assert (
        without_channel(first, 0).text
        == TEXT[: TEXT.index("[[channels]]")] + "\n# accelerometers\n" + (TEXT[TEXT.index("\n# what is told") :])
    )


@pytest.mark.parametrize("text", ["", 'rig = "north"', 'rig = "north"\n\n', '[log]\nform = "json"\n', "\n\n# none\n"])
def test_the_first_channel_is_written_into_a_file_without_any(text: str) -> None:
    made = with_channel(table_of(text), None, LOAD_CELL)
    assert made.text.startswith(text)
    assert made.rows == (LOAD_CELL,)


def test_a_bridge_in_a_table_of_its_own_belongs_to_its_channel() -> None:
    text = (
        '[[channels]]\nname = "force"\n[channels.bridge]\nexcitation = 5 # V\n\n# next\n[[channels]]\nname = "hammer"\n'
    )
    made = changed(table_of(text), 0, serial="4711", bridge={"excitation": 10, "resistance": 120})
    assert "excitation = 10 # V\nresistance = 120\n\n# next\n" in made.text
    assert [row["name"] for row in without_channel(made, 0).rows] == ["hammer"]


def test_lines_of_another_system_stay_those_of_that_system() -> None:
    made = with_channel(changed(table_of(TEXT.replace("\n", "\r\n")), 0, serial="4711"), None, LOAD_CELL)
    assert made.text.count("\r\n") == made.text.count("\n")
    assert '# K-17\r\nunit = "N"\r\n' in made.text


@pytest.mark.parametrize(
    "text",
    [
        'channels = [{ name = "hammer" }]\n',
        '[[channels]]\nname = """\n[[channels]]\n"""\n',
        '[[channels]]\nname = """\n[log]\n"""\n',
    ],
)
def test_a_file_of_another_form_is_left_to_a_person(text: str) -> None:
    with pytest.raises(SettingsError, match="edit the file by hand"):
        changed(table_of(text), 0, serial="4711")


@pytest.mark.parametrize(("text", "why"), [("channels =", "not valid TOML"), ("channels = 7", "no list of tables")])
def test_a_table_that_cannot_be_read_is_refused(text: str, why: str) -> None:
    with pytest.raises(SettingsError, match=why):
        table_of(text)


def test_what_is_written_is_in_force_at_the_next_start_and_the_former_file_is_kept(file: ChannelFile) -> None:
    file.path.chmod(0o640)
    read = file.read()
    kept = file.write(changed(read, 0, sensitivity="2.31 mV/N"), read)
    assert [channel.sensitivity for channel in load_settings().channels] == pytest.approx([2.31e-3, 0.1 / 9.80665])
    assert kept.read_bytes().decode() == TEXT
    assert kept.name.startswith("jointlab.toml.before-20")
    assert {stat.S_IMODE(each.stat().st_mode) for each in (file.path, kept)} == {0o640}
    assert sorted(file.path.parent.iterdir()) == sorted([file.path, kept])


def test_a_link_to_the_file_stays_a_link(file: ChannelFile, tmp_path: Path) -> None:
    (tmp_path / "etc").mkdir()
    target = file.path.rename(tmp_path / "etc" / "rig.toml")
    file.path.symlink_to(target)
    read = file.read()
    file.write(changed(read, 0, serial="4711"), read)
    assert file.path.is_symlink()
    assert "4711" in target.read_text("utf-8")


def untouched(file: ChannelFile, text: str = TEXT) -> bool:
    return [each.name for each in file.path.parent.iterdir()] == [file.path.name] and file.path.read_text(
        "utf-8"
    ) == text


def test_a_file_that_was_changed_meanwhile_is_refused(file: ChannelFile) -> None:
    read = file.read()
    file.path.write_text(TEXT + "# by hand\n", encoding="utf-8")
    with pytest.raises(ConflictError, match="has been changed since it was read"):
        file.write(changed(read, 0, serial="4711"), read)
    assert untouched(file, TEXT + "# by hand\n")


@pytest.mark.parametrize(
    ("values", "error", "why"),
    [
        ({"sensitivity": "100 mV/g"}, SettingsError, r"channels\.0\.sensitivity.* unit of the channel is N"),
        ({"maximum": -3000}, ChannelError, "range -2000.0 to -3000.0 N is empty"),
        ({"sensitivity": 2250.0}, ChannelError, "more than any module takes"),
        ({"colour": "red"}, SettingsError, r"channels\.0\.colour: there is no such key"),
        ({"name": "accelerometer"}, SettingsError, "another channel has the name accelerometer already"),
        ({"physical": "cDAQ1Mod1/ai1"}, SettingsError, "another channel has the input cDAQ1Mod1/ai1 already"),
    ],
)
def test_a_wrong_value_is_refused_before_anything_is_written(
    file: ChannelFile, values: dict[str, Any], error: type[Exception], why: str
) -> None:
    read = file.read()
    with pytest.raises(error, match=why):
        file.write(changed(read, 0, **values), read)
    assert untouched(file)


def test_two_channels_that_had_one_input_before_can_be_changed(file: ChannelFile) -> None:
    file.path.write_text(TEXT.replace("Mod1/ai1", "Mod1/ai0"), encoding="utf-8")
    read = file.read()
    file.write(changed(read, 0, serial="4711"), read)
    assert load_settings().channels[0].serial == "4711"


def test_the_whole_configuration_has_to_be_valid(file: ChannelFile) -> None:
    text = TEXT + "\n[drive]\nstop_port = -1\n"
    file.path.write_text(text, encoding="utf-8")
    read = file.read()
    with pytest.raises(SettingsError, match=r"drive\.stop_port"):
        file.write(changed(read, 0, serial="4711"), read)
    assert untouched(file, text)


def test_channels_of_the_environment_are_not_changed_in_a_file_that_does_not_hold(
    file: ChannelFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("jointlab_channels", "[]")
    read = file.read()
    assert "environment variable JOINTLAB_CHANNELS" in str(file.obstacle())
    with pytest.raises(JointlabError, match="environment variable JOINTLAB_CHANNELS"):
        file.write(changed(read, 0, serial="4711"), read)
    assert untouched(file)


def test_a_file_that_the_service_may_not_write_is_left(file: ChannelFile, monkeypatch: pytest.MonkeyPatch) -> None:
    assert file.obstacle() is None
    monkeypatch.setattr(os, "access", lambda path, mode: path != file.path)
    read = file.read()
    with pytest.raises(JointlabError, match="may not write"):
        file.write(changed(read, 0, serial="4711"), read)
    assert untouched(file)


@pytest.mark.parametrize("call", ["replace", "rename", "fsync", "fchmod"])
def test_a_write_that_fails_leaves_the_file_and_nothing_beside_it(
    file: ChannelFile, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    def fail(*_arguments: object) -> None:
        raise OSError(16, "Device or resource busy")

    monkeypatch.setattr(os, call, fail)
    read = file.read()
    with pytest.raises(JointlabError, match="cannot be written: Device or resource busy; nothing was changed"):
        file.write(changed(read, 0, serial="4711"), read)
    assert untouched(file)


def test_a_disk_that_does_not_confirm_the_new_file_is_told(file: ChannelFile, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.fsync

    def fail_for_a_folder(number: int) -> None:
        if stat.S_ISDIR(os.fstat(number).st_mode):
            raise OSError(5, "Input/output error")
        real(number)

    monkeypatch.setattr(os, "fsync", fail_for_a_folder)
    read = file.read()
    with pytest.raises(JointlabError, match="the file is written, and its disk does not confirm it"):
        file.write(changed(read, 0, serial="4711"), read)
    assert file.read().rows[0]["serial"] == "4711"


def test_a_file_that_is_not_there_is_told(file: ChannelFile) -> None:
    file.path.unlink()
    assert "does not exist" in str(file.obstacle())
    with pytest.raises(SettingsError, match="cannot be read: No such file"):
        file.read()


def test_the_audit_log_has_days_as_text() -> None:
    assert noted(LOAD_CELL) == {**LOAD_CELL, "calibrated_on": "2026-03-02"}


WORDS = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
DAYS = st.dates(date(1990, 1, 1), date(2100, 1, 1))
KINDS = [("force_iepe", "N", "mV/N"), ("acceleration_iepe", "m/s^2", "mV/g"), ("voltage", "m", "mV/mm")]


@st.composite
def valid_rows(draw: st.DrawFn) -> dict[str, Any]:
    """A channel of the table that is valid by itself."""
    kind, unit, sensitivity_unit = draw(st.sampled_from(KINDS))
    sensitivity = draw(st.floats(1e-3, 10.0))
    row = {
        "name": draw(st.from_regex(r"[a-z][a-z0-9_]{0,49}", fullmatch=True)),
        "physical": draw(WORDS),
        "kind": kind,
        "unit": unit,
        "sensitivity": draw(st.sampled_from([f"{sensitivity:.17g} {sensitivity_unit}", sensitivity * 1e-3])),
        "minimum": draw(st.floats(-10, 0) | st.integers(-10, 0)),
        "maximum": draw(st.floats(1e-6, 10) | st.integers(1, 10)),
    }
    optional = {
        "serial": WORDS,
        "certificate": WORDS,
        "calibrated_on": DAYS,
        "due_on": DAYS,
        "uncertainty": st.floats(0, 1, exclude_min=True, exclude_max=True),
        "noise": st.floats(1e-12, 1e9),
        "polarity": st.sampled_from([1, -1]),
    }
    return row | {key: draw(values) for key, values in optional.items() if draw(st.booleans())}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
@given(row=valid_rows(), place=st.sampled_from([None, 0, 1]))
def test_any_valid_channel_is_read_back_as_it_was_written(
    file: ChannelFile, row: dict[str, Any], place: int | None
) -> None:
    file.path.write_bytes(TEXT.encode())
    read = file.read()
    others = [each for number, each in enumerate(read.rows) if number != place]
    if row["name"] in {each["name"] for each in others}:
        return
    file.write(with_channel(read, place, row), read)
    assert file.read().rows == (*read.rows[:place], row, *(read.rows[place + 1 :] if place is not None else ()))
    again = load_settings().channels[2 if place is None else place].model_dump(exclude_unset=True)
    expected = checked_channels([row])[0]
    assert all(again[key] == getattr(expected, key) for key in row)
    comments = [line for line in TEXT.splitlines() if line.startswith("#") and line != "# noise = 0.02"]
    assert not [line for line in comments if line not in file.read().text.splitlines()]
