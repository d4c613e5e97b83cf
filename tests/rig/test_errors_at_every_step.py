"""Whatever an instrument answers at whatever step: rest, a cleared task, words, and the next run succeeds.

Each error meets some of the steps here, and each step some of the errors; `make bench` lets each meet all.
"""

from collections.abc import Iterator

import pytest
from pymodbus.constants import ExcCodes

from rig.registers import Refusal
from simlab.daq_errors import Code
from tests.bench.bench_errors import (
    COMMANDS,
    DAQ_CODES,
    EXCEPTIONS,
    REFUSALS,
    TESTER_STEPS,
    Rig,
    Step,
    rig_running,
    trial_of_daq,
    trial_of_tester,
)


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with rig_running() as rig:
        yield rig


@pytest.fixture(scope="module")
def sweep_steps(rig: Rig) -> tuple[Step, ...]:
    return rig.daq_steps(rig.sweep)


@pytest.fixture(scope="module")
def hammer_steps(rig: Rig) -> tuple[Step, ...]:
    return rig.daq_steps(rig.hammer)


def some(steps: tuple[Step, ...], number: int, count: int) -> list[tuple[Step, bool]]:
    """`count` of the steps, others for each `number`, so that all of them come up; and whether it is the last."""
    return [(steps[(number * count + i) % len(steps)], i == count - 1) for i in range(count)]


@pytest.mark.parametrize("refusal", REFUSALS, ids=lambda refusal: refusal.name)
def test_a_refusal_by_the_tester_ends_a_sweep_in_words_and_safely(rig: Rig, refusal: Refusal) -> None:
    number = REFUSALS.index(refusal)  # each command meets three or four of them
    is_last = number >= len(REFUSALS) - len(COMMANDS)
    step = COMMANDS[number % len(COMMANDS)], 0
    assert trial_of_tester(rig, step, refusal, then=is_last) == "error in words"


@pytest.mark.parametrize("code", EXCEPTIONS, ids=lambda code: code.name)
def test_a_modbus_exception_ends_a_sweep_in_words_and_safely(rig: Rig, code: ExcCodes) -> None:
    for step, is_last in some(TESTER_STEPS, EXCEPTIONS.index(code), 2):
        outcome = trial_of_tester(rig, step, code, then=is_last)
        assert outcome == "error in words" or step[0] == "HEARTBEAT"  # a short sweep needs none


@pytest.mark.parametrize("code", DAQ_CODES, ids=lambda code: code.name)
def test_an_error_of_the_instrument_ends_a_sweep_in_words_and_safely(
    rig: Rig, sweep_steps: tuple[Step, ...], code: Code
) -> None:
    for step, is_last in some(sweep_steps, DAQ_CODES.index(code), 2):
        trial_of_daq(rig, rig.sweep, step, code, then=is_last)


@pytest.mark.parametrize("code", DAQ_CODES, ids=lambda code: code.name)
def test_an_error_of_the_instrument_ends_a_hammer_session_in_words(
    rig: Rig, hammer_steps: tuple[Step, ...], code: Code
) -> None:
    for step, is_last in some(hammer_steps, DAQ_CODES.index(code), 2):
        trial_of_daq(rig, rig.hammer, step, code, then=is_last)


def test_the_tester_that_refuses_its_emergency_stop_too_is_stopped_by_its_watchdog(rig: Rig) -> None:
    rig.tester.script.set("HOLD", ExcCodes.DEVICE_FAILURE, after=1)
    rig.tester.script.set("EMERGENCY_STOP", ExcCodes.DEVICE_FAILURE)
    assert rig.trial(rig.sweep) == "error in words"
