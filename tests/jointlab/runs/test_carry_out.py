"""A sequence on all its wires: what is kept, how the run ends, and that the next one succeeds."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from sqlalchemy import text

from daq.errors import ChannelError, InstrumentAbsentError
from jointlab.runs.orders import plan_run
from rig.errors import RigError
from rig.events import BlowAccepted, Event, PointFinished, RestSeen, RunStarted, SinePointMeasured, SpecimenMounted
from rig.hammer.session import PointGivenUpError
from rig.registers import State
from rig.runs.spool import SpoolError
from rig.sequences.sequence import sequence_from
from rig.sequences.steps import check_instruments
from rig.tester.limits import LimitExceededError, TesterLimits
from rig.tester.status import TesterMismatchError, TesterTrippedError
from rig.thermometer import ThermometerError
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from store.measurements.runs import list_runs
from store.service.audit import list_audit_entries
from store.states import RunState
from tests.jointlab.runs.site import Site
from tests.ports import free_port
from tests.rig.person import Person


@pytest.fixture
def database_kind() -> str:
    """SQLite alone; the ingest is tried on both."""
    return "sqlite"


def test_a_sequence_becomes_one_finished_run_with_everything_in_it(site: Site) -> None:
    events = list[Event]()
    number = site.run(observer=events.append)
    run = site.newest()
    assert (run.id, run.state, run.kind, run.reason) == (number, RunState.FINISHED, "sequence", None)
    assert (run.title, run.article) == ("a small sequence", "beam 3")
    assert sequence_from(run.sequence) == site.sequence
    assert run.setup["direct"] == {"file": "direct.csv", "preset_mm": 0.5}
    accepted, _, sines = site.kept()
    assert (accepted, sines) == (4, 2)
    assert next(each for each in events if not isinstance(each, RestSeen)) == RunStarted(number)
    happened = [type(event) for event in events]
    assert happened.count(BlowAccepted) == 4
    assert happened.count(PointFinished) == 2
    assert (happened.count(SpecimenMounted), happened.count(SinePointMeasured)) == (1, 2)
    assert site.is_at_rest()
    with site.catalogue.reading() as session:
        blows = session.execute(
            text("SELECT DISTINCT point, set_number FROM v_blows WHERE accepted ORDER BY point")
        ).all()
        sensors = session.execute(text("SELECT name FROM channels ORDER BY name")).scalars().all()
        kinds = set(session.execute(text("SELECT kind FROM instruments")).scalars())
        warm = session.execute(text("SELECT count(*) FROM v_blows WHERE temperature_c BETWEEN 15 AND 35")).scalar()
    assert [tuple(row) for row in blows] == [("1x", 1), ("5y", 1)]
    assert sensors == ["accelerometer", "displacement", "force", "hammer"]
    assert kinds >= {"acquisition", "thermometer", "tester", "force_iepe"}
    assert warm == sum(site.kept()[:2])


def test_a_second_hammer_step_is_a_second_set(document: dict[str, Any], site: Site) -> None:
    hammer = {"step": "hammer", "points": ["5y"], "blows": 2, "block_seconds": 1.0}
    document["steps"] = [hammer, hammer | {"points": ["6y"]}]
    site.run(sequence_from(document))
    with site.catalogue.reading() as session:
        rows = session.execute(text("SELECT DISTINCT set_number, point FROM v_blows ORDER BY set_number")).all()
    assert [tuple(row) for row in rows] == [(1, "5y"), (2, "6y")]


def test_one_hertz_is_recorded_for_as_long_as_it_needs(document: dict[str, Any], site: Site) -> None:
    document["steps"] = [document["steps"][1] | {"frequencies": {"first": 1, "last": 1}}]
    site.run(sequence_from(document))
    assert site.kept() == (0, 0, 1)


def device_gone(laboratory: Laboratory) -> None:
    laboratory.daq.faults.set("device_gone")


def emergency_stop(laboratory: Laboratory) -> None:
    laboratory.tester.emergency_stop()


def silent_thermometer(laboratory: Laboratory) -> None:
    laboratory.thermometer.faults.set("silent")


@pytest.mark.parametrize(
    ("breaks", "at", "error", "words", "expected"),
    [
        (device_gone, ("strike", 4), InstrumentAbsentError, "read hammer, accelerometer: The device is", (3, 0, 0)),
        (silent_thermometer, ("strike", 3), ThermometerError, "thermometer at ", (2, 0, 0)),
        (emergency_stop, ("mount", 1), TesterTrippedError, "the tester was stopped by emergency stop", (4, 0, 0)),
        (device_gone, ("mount", 1), InstrumentAbsentError, "start displacement, force: The device is", (4, 0, 0)),
    ],
)
def test_a_run_that_fails_keeps_its_reason_and_measurements_and_the_next_one_succeeds(
    breaks: Callable[[Laboratory], None],
    at: tuple[str, int],
    error: type[Exception],
    words: str,
    expected: tuple[int, int, int],
    site: Site,
) -> None:
    site.person.at(*at, lambda: breaks(site.laboratory))
    with pytest.raises(error):
        site.run()
    failed = site.newest()
    assert failed.state is RunState.FAILED
    assert failed.reason is not None
    assert failed.reason.startswith(words)
    assert site.kept() == expected
    assert site.is_at_rest()

    site.repair()
    number = site.run(operator=Person(site.laboratory))
    assert number == failed.id + 1
    assert site.newest().state is RunState.FINISHED
    assert site.kept()[::2] == (4, 2)


def test_a_tester_that_trips_between_two_sine_points_leaves_the_first(site: Site) -> None:
    def watch(event: Event) -> None:
        if isinstance(event, SinePointMeasured):
            site.laboratory.tester.emergency_stop()

    with pytest.raises(TesterTrippedError, match="emergency stop"):
        site.run(observer=watch)
    assert site.newest().state is RunState.FAILED
    assert site.kept() == (4, 0, 1)
    assert site.is_at_rest()


@pytest.mark.parametrize(("action", "count", "expected"), [("strike", 2, (1, 0, 0)), ("mount", 1, (4, 0, 0))])
def test_ctrl_c_marks_the_run_stopped_and_leaves_the_actuator_at_rest(
    action: str, count: int, expected: tuple[int, int, int], site: Site
) -> None:
    def leave() -> None:
        raise KeyboardInterrupt

    site.person.at(action, count, leave)
    with pytest.raises(KeyboardInterrupt):
        site.run()
    run = site.newest()
    assert (run.state, run.reason) == (RunState.STOPPED, "stopped by hand")
    assert site.kept() == expected
    assert site.is_at_rest()


def test_ctrl_c_while_the_begin_of_a_run_is_told_marks_it_stopped(site: Site) -> None:
    def leave(event: Event) -> None:
        if isinstance(event, RunStarted):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        site.run(observer=leave)
    assert (site.newest().state, site.newest().reason) == (RunState.STOPPED, "stopped by hand")


def test_ctrl_c_while_the_actuator_cycles_stops_it(site: Site) -> None:
    moving = []

    def leave(event: Event) -> None:
        if isinstance(event, SinePointMeasured):
            moving.append(site.laboratory.tester.actuator.steady_pp() > 0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        site.run(observer=leave)
    assert moving == [True]
    assert (site.newest().state, site.kept()) == (RunState.STOPPED, (4, 0, 1))
    assert site.is_at_rest()


def test_a_point_without_a_blow_that_counts_fails_the_run_and_keeps_the_refused_ones(site: Site) -> None:
    site.person.what = "double"
    with pytest.raises(PointGivenUpError, match="point 5y: given up after 10 blows"):
        site.run()
    assert site.newest().state is RunState.FAILED
    assert site.kept() == (0, 10, 0)


@pytest.mark.parametrize(
    ("field", "address", "error"),
    [
        ("daq_address", "local", InstrumentAbsentError),
        ("tester_url", "tcp://127.0.0.1:{port}", RigError),
        ("tester_url", "rtu:///dev/ttyNothing", RigError),
        ("tester_url", "http://127.0.0.1", RigError),
        ("thermometer_url", "socket://127.0.0.1:{port}", ThermometerError),
        ("thermometer_url", "/dev/ttyNothing", ThermometerError),
    ],
)
def test_an_absent_instrument_is_named_and_nothing_is_stored(
    field: str, address: str, error: type[Exception], site: Site
) -> None:
    address = address.format(port=free_port())
    elsewhere = replace(site.instruments, **{field: address})  # type: ignore[arg-type]  # one of the three texts
    with site.left_alone(), pytest.raises(error) as refused:
        site.run(instruments=elsewhere)
    assert address in str(refused.value)


def test_a_disk_without_room_is_found_before_the_first_blow_and_nothing_is_stored(
    monkeypatch: pytest.MonkeyPatch, site: Site
) -> None:
    monkeypatch.setattr("rig.runs.spool.FREE_TO_BEGIN", 10**18)
    with site.left_alone(), pytest.raises(SpoolError, match="is full"):
        site.run()


@pytest.mark.parametrize("fault", ["wrong_map_version", "wrong_units", "no_watchdog", "no_limits", "refuse", "silent"])
def test_a_tester_that_is_not_as_it_should_be_is_refused_before_the_first_blow(fault: str, site: Site) -> None:
    site.laboratory.tester.faults.set(fault)
    with site.left_alone(), pytest.raises(RigError) as refused:
        site.run()
    assert isinstance(refused.value, TesterMismatchError) or fault in ("refuse", "silent")
    assert fault != "refuse" or "the tester did not obey a stop" in str(refused.value)


@pytest.mark.parametrize(
    ("step", "change", "error", "words"),
    [
        (0, {"hammer": "mallet"}, ChannelError, "no channel mallet in the channel table; it has hammer, accelerometer"),
        (0, {"accelerometer": "force"}, ChannelError, "measures N, but the hammer step takes it for m/s"),
        (1, {"amplitudes_pp_mm": [0.1, 0.4]}, LimitExceededError, "0.4 mm is outside the rig's limits"),
        (1, {"preset_mm": 1.5}, LimitExceededError, "preset 1.5 mm is outside"),
    ],
)
def test_a_step_that_cannot_be_done_is_found_before_the_first_blow(
    step: int, change: dict[str, Any], error: type[Exception], words: str, document: dict[str, Any], site: Site
) -> None:
    document["steps"][step] |= change
    with site.left_alone(), pytest.raises(error, match=words):
        site.run(sequence_from(document))


def test_a_tripped_tester_is_found_before_the_first_blow(site: Site) -> None:
    site.laboratory.tester.emergency_stop()
    with site.left_alone(), pytest.raises(TesterTrippedError, match="emergency stop"):
        site.run()


def resets(catalogue: Catalogue) -> list[tuple[str, str, str, object]]:
    """Who reset what with which outcome, and what had tripped."""
    with catalogue.reading() as session:
        entries = list_audit_entries(session, action="acknowledge interlock")
    return [(entry.who, entry.target, entry.outcome, entry.details["interlocks"]) for entry in entries]


def test_a_reset_is_in_the_audit_log_though_the_run_it_was_asked_for_with_does_not_begin(
    document: dict[str, Any], site: Site
) -> None:
    document["steps"][0] |= {"hammer": "mallet"}  # which is noticed after the reset
    site.laboratory.tester.emergency_stop()
    site.laboratory.tester.release_emergency_stop()
    with pytest.raises(ChannelError, match="mallet"):
        site.run(sequence_from(document), reset=True, who="key 3 (bench)")
    assert resets(site.catalogue) == [("key 3 (bench)", "new run", "done", ["emergency_stop"])]
    with site.catalogue.reading() as session:
        assert list_runs(session) == []


def test_a_reset_that_the_tester_refuses_is_in_the_audit_log_too(site: Site) -> None:
    site.laboratory.tester.emergency_stop()  # and the button stays pressed
    planned = plan_run(site.sequence, site.instruments.limits, site.catalogue, rig=site.instruments.rig).id
    with pytest.raises(RigError, match="cause still present"):
        site.run_planned(planned, reset=True)
    ((_, target, outcome, _),) = resets(site.catalogue)
    assert (target, outcome) == (f"run {planned}", "the tester refused reset: cause still present")


def test_a_reset_that_is_not_needed_is_not_carried_out(site: Site) -> None:
    site.run(reset=True)
    assert resets(site.catalogue) == []


def test_limits_of_the_rig_hold_for_the_whole_run(site: Site) -> None:
    narrow = replace(site.instruments, limits=TesterLimits(amplitude_pp=5e-5))
    with pytest.raises(LimitExceededError):
        site.run(instruments=narrow)
    assert site.person.counts["strike"] == 0


def test_instruments_are_checked_without_moving_anything(site: Site) -> None:
    found = check_instruments(site.sequence, site.instruments)
    assert {instrument.kind for instrument in found} == {"acquisition", "thermometer", "tester"}
    details = next(each for each in found if each.kind == "tester").details
    assert (details["map"], details["lacks"]) == ("register map 2", [])
    assert details["watchdog_time"] == 2.0
    assert details["detectors"]["force"] == {"limit": 5000.0, "action": "program_interlock"}
    assert site.laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


def test_a_sequence_without_a_sweep_needs_no_tester(document: dict[str, Any], site: Site) -> None:
    document["steps"] = document["steps"][:1]
    nowhere = replace(site.instruments, tester_url="tcp://127.0.0.1:1")
    site.run(sequence_from(document), instruments=nowhere)
    assert site.kept() == (4, 0, 0)
