"""The checks for makers of testers: a sound tester passes, and what is wrong with another is named."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace

import pytest

from rig.checks.check import Check, CheckState
from rig.checks.tester_checks import TRIPS, checks_of_trips
from rig.checks.tester_conformance import MOTIONS, SMALL_PP, check_tester
from rig.registers import CommandCode, Interlock, Value
from rig.tester import driver as tester
from rig.tester.driver import Tester
from rig.tester.limits import TesterLimits
from rig.tester.status import TesterRefusedError
from simlab.actuator import Actuator
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.detectors import Detectors, SimulatedDetector
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TesterServer
from tests.mutated_tester import MutatedDevice, Mutation
from tests.rig.mapped import example_map, mapped_laboratory
from tests.waiting import until

LIMITS = DeviceLimits(watchdog_time=0.4)


class KeepsAmplitude(MutatedDevice):
    """Reports every amplitude that is commanded, and keeps the first one."""

    keeps = False

    def status(self) -> dict[str, Value]:
        values = super().status()
        return values | {"amplitude": self.asked} if self.keeps and values["amplitude"] else values

    def _apply(self, command: CommandCode, values: Mapping[str, Value]) -> None:
        if command is CommandCode.CYCLE and self.keeps:
            self.asked = values["amplitude"]
            values = {**values, "amplitude": SMALL_PP}
        super()._apply(command, values)


@pytest.fixture
def server() -> Iterator[TesterServer]:
    bench = ordinary_bench(11, Clock(1.0))
    bench.mount("I", "shear")
    actuator = Actuator(bench, bench.clock.now, bench.seed)
    bench.attach_actuator(actuator)
    running = TesterServer(KeepsAmplitude(actuator, bench.clock.now, LIMITS), actuator, rtu=False, port=0)
    yield running
    running.stop()


def device(server: TesterServer) -> KeepsAmplitude:
    assert isinstance(server.device, KeepsAmplitude)
    return server.device


def checked(server: TesterServer, *, move: bool) -> tuple[Check, ...]:
    def connect(limits: TesterLimits) -> AbstractContextManager[Tester]:
        return tester.connect(server.url, limits)

    return check_tester(connect, move=move)


def failures(checks: tuple[Check, ...]) -> set[str]:
    return {check.id for check in checks if check.state is CheckState.FAILED}


def test_without_consent_nothing_moves_and_hydraulics_stay_off(server: TesterServer) -> None:
    checks = checked(server, move=False)
    assert not failures(checks)
    assert {check.id for check in checks if check.state is CheckState.NOT_DONE} == set(MOTIONS)
    assert all("--move" in check.advice for check in checks if check.state is CheckState.NOT_DONE)
    assert set(server.device.applied) <= {CommandCode.HOLD, CommandCode.HYDRAULICS_OFF, CommandCode.DETECTOR}


def test_the_simulated_tester_passes_every_check(server: TesterServer) -> None:
    assert {check.state for check in checked(server, move=True)} == {CheckState.PASSED}
    assert device(server).rests()


@pytest.mark.parametrize("names_interlocks", [True, False])
def test_a_tester_with_other_registers_passes_what_it_offers(names_interlocks: bool) -> None:
    tester_map = example_map()
    if not names_interlocks:
        tester_map = replace(tester_map, interlocks=())
    with mapped_laboratory(tester_map) as laboratory:

        def connect(limits: TesterLimits) -> AbstractContextManager[Tester]:
            return tester.connect(laboratory.tester.url, limits, tester_map=tester_map, without=tester_map.lacks)

        assert not failures(check_tester(connect))
        with connect(TesterLimits()) as driver:
            assert {check.id: check.state for check in checks_of_trips(driver)} == dict.fromkeys(
                TRIPS, CheckState.PASSED
            )


def test_an_absent_tester_fails_its_first_check() -> None:
    checks = check_tester(lambda limits: tester.connect("tcp://127.0.0.1:9", limits, timeout=0.1), move=True)
    assert failures(checks) == {"identity"}


def ignores_amplitudes(server: TesterServer) -> None:
    device(server).keeps = True


def disobeys(*commands: CommandCode) -> Callable[[TesterServer], None]:
    return lambda server: device(server).mutate(Mutation(disobeys=frozenset(commands), pretends=True))


def frozen(server: TesterServer) -> None:
    device(server).mutate(Mutation(frozen=True))


def no_limits(server: TesterServer) -> None:
    server.faults.set("no_limits")


def nothing_trips(server: TesterServer) -> None:
    server.faults.set("dead_watchdog")
    server.faults.set("dead_emergency_stop")


@pytest.mark.parametrize(
    ("plant", "shows", "move"),
    [
        (ignores_amplitudes, {"amplitude"}, True),
        (disobeys(CommandCode.HOLD), {"hold"}, True),
        (nothing_trips, {"watchdog", "emergency_stop"}, True),
        (frozen, {"status"}, False),
        (no_limits, {"identity"}, False),
    ],
    ids=["amplitude", "hold", "trips", "frozen", "no limits"],
)
def test_what_is_wrong_with_a_tester_is_named(
    server: TesterServer, plant: Callable[[TesterServer], None], shows: set[str], move: bool
) -> None:
    plant(server)
    assert failures(checked(server, move=move)) >= shows
    until(device(server).rests)


def test_a_reset_that_is_acknowledged_and_not_done_is_an_error(server: TesterServer) -> None:
    with tester.connect(server.url, TesterLimits()) as driver:
        driver.start()
        driver.emergency_stop()
        until(lambda: bool(driver.status().stopped_by))
        device(server).mutate(Mutation(disobeys=frozenset({CommandCode.RESET})))
        with pytest.raises(TesterRefusedError, match="acknowledged reset and is still stopped; remove the cause"):
            driver.reset()
        device(server).mutate(Mutation())
        driver.reset()


@pytest.mark.parametrize("most", [1.01, 1.005], ids=["as far as asked", "less far than asked"])
def test_a_tester_that_lets_the_network_loosen_its_detector_gets_it_back_and_does_not_move(
    server: TesterServer, monkeypatch: pytest.MonkeyPatch, most: float
) -> None:
    before, tighten = device(server).detectors(), Detectors.tighten

    def loosen(detectors: Detectors, interlock: Interlock, detector: SimulatedDetector) -> None:
        tighten(detectors, interlock, replace(detector, limit=min(detector.limit, most * LIMITS.force_limit)))

    monkeypatch.setattr(Detectors, "may_be", lambda *_: True)
    monkeypatch.setattr(Detectors, "tighten", loosen)
    found = checked(server, move=True)
    assert failures(found) == {"refusals"}
    assert device(server).detectors() == before
    assert {check.state for check in found if check.id in MOTIONS} == {CheckState.NOT_DONE}
