"""Maps as TOML files: what is wrong is said with its line and name."""

from pathlib import Path

import pytest

from rig.registers import Kind
from rig.tester.register_map_file import TesterMapError, read_tester_map
from tests.rig.mapped import EXAMPLE

TEXT = EXAMPLE.read_text(encoding="utf-8")


def test_the_example_is_read_in_few_transactions() -> None:
    found = read_tester_map(EXAMPLE)
    assert [(block.kind, block.address, block.count) for block in found.status] == [(Kind.HOLDING, 512, 15)]
    assert found.name == "PLC 5012"


@pytest.mark.parametrize(
    ("line", "instead", "words"),
    [
        ('cycles = { address = 518, type = "u32" }', "", r"line \d+, status: has no cycles; the driver needs it"),
        ('type = "i16", unit = "N"', 'type = "i16", unit = "mm"', "force_mean has unit mm; it has to be one of N, kN"),
        ('first_word = "low"', 'first_wrod = "low"', r"line \d+, first_wrod: there is no such key"),
        ("address = 514", "address = 70000", r"line 27, status.displacement_mean.address: is 70000"),
        ('address = 514, type = "i32"', 'address = 514, type = "i64"', "line 27, .*'i64'; it has to be 'u16'"),
        ("held = {", "helt = {", "held"),
        ('held = { register = "flags", value', 'held = { register = "flags", bit = 2, value', "give either bit"),
        ('tripped = { register = "flags"', 'tripped = { register = "flag"', "tripped looks at flag, which is no"),
        ("hold = [{ address = 256, value = 2 }]", "", "commands: has no hold"),
        ("hold = [{ address = 256, value = 2 }]", "hold = [{ address = 256, value = 1 }]",
         "hold writes what hydraulics_on writes, and would switch them on"),
        ('cycle = [{ set = "amplitude" }, {', "cycle = [{", "cycle sets frequency; it has to set amplitude, frequency"),
        ("hold = [{ address", 'hold = [{ set = "preset" }, { address', "hold sets preset; it has to set nothing"),
        ("[{ address = 256, value = 8 }]", "[]", "reset has to end with an address or a coil"),
        ("[{ address = 256, value = 8 }]", "[{ address = 256, coil = 1 }]", "give one of set, address"),
        ("scale = 0.01", "scale = 0", "scale: is 0; give what one count"),
        ("watchdog_time = 2.0", "watchdog_time = 100.0", r"heartbeat.watchdog_time: is 100.0; it has to be 10 or less"),
        ("address = 516", "address = 515", "displacement_pp of status begins at 515, within displacement_mean"),
        ("name =", "name", "is not valid TOML"),
        ("coil = 3", 'set = "preset"', "emergency_stop: sets preset, .* give an address or a coil"),
        ('"alarms", bit = 0', '"alarms", bit = 16', "emergency_stop looks at bits beyond the 16 of alarms"),
        ('"alarms", bit = 0', '"alarms", mask = 1, value = 2', "value 0x2 has bits beyond mask 0x1"),
        ("alarms = {", "state = {", "state is made by"),
    ],
)  # fmt: skip
def test_a_fault_is_said_with_its_line_and_name(tmp_path: Path, line: str, instead: str, words: str) -> None:
    assert line in TEXT
    path = tmp_path / "map.toml"
    path.write_text(TEXT.replace(line, instead, 1), encoding="utf-8")
    with pytest.raises(TesterMapError, match=words):
        read_tester_map(path)


def test_a_map_that_would_take_any_controller_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.toml"
    path.write_text(TEXT.replace(", equals = 5012", "").replace(", minimum = 300, maximum = 399", ""), encoding="utf-8")
    with pytest.raises(TesterMapError, match="another controller would not be noticed"):
        read_tester_map(path)


def test_a_file_that_is_absent_or_large_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TesterMapError, match="cannot be read"):
        read_tester_map(tmp_path / "none.toml")
    path = tmp_path / "map.toml"
    path.write_text("#" * 200_000, encoding="utf-8")
    with pytest.raises(TesterMapError, match="more than 100000 bytes"):
        read_tester_map(path)
