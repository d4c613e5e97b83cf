"""A sequence on all its wires: what is kept, how the run ends, and that the next one succeeds."""

import socket
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from sqlalchemy import func, select, text

from daq.errors import ChannelError, InstrumentAbsentError
from jointlab.runs.carry_out import run_sequence
from jointlab.runs.orders import plan_run
from rig.errors import RigError
from rig.events import BlowAccepted, Event, PointFinished, RunStarted, SinePointMeasured, SpecimenMounted
from rig.hammer import PointGivenUpError
from rig.instruments import Instruments
from rig.registers import State
from rig.sequence import Sequence, sequence_from
from rig.spool import SpoolError
from rig.steps import check_instruments
from rig.tester_limits import LimitExceededError, TesterLimits
from rig.tester_status import TesterMismatchError, TesterTrippedError
from rig.thermometer import ThermometerError
from simlab.laboratory import Laboratory
from store.audit import list_audit_entries
from store.catalogue import Catalogue
from store.models.base import Base
from store.runs import Run, list_runs
from store.states import RunState
from tests.rig.person import Person


@pytest.fixture
def database_kind() -> str:
    """SQLite alone; the ingest is tried on both."""
    return "sqlite"


@pytest.fixture
def is_at_rest(whole_laboratory: Laboratory) -> Callable[[], bool]:
    def look() -> bool:
        tester = whole_laboratory.tester
        return tester.actuator.steady_pp() == 0.0 and tester.device.status()["state"] in (
            State.HYDRAULICS_OFF,
            State.TRIPPED,
        )

    return look


@pytest.fixture
def stored(catalogue: Catalogue) -> Callable[[], dict[str, int]]:
    """Rows of every table and the number of waveform files."""

    def count() -> dict[str, int]:
        with catalogue.reading() as session:
            rows = {
                name: session.scalar(select(func.count()).select_from(table)) or 0
                for name, table in Base.metadata.tables.items()
            }
        folder = catalogue.waveforms.folder
        return rows | {"waveform files": len(list(folder.iterdir())) if folder.exists() else 0}

    return count


def the_run(catalogue: Catalogue) -> Run:
    """The newest."""
    with catalogue.reading() as session:
        return list_runs(session)[0]


def kept(catalogue: Catalogue, run: Run) -> tuple[int, int, int]:
    """Blows accepted and refused, and sine records of a run."""
    with catalogue.reading() as session:
        row = session.execute(
            text("SELECT blows_accepted, blows_refused, sine_records FROM v_runs WHERE run_id = :run"), {"run": run.id}
        ).one()
    return int(row[0] or 0), int(row[1] or 0), int(row[2] or 0)


def test_a_sequence_becomes_one_finished_run_with_everything_in_it(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person, is_at_rest: Callable[[], bool]
) -> None:
    events = list[Event]()
    number = run_sequence(sequence, instruments, catalogue, person, events.append)
    run = the_run(catalogue)
    assert (run.id, run.state, run.kind, run.reason) == (number, RunState.FINISHED, "sequence", None)
    assert (run.title, run.article) == ("a small sequence", "beam 3")
    assert sequence_from(run.sequence) == sequence
    assert run.setup["direct"] == {"file": "direct.csv", "preset_mm": 0.5}
    accepted, _, sines = kept(catalogue, run)
    assert (accepted, sines) == (4, 2)
    assert events[0] == RunStarted(number)
    happened = [type(event) for event in events]
    assert happened.count(BlowAccepted) == 4
    assert happened.count(PointFinished) == 2
    assert (happened.count(SpecimenMounted), happened.count(SinePointMeasured)) == (1, 2)
    assert is_at_rest()
    with catalogue.reading() as session:
        blows = session.execute(
            text("SELECT DISTINCT point, set_number FROM v_blows WHERE accepted ORDER BY point")
        ).all()
        sensors = session.execute(text("SELECT name FROM channels ORDER BY name")).scalars().all()
        kinds = set(session.execute(text("SELECT kind FROM instruments")).scalars())
        warm = session.execute(text("SELECT count(*) FROM v_blows WHERE temperature_c BETWEEN 15 AND 35")).scalar()
    assert [tuple(row) for row in blows] == [("1x", 1), ("5y", 1)]
    assert sensors == ["accelerometer", "displacement", "force", "hammer"]
    assert kinds >= {"acquisition", "thermometer", "tester", "force_iepe"}
    assert warm == sum(kept(catalogue, run)[:2])


