"""A pause keeps watch: what another client commands, and a line that is lost, end the run without a resume."""

import itertools
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

import pytest

from rig.control import RunControl
from rig.events import ActuatorShutDown, RunPaused, RunResumed, TesterLineLost
from rig.registers import CommandCode, State
from rig.sequences.sweep_plan import SweepPlan
from rig.tester.modbus import ModbusLink, ModbusProtocolError
from rig.tester.register_map import OURS, TesterMap
from rig.tester.status import ActuatorNotAtRestError, ImplausibleStatusError, LineLostError, StatusFault
from rig.tester.wire import TesterWire
from simlab.tester_server import TesterFault
from tests.rig.mapped import MappedLaboratory, example_map, mapped_laboratory
from tests.rig.sweeping import Run, recording
from tests.waiting import until

PLAN = SweepPlan(
    frequencies=(20.0, 25.0), amplitudes_pp=(1e-4,), configurations=("shear",), specimens=("I",), shortest_record=3.0
)
CYCLE: dict[str, Any] = {"amplitude": 2e-4, "frequency": 20.0}


@contextmanager
def paused(tester_map: TesterMap = OURS) -> Iterator[tuple[MappedLaboratory, Run]]:
    """A sweep that was paused while it recorded."""
    with mapped_laboratory(tester_map, PLAN, speed=10.0) as laboratory:
        control = RunControl()
        run = Run(laboratory.sweep, control)
        until(lambda: recording(laboratory))
        control.pause()
        until(lambda: laboratory.seen(RunPaused) == 1)
        yield laboratory, run


def command_as_another_client(laboratory: MappedLaboratory, code: CommandCode, **values: Any) -> None:
    with closing(ModbusLink(laboratory.tester.url)) as link:
        wire = TesterWire(link, laboratory.tester_map)
        wire.join()
        wire.command(code, **values)


@pytest.mark.parametrize(
    ("code", "values"), [(CommandCode.CYCLE, CYCLE), (CommandCode.PRESET, {"preset": 1e-4}), (CommandCode.HOLD, {})]
)
def test_a_command_of_another_client_during_a_pause_ends_the_run(code: CommandCode, values: dict[str, Any]) -> None:
    with paused() as (laboratory, run):
        command_as_another_client(laboratory, code, **values)
        error = run.ended()
        assert isinstance(error, ModbusProtocolError)
        assert "which this program did not send" in str(error)
        assert laboratory.tester.actuator.steady_pp() == 0.0
        assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF
        assert (laboratory.seen(ActuatorShutDown), laboratory.seen(RunResumed)) == (1, 0)


def test_motion_during_a_pause_ends_the_run_also_where_commands_have_no_numbers() -> None:
    with paused(example_map()) as (laboratory, run):
        command_as_another_client(laboratory, CommandCode.CYCLE, **CYCLE)
        error = run.ended()
        assert isinstance(error, ImplausibleStatusError)
        assert error.fault is StatusFault.COMMAND
        assert laboratory.tester.actuator.steady_pp() == 0.0


def test_our_own_commands_around_a_pause_are_never_taken_for_those_of_another_client(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("rig.tester.monitor.INTERVAL", 0.0)  # a status is read at each moment
    with mapped_laboratory(OURS, PLAN, speed=10.0) as laboratory:
        control = RunControl()
        run = Run(laboratory.sweep, control)
        for _ in itertools.repeat(None, 15):
            until(laboratory.moves)
            control.pause()
            control.pause()
            control.resume()
        until(laboratory.moves)
        assert laboratory.seen(ActuatorShutDown) == 0
        control.stop()
        assert "stopped as asked" in str(run.ended())


def test_a_line_that_is_lost_during_a_pause_ends_the_run() -> None:
    with paused() as (laboratory, run):
        laboratory.tester.faults.set(TesterFault.CUT)
        error = run.ended()
        laboratory.tester.faults.clear()
        assert isinstance(error, LineLostError | ActuatorNotAtRestError)
        assert laboratory.seen(TesterLineLost) == 1
