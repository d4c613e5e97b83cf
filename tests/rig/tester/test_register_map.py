"""The layer between the driver's words and a controller's registers."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.registers import BLOCKS, STATUS, CommandCode, DataType, Kind, Register, RegisterBlock, State, Value
from rig.tester.missing_functions import CONSEQUENCES, NEEDS_CONSENT, Lack
from rig.tester.register_map import OURS, Confirmed, CycleHistory, StatusMemory
from tests.rig.mapped import bare_map, example_map


def test_our_own_map_lacks_nothing_and_uses_every_block() -> None:
    assert OURS.lacks == frozenset()
    used = {*OURS.identity, *OURS.detectors, *OURS.status, OURS.heartbeat}
    used |= {step.block for steps in OURS.commands.values() for step in steps if hasattr(step, "block")}
    assert used == set(BLOCKS)
    assert set(OURS.commands) == set(CommandCode) - {CommandCode.NONE}


def test_the_documented_lacks_are_these() -> None:
    table = "".join(f"| {lack.replace('_', ' ')} | {meaning} |\n" for lack, meaning in CONSEQUENCES.items())
    safety = Path(__file__).parents[3] / "docs" / "safety.md"
    assert table in safety.read_text(encoding="utf-8")


def test_every_lack_has_its_consequence_and_a_map_can_have_each() -> None:
    assert set(CONSEQUENCES) == set(Lack)
    assert bare_map().lacks == set(Lack)
    assert set(Lack) >= NEEDS_CONSENT


@given(
    st.sampled_from(["big", "low bytes", "low words", "both"]),
    st.sampled_from([DataType.INT32, DataType.UINT32, DataType.FLOAT32, DataType.INT16, DataType.UINT16]),
    st.integers(0, 30_000),
    st.sampled_from([1.0, 1e-3, 0.01, 2e-3]),
)
def test_a_value_comes_back_in_every_order_and_scale(order: str, datatype: DataType, counts: int, scale: float) -> None:
    register = Register(
        "x", datatype, "", "", scale=scale, low_byte_first=order in ("low bytes", "both"),
        low_word_first=order in ("low words", "both"),
    )  # fmt: skip
    block = RegisterBlock("X", Kind.HOLDING, 7, (register,), checked=False)
    value = counts * scale
    found = block.unpack(block.pack({"x": value if scale != 1.0 or datatype is DataType.FLOAT32 else counts}))["x"]
    assert found == pytest.approx(value, rel=1e-6, abs=1e-12)


def test_orders_on_the_wire_are_those_of_modbus_devices() -> None:
    def words(**order: bool) -> list[int]:
        return RegisterBlock(
            "X", Kind.HOLDING, 0, (Register("x", DataType.UINT32, "", "", **order),), checked=False
        ).pack({"x": 0x11223344})

    assert words() == [0x1122, 0x3344]
    assert words(low_word_first=True) == [0x3344, 0x1122]
    assert words(low_byte_first=True) == [0x2211, 0x4433]
    assert words(low_byte_first=True, low_word_first=True) == [0x4433, 0x2211]


MEASURED: dict[str, Value] = {
    "flags": 0b00101,
    "alarms": 0,
    "displacement_mean": 5e-4,
    "displacement_pp": 1e-4,
    "cycles": 100,
    "force_mean": 1.0,
    "force_pp": 2.0,
    "amplitude": 1e-4,
    "frequency": 50.0,
}


def test_a_status_has_every_value_of_ours_whatever_the_map_has() -> None:
    for tester_map in (example_map(), bare_map()):
        found = StatusMemory(tester_map).completed(MEASURED, Confirmed(), 0.0)
        assert set(found) >= {register.name for register in STATUS.registers}
        assert STATUS.out_of_range(found) == []
        assert found["amplitude"] == 0.0  # a set value that stands in its register does not count at rest


def test_a_preset_is_reached_where_the_position_says_so() -> None:
    memory, asked = StatusMemory(example_map()), Confirmed(1, CommandCode.PRESET, {"preset": 6e-4})
    assert memory.completed(MEASURED, asked, 0.0)["state"] is State.RAMPING
    assert memory.completed({**MEASURED, "displacement_mean": 6e-4}, asked, 0.0)["state"] is State.HELD
    held = replace(asked, code=CommandCode.HOLD, asked={})
    assert memory.completed(MEASURED, held, 0.0)["state"] is State.HELD  # where it was stopped


def test_cycles_count_that_began_after_the_command() -> None:
    history = CycleHistory()
    assert history.add(1, 10, 9.0) == ()
    assert history.add(1, 10, 9.0) == ()
    assert history.add(1, 11, 5.0) == ()  # it may have begun before
    assert history.add(1, 12, 1.0) == (1.0,)
    assert history.add(1, 12, 1.0) == (1.0,)
    assert history.add(1, 15, 2.0) == (2.0, 1.0)
    assert history.add(2, 16, 3.0) == ()


def test_values_in_force_agree_as_far_as_their_registers_tell() -> None:
    tester_map = example_map()
    assert tester_map.agrees("frequency", 33.333, 33.33)
    assert not tester_map.agrees("frequency", 33.333, 33.34 + 1e-3)
    assert tester_map.agrees("amplitude", 1e-4, 1.000001e-4)
    assert not tester_map.agrees("amplitude", 1e-4, 1.01e-4)
    assert not tester_map.agrees("amplitude", 1e-4, math.nan)
