"""Modules: rates that they have, counts that they make, inputs without a signal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simlab.daq_errors import Code, StatusError
from simlab.daq_modules import (
    ACCELEROMETER,
    DISPLACEMENT,
    IDLE_NOISE,
    LOAD_CELL,
    Module,
    input_values,
    laboratory_chassis,
)

MODULES = laboratory_chassis().modules
IEPE_MODULE, VOLTAGE_MODULE, BRIDGE_MODULE, _ = MODULES


@given(module=st.sampled_from(MODULES), fraction=st.floats(1 / 31, 1))
def test_a_rate_is_coerced_up_to_the_next_whole_division_of_the_fastest(module: Module, fraction: float) -> None:
    rate = fraction * module.fastest
    coerced = module.coerced_rate(rate)
    divisor = module.fastest / coerced
    assert divisor == pytest.approx(round(divisor), rel=1e-12)
    assert 1 <= round(divisor) <= 31
    assert coerced >= rate * (1 - 1e-8)
    assert round(divisor) == 31 or module.fastest / (round(divisor) + 1) < rate


@given(module=st.sampled_from(MODULES), divisor=st.integers(1, 31))
def test_a_rate_that_the_module_has_is_kept(module: Module, divisor: int) -> None:
    assert module.coerced_rate(module.fastest / divisor) == module.fastest / divisor


def test_a_rate_below_the_slowest_becomes_the_slowest() -> None:
    assert IEPE_MODULE.coerced_rate(10.0) == 51200 / 31


@pytest.mark.parametrize("rate", [51201.0, 0.0, -1.0, float("nan")])
def test_a_rate_that_the_module_cannot_reach_is_refused(rate: float) -> None:
    with pytest.raises(StatusError, match=r"SampClk\.Rate") as refused:
        IEPE_MODULE.coerced_rate(rate)
    assert refused.value.code == Code.INVALID_ATTRIBUTE_VALUE


@given(module=st.sampled_from(MODULES), fraction=st.floats(-1, 1 - 2**-23))
def test_counts_are_within_half_a_count_of_what_is_at_the_input(module: Module, fraction: float) -> None:
    value = fraction * module.largest
    counts = module.counts(np.array([value]))
    assert counts.dtype == np.int32
    assert abs(counts[0] * module.per_count - value) <= module.per_count / 2 * (1 + 1e-6)


@given(module=st.sampled_from(MODULES), beyond=st.floats(1, 1e6))
def test_what_is_beyond_the_range_is_clipped_at_24_bits(module: Module, beyond: float) -> None:
    counts = module.counts(np.array([module.largest * beyond, -module.largest * beyond]))
    assert counts.tolist() == [2**23 - 1, -(2**23)]


def test_an_open_cable_drives_an_iepe_input_to_the_rail_and_leaves_another_idle() -> None:
    assert np.all(input_values("a/ai0", IEPE_MODULE, None, None, True, 0, 100) > IEPE_MODULE.largest)
    idle = input_values("a/ai0", IEPE_MODULE, None, None, False, 0, 10_000)
    assert np.std(idle) == pytest.approx(IDLE_NOISE, rel=0.05)


def test_an_iepe_sensor_gives_nothing_without_current_and_a_voltage_needs_none() -> None:
    signal = np.full(1000, 100.0)
    unfed = input_values("a/ai0", IEPE_MODULE, ACCELEROMETER, signal, False, 0, 1000)
    assert np.max(np.abs(unfed)) < 10 * IDLE_NOISE
    np.testing.assert_allclose(input_values("a/ai0", IEPE_MODULE, ACCELEROMETER, signal, True, 0, 1000), 1.02)
    fallen = signal * 1e-5
    np.testing.assert_allclose(input_values("a/ai0", VOLTAGE_MODULE, DISPLACEMENT, fallen, False, 0, 1000), 2.0)


def test_a_bridge_without_its_supply_gives_nothing_and_an_open_one_stands_at_the_end() -> None:
    load = np.full(1000, 5000.0)
    np.testing.assert_allclose(input_values("a/ai0", BRIDGE_MODULE, LOAD_CELL, load, True, 0, 1000), 2e-3)
    unfed = input_values("a/ai0", BRIDGE_MODULE, LOAD_CELL, load, False, 0, 1000)
    assert np.max(np.abs(unfed)) < 1e-4 * BRIDGE_MODULE.largest
    assert np.all(input_values("a/ai0", BRIDGE_MODULE, None, None, True, 0, 100) > BRIDGE_MODULE.largest)


def test_channels_that_are_not_there_are_named() -> None:
    chassis = laboratory_chassis()
    with pytest.raises(StatusError, match="Dev9") as unknown:
        chassis.module_of("Dev9/ai0")
    assert unknown.value.code == Code.INVALID_DEVICE_ID
    for physical in ("cDAQ1Mod1/ai4", "cDAQ1/ai0", "cDAQ1Mod2"):
        with pytest.raises(StatusError, match=physical) as missing:
            chassis.module_of(physical)
        assert missing.value.code == Code.PHYSICAL_CHAN_DOES_NOT_EXIST
