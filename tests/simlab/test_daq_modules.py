"""Modules: rates that they have, counts that they make, inputs without a signal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simlab.daq_errors import Code, StatusError
from simlab.daq_modules import ACCELEROMETER, DISPLACEMENT, IDLE_NOISE, Module, input_volts, laboratory_chassis

IEPE_MODULE, VOLTAGE_MODULE = laboratory_chassis().modules
MODULES = st.sampled_from([IEPE_MODULE, VOLTAGE_MODULE])


@given(module=MODULES, fraction=st.floats(1 / 31, 1))
def test_a_rate_is_coerced_up_to_the_next_whole_division_of_the_fastest(module: Module, fraction: float) -> None:
    rate = fraction * module.fastest
    coerced = module.coerced_rate(rate)
    divisor = module.fastest / coerced
    assert divisor == pytest.approx(round(divisor), rel=1e-12)
    assert 1 <= round(divisor) <= 31
    assert coerced >= rate * (1 - 1e-8)
    assert round(divisor) == 31 or module.fastest / (round(divisor) + 1) < rate


@given(module=MODULES, divisor=st.integers(1, 31))
def test_a_rate_that_the_module_has_is_kept(module: Module, divisor: int) -> None:
    assert module.coerced_rate(module.fastest / divisor) == module.fastest / divisor


def test_a_rate_below_the_slowest_becomes_the_slowest() -> None:
    assert IEPE_MODULE.coerced_rate(10.0) == 51200 / 31


@pytest.mark.parametrize("rate", [51201.0, 0.0, -1.0, float("nan")])
def test_a_rate_that_the_module_cannot_reach_is_refused(rate: float) -> None:
    with pytest.raises(StatusError, match=r"SampClk\.Rate") as refused:
        IEPE_MODULE.coerced_rate(rate)
    assert refused.value.code == Code.INVALID_ATTRIBUTE_VALUE


@given(module=MODULES, fraction=st.floats(-1, 1 - 2**-23))
def test_counts_are_within_half_a_count_of_the_volts(module: Module, fraction: float) -> None:
    volts = fraction * module.volts
    counts = module.counts(np.array([volts]))
    assert counts.dtype == np.int32
    assert abs(counts[0] * module.volts_per_count - volts) <= module.volts_per_count / 2 * (1 + 1e-6)


@given(module=MODULES, volts=st.floats(1, 1e6))
def test_volts_beyond_the_range_are_clipped_at_24_bits(module: Module, volts: float) -> None:
    counts = module.counts(np.array([module.volts * volts, -module.volts * volts]))
    assert counts.tolist() == [2**23 - 1, -(2**23)]


def test_an_open_cable_drives_an_iepe_input_to_the_rail_and_leaves_another_idle() -> None:
    assert np.all(input_volts("a/ai0", None, None, True, 0, 100) > IEPE_MODULE.volts)
    idle = input_volts("a/ai0", None, None, False, 0, 10_000)
    assert np.std(idle) == pytest.approx(IDLE_NOISE, rel=0.05)


def test_an_iepe_sensor_gives_nothing_without_current_and_a_voltage_needs_none() -> None:
    signal = np.full(1000, 100.0)
    assert np.max(np.abs(input_volts("a/ai0", ACCELEROMETER, signal, False, 0, 1000))) < 10 * IDLE_NOISE
    np.testing.assert_allclose(input_volts("a/ai0", ACCELEROMETER, signal, True, 0, 1000), 1.02)
    np.testing.assert_allclose(input_volts("a/ai0", DISPLACEMENT, signal * 1e-5, False, 0, 1000), 2.0)


def test_channels_that_are_not_there_are_named() -> None:
    chassis = laboratory_chassis()
    with pytest.raises(StatusError, match="Dev9") as unknown:
        chassis.module_of("Dev9/ai0")
    assert unknown.value.code == Code.INVALID_DEVICE_ID
    for physical in ("cDAQ1Mod1/ai4", "cDAQ1/ai0", "cDAQ1Mod2"):
        with pytest.raises(StatusError, match=physical) as missing:
            chassis.module_of(physical)
        assert missing.value.code == Code.PHYSICAL_CHAN_DOES_NOT_EXIST