def test_a_second_hammer_step_is_a_second_set(
    document: dict[str, Any], instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    hammer = {"step": "hammer", "points": ["5y"], "blows": 2, "block_seconds": 1.0}
    document["steps"] = [hammer, hammer | {"points": ["6y"]}]
    run_sequence(sequence_from(document), instruments, catalogue, person)
    with catalogue.reading() as session:
        rows = session.execute(text("SELECT DISTINCT set_number, point FROM v_blows ORDER BY set_number")).all()
    assert [tuple(row) for row in rows] == [(1, "5y"), (2, "6y")]


def test_one_hertz_is_recorded_for_as_long_as_it_needs(
    document: dict[str, Any], instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    document["steps"] = [document["steps"][1] | {"frequencies": {"first": 1, "last": 1}}]
    run_sequence(sequence_from(document), instruments, catalogue, person)
    assert kept(catalogue, the_run(catalogue)) == (0, 0, 1)


def device_gone(laboratory: Laboratory) -> None:
    laboratory.daq.faults.set("device_gone")


def emergency_stop(laboratory: Laboratory) -> None:
    laboratory.tester.emergency_stop()


def silent_thermometer(laboratory: Laboratory) -> None:
    laboratory.thermometer.faults.set("silent")


@pytest.mark.parametrize(
    ("breaks", "at", "error", "words", "expected"),
    [
        (
            device_gone,
            ("strike", 4),
            InstrumentAbsentError,
            "read hammer, accelerometer: The device is",
            (3, 0, 0),
        ),
        (silent_thermometer, ("strike", 3), ThermometerError, "thermometer at ", (2, 0, 0)),
        (emergency_stop, ("mount", 1), TesterTrippedError, "the tester was stopped by emergency stop", (4, 0, 0)),
        (
            device_gone,
            ("mount", 1),
            InstrumentAbsentError,
            "start displacement, force: The device is",
            (4, 0, 0),
        ),
    ],
)
def test_a_run_that_fails_keeps_its_reason_and_measurements_and_the_next_one_succeeds(
    breaks: Callable[[Laboratory], None],
    at: tuple[str, int],
    error: type[Exception],
    words: str,
    expected: tuple[int, int, int],
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    whole_laboratory: Laboratory,
    repair: Callable[[], None],
    is_at_rest: Callable[[], bool],
) -> None:
    person.at(*at, lambda: breaks(whole_laboratory))
    with pytest.raises(error):
        run_sequence(sequence, instruments, catalogue, person)
    failed = the_run(catalogue)
    assert failed.state is RunState.FAILED
    assert failed.reason is not None
    assert failed.reason.startswith(words)
    assert kept(catalogue, failed) == expected
    assert is_at_rest()

    repair()
    number = run_sequence(sequence, instruments, catalogue, Person(whole_laboratory))
    assert number == failed.id + 1
    assert the_run(catalogue).state is RunState.FINISHED
    assert kept(catalogue, the_run(catalogue))[::2] == (4, 2)


def test_a_tester_that_trips_between_two_sine_points_leaves_the_first(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    whole_laboratory: Laboratory,
    is_at_rest: Callable[[], bool],
) -> None:
    def watch(event: Event) -> None:
        if isinstance(event, SinePointMeasured):
            whole_laboratory.tester.emergency_stop()

    with pytest.raises(TesterTrippedError, match="emergency stop"):
        run_sequence(sequence, instruments, catalogue, person, watch)
    assert the_run(catalogue).state is RunState.FAILED
    assert kept(catalogue, the_run(catalogue)) == (4, 0, 1)
    assert is_at_rest()


@pytest.mark.parametrize(("action", "count", "expected"), [("strike", 2, (1, 0, 0)), ("mount", 1, (4, 0, 0))])
def test_ctrl_c_marks_the_run_stopped_and_leaves_the_actuator_at_rest(
    action: str,
    count: int,
    expected: tuple[int, int, int],
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    is_at_rest: Callable[[], bool],
) -> None:
    def leave() -> None:
        raise KeyboardInterrupt

    person.at(action, count, leave)
    with pytest.raises(KeyboardInterrupt):
        run_sequence(sequence, instruments, catalogue, person)
    run = the_run(catalogue)
    assert (run.state, run.reason) == (RunState.STOPPED, "stopped by hand")
    assert kept(catalogue, run) == expected
    assert is_at_rest()


def test_ctrl_c_while_the_actuator_cycles_stops_it(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    whole_laboratory: Laboratory,
    is_at_rest: Callable[[], bool],
) -> None:
    moving = []

    def leave(event: Event) -> None:
        if isinstance(event, SinePointMeasured):
            moving.append(whole_laboratory.tester.actuator.steady_pp() > 0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sequence(sequence, instruments, catalogue, person, leave)
    assert moving == [True]
    assert (the_run(catalogue).state, kept(catalogue, the_run(catalogue))) == (RunState.STOPPED, (4, 0, 1))
    assert is_at_rest()


def test_a_point_without_a_blow_that_counts_fails_the_run_and_keeps_the_refused_ones(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    person.what = "double"
    with pytest.raises(PointGivenUpError, match="point 5y: given up after 10 blows"):
        run_sequence(sequence, instruments, catalogue, person)
    assert the_run(catalogue).state is RunState.FAILED
    assert kept(catalogue, the_run(catalogue)) == (0, 10, 0)


def unused_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


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
    field: str,
    address: str,
    error: type[Exception],
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    stored: Callable[[], dict[str, int]],
) -> None:
    address = address.format(port=unused_port())
    before = stored()
    elsewhere = replace(instruments, **{field: address})  # type: ignore[arg-type]  # one of the three texts
    with pytest.raises(error) as refused:
        run_sequence(sequence, elsewhere, catalogue, person)
    assert address in str(refused.value)
    assert stored() == before
    assert person.counts == {"strike": 0, "mount": 0}


def test_a_disk_without_room_is_found_before_the_first_blow_and_nothing_is_stored(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    stored: Callable[[], dict[str, int]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = stored()
    monkeypatch.setattr("rig.spool.FREE_TO_BEGIN", 10**18)
    with pytest.raises(SpoolError, match="is full"):
        run_sequence(sequence, instruments, catalogue, person)
    assert stored() == before
    assert person.counts == {"strike": 0, "mount": 0}


@pytest.mark.parametrize("fault", ["wrong_map_version", "wrong_units", "no_watchdog", "no_limits", "refuse", "silent"])
def test_a_tester_that_is_not_as_it_should_be_is_refused_before_the_first_blow(
    fault: str,
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    stored: Callable[[], dict[str, int]],
    whole_laboratory: Laboratory,
) -> None:
    whole_laboratory.tester.faults.set(fault)
    before = stored()
    with pytest.raises(RigError) as refused:
        run_sequence(sequence, instruments, catalogue, person)
    assert isinstance(refused.value, TesterMismatchError) or fault in ("refuse", "silent")
    assert fault != "refuse" or "the tester does not obey" in str(refused.value)
    assert stored() == before
    assert person.counts == {"strike": 0, "mount": 0}


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
    step: int,
    change: dict[str, Any],
    error: type[Exception],
    words: str,
    document: dict[str, Any],
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    stored: Callable[[], dict[str, int]],
) -> None:
    document["steps"][step] |= change
    before = stored()
    with pytest.raises(error, match=words):
        run_sequence(sequence_from(document), instruments, catalogue, person)
    assert stored() == before
    assert person.counts == {"strike": 0, "mount": 0}


def test_a_tripped_tester_is_found_before_the_first_blow(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    stored: Callable[[], dict[str, int]],
    whole_laboratory: Laboratory,
) -> None:
    whole_laboratory.tester.emergency_stop()
    before = stored()
    with pytest.raises(TesterTrippedError, match="emergency stop"):
        run_sequence(sequence, instruments, catalogue, person)
    assert stored() == before
    assert person.counts == {"strike": 0, "mount": 0}


def resets(catalogue: Catalogue) -> list[tuple[str, str, str, object]]:
    """Who reset what with which outcome, and what had tripped."""
    with catalogue.reading() as session:
        entries = list_audit_entries(session, action="acknowledge interlock")
    return [(entry.who, entry.target, entry.outcome, entry.details["interlocks"]) for entry in entries]


def test_a_reset_is_in_the_audit_log_though_the_run_it_was_asked_for_with_does_not_begin(
    document: dict[str, Any],
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    whole_laboratory: Laboratory,
) -> None:
    document["steps"][0] |= {"hammer": "mallet"}  # which is noticed after the reset
    whole_laboratory.tester.emergency_stop()
    whole_laboratory.tester.release_emergency_stop()
    with pytest.raises(ChannelError, match="mallet"):
        run_sequence(sequence_from(document), instruments, catalogue, person, reset=True, who="key 3 (bench)")
    assert resets(catalogue) == [("key 3 (bench)", "new run", "done", ["emergency_stop"])]
    with catalogue.reading() as session:
        assert list_runs(session) == []


def test_a_reset_that_the_tester_refuses_is_in_the_audit_log_too(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person, whole_laboratory: Laboratory
) -> None:
    whole_laboratory.tester.emergency_stop()  # and the button stays pressed
    planned = plan_run(sequence, instruments.limits, catalogue, rig=instruments.rig).id
    with pytest.raises(RigError, match="cause still present"):
        run_sequence(sequence, instruments, catalogue, person, planned=planned, reset=True)
    ((_, target, outcome, _),) = resets(catalogue)
    assert (target, outcome) == (f"run {planned}", "the tester refused reset: cause still present")


def test_a_reset_that_is_not_needed_is_not_carried_out(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    run_sequence(sequence, instruments, catalogue, person, reset=True)
    assert resets(catalogue) == []


def test_limits_of_the_rig_hold_for_the_whole_run(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    narrow = replace(instruments, limits=TesterLimits(amplitude_pp=5e-5))
    with pytest.raises(LimitExceededError):
        run_sequence(sequence, narrow, catalogue, person)
    assert person.counts["strike"] == 0


def test_instruments_are_checked_without_moving_anything(
    sequence: Sequence, instruments: Instruments, whole_laboratory: Laboratory
) -> None:
    found = check_instruments(sequence, instruments)
    assert {instrument.kind for instrument in found} == {"acquisition", "thermometer", "tester"}
    details = next(each for each in found if each.kind == "tester").details
    assert details["map_version"] >= 1
    assert details["watchdog_time"] == 2.0
    assert details["detectors"]["force"] == {"limit": 5000.0, "action": "program_interlock"}
    assert whole_laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


def test_a_sequence_without_a_sweep_needs_no_tester(
    document: dict[str, Any], instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    document["steps"] = document["steps"][:1]
    run_sequence(sequence_from(document), replace(instruments, tester_url="tcp://127.0.0.1:1"), catalogue, person)
    assert kept(catalogue, the_run(catalogue)) == (4, 0, 0)
