"""The wire contract: what goes in comes out, a changed bit is noticed, and the table says where everything is."""

from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.registers import (
    BLOCKS,
    COMMAND,
    CYCLES_REPORTED,
    DETECTED,
    DETECTORS,
    EMERGENCY_STOP_COIL,
    HEARTBEAT,
    IDENTITY,
    STATUS,
    ChecksumError,
    DataType,
    Interlock,
    Kind,
    RegisterBlock,
    Value,
    checksum,
    float32,
    is_newer,
    name_of,
)

LARGEST_REQUEST = 123  # registers that Modbus lets one request write; it lets one read 125


def example(block: RegisterBlock) -> dict[str, Value]:
    values: dict[str, Value] = {}
    for index, register in enumerate(block.registers):
        if register.datatype is DataType.TEXT16:
            values[register.name] = "ET-42"
        elif register.datatype is DataType.FLOAT32:
            numbers = tuple(float32(0.001 * (index + i)) for i in range(register.count))
            values[register.name] = numbers if register.count > 1 else numbers[0]
        else:
            values[register.name] = index
    return values


commands = st.fixed_dictionaries(
    {
        "command": st.integers(0, 7),
        "sequence": st.integers(0, 0xFFFF),
        "preset": st.floats(width=32, allow_nan=False),
        "amplitude": st.floats(width=32, allow_nan=False),
        "frequency": st.floats(width=32, allow_nan=False),
        "detector": st.integers(0, 0xFFFF),
        "action": st.integers(0, 0xFFFF),
        "limit": st.floats(width=32, allow_nan=False),
    }
)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
def test_a_block_comes_out_as_it_went_in(block: RegisterBlock) -> None:
    values = example(block)
    words = block.pack(values)
    assert len(words) == block.count <= LARGEST_REQUEST
    assert block.unpack(words) == values


@given(commands)
def test_any_command_survives_the_wire(values: dict[str, Value]) -> None:
    assert COMMAND.unpack(COMMAND.pack(values)) == values


@given(commands, st.data())
def test_one_flipped_bit_anywhere_in_a_block_is_noticed(values: dict[str, Value], data: st.DataObject) -> None:
    words = COMMAND.pack(values)
    word, bit = data.draw(st.integers(0, len(words) - 1)), data.draw(st.integers(0, 15))
    words[word] ^= 1 << bit
    with pytest.raises(ChecksumError):
        COMMAND.unpack(words)


def test_a_block_that_is_too_short_is_refused_with_both_lengths() -> None:
    with pytest.raises(ChecksumError, match="COMMAND has 13 words, 3 came"):
        COMMAND.unpack([1, 2, 3])


def test_the_checksum_is_the_crc_16_that_the_map_names() -> None:
    # check value of CRC-16/CCITT-FALSE over the ASCII digits "12345678" and "9" is catalogued; even length here
    assert checksum([0x3132, 0x3334, 0x3536, 0x3738]) == 0xA12B


@given(st.integers(0, 0xFFFF), st.integers(1, 0x7FFF))
def test_a_later_sequence_number_is_newer_across_the_turn_and_the_earlier_one_is_not(last: int, ahead: int) -> None:
    later = (last + ahead) % 0x10000
    assert is_newer(later, last)
    assert not is_newer(last, later)
    assert not is_newer(last, last)


def test_blocks_of_one_kind_do_not_overlap() -> None:
    for kind in (Kind.INPUT, Kind.HOLDING):
        blocks = sorted((block for block in BLOCKS if block.kind is kind), key=lambda block: block.address)
        for lower, upper in pairwise(blocks):
            assert lower.address + lower.count <= upper.address


def test_only_heartbeat_and_command_are_writable_so_the_network_cannot_change_a_limit() -> None:
    assert [block for block in BLOCKS if block.writable] == [HEARTBEAT, COMMAND]


def test_addresses_follow_from_the_order_of_the_registers() -> None:
    assert IDENTITY.address_of("map_version") == 0
    assert IDENTITY.address_of("serial") == 2
    assert IDENTITY.address_of("watchdog_time") == 10
    assert STATUS.address_of("displacement_pp") + 2 * CYCLES_REPORTED + 1 == STATUS.address + STATUS.count
    with pytest.raises(KeyError):
        STATUS.address_of("phase")


def test_every_detector_has_a_limit_and_an_action_and_the_two_that_have_none_are_not_configurable() -> None:
    names = [register.name for register in DETECTORS.registers]
    assert names == [f"{name_of(interlock)}_{what}" for interlock in DETECTED for what in ("limit", "action")]
    assert set(Interlock) - set(DETECTED) == {Interlock.WATCHDOG, Interlock.EMERGENCY_STOP}


def table() -> str:
    """The map as a Markdown table, for the documentation: one row a register."""
    rows = [
        "| block | address | kind | name | type | unit | range | access | meaning |",
        "|---|---|---|---|---|---|---|---|---|",
        f"| EMERGENCY_STOP | {EMERGENCY_STOP_COIL} | {Kind.COIL} | emergency_stop | bit | | 1 | write |"
        " 1 trips the emergency stop |",
    ]
    for block in BLOCKS:
        access = "write" if block.writable else "read"
        for register in block.registers:
            kind = f"{register.datatype.name.lower()}{f' x {register.count}' if register.count > 1 else ''}"
            span = "" if register.datatype is DataType.TEXT16 else f"{register.minimum:g} to {register.maximum:g}"
            rows.append(
                f"| {block.name} | {block.address_of(register.name)} | {block.kind} | {register.name} | {kind} |"
                f" {register.unit} | {span} | {access} | {register.meaning} |"
            )
        rows.append(
            f"| {block.name} | {block.address + block.count - 1} | {block.kind} | checksum | uint16 | | |"
            f" {access} | CRC-16 of the words before it |"
        )
    return "\n".join(rows) + "\n"


def test_the_table_has_a_row_for_every_register_with_its_address() -> None:
    text = table()
    for block in BLOCKS:
        for register in block.registers:
            assert f"| {block.name} | {block.address_of(register.name)} |" in text
            assert register.meaning in text


def test_the_documented_map_is_this_one() -> None:
    documented = Path(__file__).parents[2] / "docs" / "register_map.md"
    assert table() in documented.read_text(encoding="utf-8")
