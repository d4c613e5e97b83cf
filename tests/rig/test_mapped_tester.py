"""A tester with other registers than ours: the same driver, the same sweep, its faults, and what it lacks."""

from contextlib import nullcontext, suppress
from dataclasses import replace

import pytest

from rig.checks.tester_checks import checks_of_tester, checks_of_trips
from rig.control import RunControl
from rig.errors import RigError
from rig.instruments import Instruments
from rig.registers import Action, CommandCode, Interlock, State
from rig.sequences.sequence import Sequence
from rig.sequences.steps import check_instruments
from rig.sequences.sweep_plan import SweepPlan
from rig.tester import driver as tester
from rig.tester.detectors import DetectorError, TighterDetector
from rig.tester.driver import LONGEST_POLL, Tester
from rig.tester.missing_functions import Lack
from rig.tester.monitor import monitored, poll_tester
from rig.tester.register_map import TesterMap
from rig.tester.status import (
    ActuatorNotAtRestError,
    ImplausibleStatusError,
    LineLostError,
    StatusFault,
    TesterMismatchError,
    TesterRefusedError,
    TesterTrippedError,
)
from simlab.tester_server import TesterFault
from tests.rig.mapped import PLAN, MappedLaboratory, bare_map, example_map, mapped_laboratory, wrong_points
from tests.waiting import until


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of the pause between two looks: this tester shows one cycle at a time, and settling takes six."""
    monkeypatch.setattr("rig.tester.driver.LONGEST_POLL", LONGEST_POLL / 10)


SHORT = SweepPlan(frequencies=(50.0, 150.0), amplitudes_pp=(1e-4,), configurations=("shear",), specimens=("I",))


def set_cycling(driver: Tester, laboratory: MappedLaboratory) -> None:
    laboratory.bench.mount("I", "shear")
    driver.start()
    driver.preset(5e-4)
    driver.cycle(1e-4, 50.0)
    driver.wait(lambda status: status.state is State.SETTLED, "settle")


@pytest.mark.parametrize("rtu", [False, True])
def test_a_sweep_on_other_registers_finds_the_truth(rtu: bool) -> None:
    with mapped_laboratory(plan=PLAN if not rtu else SHORT, rtu=rtu) as laboratory:
        laboratory.sweep(RunControl())
        assert len(laboratory.points) == laboratory.plan.points
        assert all(point.within_tolerance for point in laboratory.points)
        assert wrong_points(laboratory) == []
        assert not laboratory.moves()
        assert poll_tester(laboratory.tester.url, laboratory.tester_map).state is State.HYDRAULICS_OFF


@pytest.mark.parametrize("tester_map", [example_map(watchdog=False), bare_map()])
def test_a_controller_that_has_little_is_swept_all_the_same(tester_map: TesterMap) -> None:
    with mapped_laboratory(tester_map, SHORT) as laboratory:
        laboratory.sweep(RunControl())
        assert len(laboratory.points) == SHORT.points
        assert wrong_points(laboratory) == []


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        ("refuse", TesterRefusedError),
        ("busy", TesterRefusedError),
        ("ignore", RigError),
        ("freeze", RigError),
        ("late", RigError),
        ("stale_echo", RigError),
        ("stale_in_force", TesterRefusedError),
        ("old_set", TesterRefusedError),
        ("flipped_set", RigError),
        ("no_state", ImplausibleStatusError),
        ("silent", RigError),
        ("cut", RigError),
        ("drop", RigError),
        ("runaway_servo", RigError),
    ],
)
def test_whatever_breaks_nothing_wrong_is_stored_and_the_actuator_comes_to_rest(
    fault: str, error: type[Exception]
) -> None:
    with mapped_laboratory(plan=SHORT) as laboratory:
        laboratory.broken = lambda: laboratory.tester.faults.set(fault)
        with pytest.raises(error):
            laboratory.sweep(RunControl())
        assert len(laboratory.points) == 1
        assert wrong_points(laboratory) == []
        until(lambda: not laboratory.moves())


@pytest.mark.parametrize("frequencies", [(50.0, 150.0), (150.0, 50.0), (150.0, 70.0)])
def test_a_frequency_that_was_not_taken_over_is_seen_in_the_record(frequencies: tuple[float, ...]) -> None:
    with mapped_laboratory(bare_map(), replace(SHORT, frequencies=frequencies)) as laboratory:  # shows none in force
        laboratory.broken = lambda: laboratory.tester.faults.set("ignore")
        with pytest.raises(RigError, match="check whether the tester follows its commands") as seen:
            laboratory.sweep(RunControl())
        assert "not confirmed at rest" in " ".join(seen.value.__notes__)
        assert len(laboratory.points) == 1
        laboratory.tester.emergency_stop()


def test_an_amplitude_that_was_not_taken_over_ends_the_run() -> None:
    plan = replace(SHORT, frequencies=(50.0,), amplitudes_pp=(1e-4, 2e-5))
    with mapped_laboratory(bare_map(), plan) as laboratory:
        laboratory.broken = lambda: laboratory.tester.faults.set("ignore", times=5)
        with pytest.raises(RigError, match="the tester does not follow its commands"):
            laboratory.sweep(RunControl())
        assert len(laboratory.points) == 1


@pytest.mark.parametrize("fault", ["late", "lost_reply", "flipped_set", "stale_echo", "old_set", "drop"])
def test_a_fault_that_passes_is_repeated_and_costs_no_point(fault: str) -> None:
    with mapped_laboratory(plan=SHORT) as laboratory:
        laboratory.broken = lambda: laboratory.tester.faults.set(fault, times=1)
        laboratory.sweep(RunControl())
        assert len(laboratory.points) == SHORT.points
        assert wrong_points(laboratory) == []


@pytest.mark.parametrize("fault", ["ignore", "freeze"])
def test_a_hold_that_is_not_obeyed_becomes_an_emergency_stop(fault: str) -> None:
    # the watchdog has no part in it
    with mapped_laboratory(example_map(watchdog=False), speed=1.0) as laboratory:
        unknown = pytest.raises(ActuatorNotAtRestError, match="press the red button")
        # of a status that stands still nothing is known, whatever helped
        with unknown if fault == "freeze" else nullcontext(), laboratory.driver() as driver:
            set_cycling(driver, laboratory)
            laboratory.tester.faults.set(fault)
            with suppress(ActuatorNotAtRestError):
                driver.halt()
            assert Interlock.EMERGENCY_STOP in Interlock(int(str(laboratory.tester.device.status()["interlocks"])))
            until(lambda: not laboratory.moves())


def halt_with(fault: str, laboratory: MappedLaboratory) -> None:
    with laboratory.driver() as driver:
        set_cycling(driver, laboratory)
        laboratory.tester.faults.set(fault)
        driver.halt()


def test_a_tester_that_nothing_stops_is_told_with_the_red_button() -> None:
    with mapped_laboratory(bare_map(), speed=1.0) as laboratory:
        words = "press the red button: the tester has no watchdog"
        with pytest.raises(ActuatorNotAtRestError, match=words):
            halt_with("ignore", laboratory)
        laboratory.tester.emergency_stop()
        until(lambda: not laboratory.moves())


def test_motion_after_a_stop_is_noticed_where_commands_have_no_numbers() -> None:
    with mapped_laboratory(speed=1.0) as laboratory, laboratory.driver() as driver:
        set_cycling(driver, laboratory)
        driver.halt()
        with suppress(ImplausibleStatusError), monitored(driver):
            laboratory.plc.take(256, [5])  # the delayed command arrives
            until(lambda: driver.failure is not None)
        assert "it is cycling after it was halted" in str(driver.failure)
        until(lambda: not laboratory.moves())


def test_another_amplitude_in_force_is_noticed() -> None:
    with mapped_laboratory(speed=1.0) as laboratory, laboratory.driver() as driver:
        set_cycling(driver, laboratory)
        laboratory.plc.in_force = (2e-4, 50.0)  # what another client asked for
        with pytest.raises(ImplausibleStatusError) as noticed:
            driver.measured()
        assert noticed.value.fault is StatusFault.COMMAND


@pytest.mark.parametrize(
    ("watchdog", "words"),
    [
        (True, "the watchdog of the tester should stop it within 1 s"),
        (False, "press the red button: the tester has no watchdog"),
    ],
)
def test_a_lost_line_is_left_to_the_watchdog_or_to_the_red_button(watchdog: bool, words: str) -> None:
    with mapped_laboratory(example_map(watchdog=watchdog), speed=1.0) as laboratory:
        with pytest.raises(LineLostError, match=words):
            cut_while_cycling(laboratory)
        if watchdog:
            until(lambda: not laboratory.moves())
        else:
            assert laboratory.moves()  # as the map says: nothing but the red button stops it
            laboratory.tester.emergency_stop()


@pytest.mark.parametrize(("fault", "meanwhile"), [("cut", State.SETTLED), ("silent", State.HELD)])
def test_what_has_no_watchdog_is_switched_off_once_its_line_is_back(fault: str, meanwhile: State) -> None:
    with mapped_laboratory(example_map(watchdog=False), speed=1.0) as laboratory:
        with laboratory.driver() as driver:
            set_cycling(driver, laboratory)
            laboratory.tester.faults.set("dead_emergency_stop")
            laboratory.tester.faults.set(fault)
            with pytest.raises(ActuatorNotAtRestError, match="press the red button"):
                driver.shut_down()
            laboratory.tester.faults.clear()
            assert laboratory.tester.device.status()["state"] == meanwhile
        assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


def cut_while_cycling(laboratory: MappedLaboratory) -> None:
    with laboratory.driver() as driver:
        set_cycling(driver, laboratory)
        laboratory.tester.faults.set("cut")
        until(lambda: is_lost(driver))
        driver.measured()


def is_lost(driver: Tester) -> bool:
    try:
        driver.measured()
    except LineLostError:
        return True
    return False


@pytest.mark.parametrize(
    ("tester_map", "words"),
    [
        (example_map(watchdog=False), r'no watchdog: it goes on moving .*tester_without = \["watchdog"\]'),
        (bare_map(), r'no emergency stop: .*no watchdog: .*tester_without = \["emergency_stop", "watchdog"\]'),
    ],
)
def test_what_stops_need_and_the_map_lacks_has_to_be_accepted(tester_map: TesterMap, words: str) -> None:
    with mapped_laboratory(tester_map) as laboratory:
        with (
            pytest.raises(TesterMismatchError, match=words),
            tester.connect(laboratory.tester.url, tester_map=tester_map),
        ):
            pass
        assert laboratory.tester.device.applied == []


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("other_type", "has device_type 5013, its map 5012: it is another controller"),
        ("no_state", "no state of its map"),
    ],
)
def test_another_controller_is_refused_before_anything_is_commanded(fault: str, words: str) -> None:
    with mapped_laboratory() as laboratory:
        laboratory.tester.faults.set(fault)
        with pytest.raises(RigError, match=words), laboratory.driver():
            pass
        assert laboratory.tester.device.applied == []


def test_this_controller_is_refused_under_our_own_map() -> None:
    with (
        mapped_laboratory() as laboratory,
        pytest.raises(TesterMismatchError, match="no tester with register map 2"),
        tester.connect(laboratory.tester.url),
    ):
        pass


def test_trips_are_told_by_name_and_reset() -> None:
    with mapped_laboratory(speed=1.0) as laboratory, laboratory.driver() as driver:
        set_cycling(driver, laboratory)
        laboratory.tester.emergency_stop()
        with pytest.raises(TesterTrippedError, match="stopped by emergency stop"):
            until(lambda: driver.measured() is None)
        with pytest.raises(TesterRefusedError):
            driver.reset()
        laboratory.tester.release_emergency_stop()
        driver.reset()
        assert driver.status().state is State.HYDRAULICS_OFF


def test_an_examination_shows_what_the_tester_lacks_and_trips_what_it_has() -> None:
    with mapped_laboratory(speed=1.0) as laboratory, laboratory.driver() as driver:
        (offers,) = [check for check in checks_of_tester(driver, {}, {}) if check.id == "capabilities"]
        assert offers.measured == "without checksum, command numbers, detectors, limits, status age"
        assert [check.state.value for check in checks_of_trips(driver)] == ["passed", "passed"]
    with mapped_laboratory(bare_map(), speed=1.0) as laboratory, laboratory.driver() as driver:
        assert [check.state.value for check in checks_of_trips(driver)] == ["not done", "not done"]


def test_a_dead_watchdog_is_found_by_an_examination() -> None:
    with mapped_laboratory(speed=1.0) as laboratory, laboratory.driver() as driver:
        laboratory.tester.faults.set(TesterFault.DEAD_WATCHDOG)
        assert [check.state.value for check in checks_of_trips(driver)] == ["failed", "passed"]


def test_a_value_that_does_not_fit_its_register_is_refused_and_nothing_is_sent() -> None:
    with mapped_laboratory() as laboratory, laboratory.driver() as driver:
        driver.limits = replace(driver.limits, highest_frequency=1000.0, acceleration=1000.0, velocity=1.0)
        set_cycling(driver, laboratory)
        applied = list(laboratory.tester.device.applied)
        with pytest.raises(RigError, match="does not fit its register"):
            driver.cycle(1e-5, 700.0)
        assert laboratory.tester.device.applied == applied


def test_a_step_that_tightens_a_detector_which_is_not_known_is_refused_before_anything_moves() -> None:
    plan = replace(SHORT, detectors={Interlock.FORCE: TighterDetector(900.0)})
    with mapped_laboratory(plan=plan) as laboratory:
        with pytest.raises(DetectorError, match="detector force: the tester's map does not have it"):
            laboratory.sweep(RunControl())
        assert CommandCode.HYDRAULICS_ON not in laboratory.tester.device.applied
        with laboratory.driver() as driver, pytest.raises(TesterRefusedError, match="has no detector"):
            driver.set_detector(Interlock.FORCE, 900.0, Action.STOP)


def test_a_hold_that_switches_hydraulics_on_is_found_before_a_run(sequence: Sequence, instruments: Instruments) -> None:
    tester_map = example_map()
    commands = {**tester_map.commands, CommandCode.HOLD: tester_map.commands[CommandCode.HYDRAULICS_ON]}
    wrong = replace(tester_map, commands=commands)
    with mapped_laboratory(wrong) as laboratory:
        with pytest.raises(TesterMismatchError, match="a hold switched the hydraulics of the tester on"):
            check_instruments(sequence, replace(instruments, tester_url=laboratory.tester.url, tester_map=wrong))
        assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


def test_without_a_watchdog_nothing_beats() -> None:
    with mapped_laboratory(example_map(watchdog=False)) as laboratory, laboratory.driver() as driver:
        assert Lack.WATCHDOG in driver.identity.lacks
        assert driver.identity.watchdog_time is None
