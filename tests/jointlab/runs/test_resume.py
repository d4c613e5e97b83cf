"""Runs that go on: what is there is not measured again, what is not is, and one process does it."""

import random
import threading
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from sqlalchemy import text

from analysis.dof import Dof
from daq.channels import Channel
from daq.errors import InstrumentAbsentError
from jointlab.runs.carry_out import resume_run, run_sequence
from jointlab.runs.completed import completed_points
from jointlab.runs.orders import RESUMED_WITHOUT_END, plan_run
from rig.completed_points import CompletedPoint, CompletedPoints, ResumeError
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import BlowAccepted, BlowRefused, Event, RunContinued, SinePointMeasured, SpecimenMounted
from rig.instruments import Instruments
from rig.sequence import HammerStep, Sequence, SequenceError, SweepStep, sequence_from
from rig.sweep_plan import Order
from rig.tester_status import TesterTrippedError
from simlab.laboratory import Laboratory
from store.blows import list_blows
from store.catalogue import Catalogue
from store.errors import NotFoundError, WrongRigError
from store.locks import RunBusyError, run_lock
from store.runs import Run, finish_run, get_run, list_run_events, list_runs, start_run
from store.sine_records import SineRecord, add_sine_record, list_sine_records
from store.states import RunState
from tests.bench.bench_resume import (
    SMALL,
    Campaign,
    accelerance_difference,
    deterministic_site,
    sine_difference,
    sine_errors,
)
from tests.rig.person import Person

Observe = Callable[[Event], None]


@pytest.fixture
def database_kind() -> str:
    """SQLite alone; the ingest is tried on both."""
    return "sqlite"


@pytest.fixture
def shuffled(document: dict[str, Any]) -> Sequence:
    """Four blows, and eight sine points in two mountings in an order that a seed draws."""
    more = {"configurations": ["shear", "compression"], "amplitudes_pp_mm": [0.1, 0.05]}
    document["steps"][1] |= more | {"order": "all"}
    return sequence_from(document)


def stopping(control: RunControl, kind: type[Event], count: int, events: list[Event]) -> Observe:
    """An observer that asks for a stop after the `count`-th event of a kind."""

    def observe(event: Event) -> None:
        events.append(event)
        if isinstance(event, kind) and sum(isinstance(each, kind) for each in events) == count:
            control.stop()

    return observe


def stop_after(
    kind: type[Event], count: int, sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> int:
    """Run `sequence` until it is stopped; the number of the run."""
    control, events = RunControl(), list[Event]()
    with pytest.raises(RunStoppedError):
        run_sequence(sequence, instruments, catalogue, person, stopping(control, kind, count, events), control)
    return newest(catalogue).id


def newest(catalogue: Catalogue) -> Run:
    with catalogue.reading() as session:
        return list_runs(session)[0]


def history(catalogue: Catalogue, run_id: int) -> list[tuple[str, str | None]]:
    with catalogue.reading() as session:
        return [(event.state.value, event.reason) for event in list_run_events(session, run_id)]


def test_a_run_stopped_twice_goes_on_as_the_same_run_until_everything_is_measured_once(
    shuffled: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    number = stop_after(BlowAccepted, 3, shuffled, instruments, catalogue, person)
    control, events = RunControl(), list[Event]()
    with pytest.raises(RunStoppedError):
        resume_run(number, instruments, catalogue, person, stopping(control, SinePointMeasured, 3, events), control)
    assert events[0] == RunContinued(number, 3, 0)
    assert sum(isinstance(event, BlowAccepted) for event in events) == 1

    person.requests.clear()
    resume_run(number, instruments, catalogue, person, events.append)
    with catalogue.reading() as session:
        run = get_run(session, number)
        blows, sines = list_blows(session, number), list_sine_records(session, number)
    assert (run.state, run.reason) == (RunState.FINISHED, None)
    assert [(str(blow.point), blow.number) for blow in blows] == [("5y", 1), ("5y", 2), ("1x", 1), ("1x", 2)]
    assert [sine.order_number for sine in sines] == list(range(1, 9))
    asked = {(sine.configuration, sine.commanded_pp_mm, sine.frequency) for sine in sines}
    assert asked == {(c, a, f) for c in ("shear", "compression") for a in (0.1, 0.05) for f in (40.0, 120.0)}
    assert all(later.elapsed > earlier.elapsed for earlier, later in pairwise(sines))
    assert len(person.requests) == 2  # the mounting that was interrupted, and the one that was not begun
    assert history(catalogue, number) == [
        ("running", None),
        ("stopped", "stopped by hand"),
        ("running", "resumed after it was stopped"),
        ("stopped", "stopped by hand"),
        ("running", "resumed after it was stopped"),
        ("finished", None),
    ]
    assert list(catalogue.waveforms.folder.glob("*.lock")) == []


def test_a_seed_is_drawn_once_and_kept_by_the_run(
    shuffled: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    number = stop_after(SpecimenMounted, 1, shuffled, instruments, catalogue, person)
    stored = sequence_from(newest(catalogue).sequence)
    assert stored.sweep is not None
    assert stored.sweep.seed is not None
    resume_run(number, instruments, catalogue, person)
    assert sequence_from(newest(catalogue).sequence) == stored


@pytest.mark.parametrize("stopped_after", [2, 4])
def test_a_blow_beside_its_point_counts_no_more_after_an_interruption_than_without(
    stopped_after: int,
    document: dict[str, Any],
    instruments: Instruments,
    catalogue: Catalogue,
    whole_laboratory: Laboratory,
    person: Person,
) -> None:
    """Two blows cannot tell it, the third does; the session that goes on knows what the interrupted one knew."""

    class Astray(Person):
        def strike(self, point: Dof, blow: int) -> None:
            super().strike(Dof.parse("8y") if blow == 1 else point, blow)

    document["steps"][0] |= {"points": ["5y"], "blows": 4}
    sequence = sequence_from(document)
    number = stop_after(BlowAccepted, stopped_after, sequence, instruments, catalogue, Astray(whole_laboratory))
    events = list[Event]()
    resume_run(number, instruments, catalogue, person, events.append)
    with catalogue.reading() as session:
        blows = list_blows(session, number)
    assert [blow.number for blow in blows] == [1, 2, 3, 4, 5]
    (continued,) = [event for event in events if isinstance(event, RunContinued)]
    assert continued.blows == (2 if stopped_after == 2 else 3)
    assert newest(catalogue).state is RunState.FINISHED


def test_blow_numbers_go_on_after_refused_blows(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, whole_laboratory: Laboratory, person: Person
) -> None:
    class Clumsy(Person):
        def strike(self, point: Dof, blow: int) -> None:
            self.laboratory.bench.strike(point.node, point.direction.value, what="double" if blow <= 2 else "clean")

    number = stop_after(BlowRefused, 2, sequence, instruments, catalogue, Clumsy(whole_laboratory))
    resume_run(number, instruments, catalogue, person)
    with catalogue.reading() as session:
        blows = list_blows(session, number)
    first = [(blow.number, blow.accepted) for blow in blows if str(blow.point) == "5y"]
    assert first == [(1, False), (2, False), (3, True), (4, True)]
    assert person.requests[0] == "5y 3"


def test_a_failed_run_goes_on_when_the_instrument_is_back(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    whole_laboratory: Laboratory,
    repair: Callable[[], None],
) -> None:
    def unplug(event: Event) -> None:
        if isinstance(event, SinePointMeasured):
            whole_laboratory.daq.faults.set("device_gone")

    with pytest.raises(InstrumentAbsentError):
        run_sequence(sequence, instruments, catalogue, person, unplug)
    failed = newest(catalogue)
    with pytest.raises(InstrumentAbsentError):
        resume_run(failed.id, instruments, catalogue, person)
    assert newest(catalogue) == failed  # nothing changed
    repair()
    resume_run(failed.id, instruments, catalogue, person)
    (_, first), (_, second), *_ = history(catalogue, failed.id)[1:]
    assert first == failed.reason
    assert second == "resumed after it was failed"
    assert newest(catalogue).state is RunState.FINISHED


def test_a_tripped_tester_is_reset_only_if_asked_for_and_that_is_recorded(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person, whole_laboratory: Laboratory
) -> None:
    number = stop_after(SinePointMeasured, 1, sequence, instruments, catalogue, person)
    whole_laboratory.tester.emergency_stop()
    whole_laboratory.tester.release_emergency_stop()
    with pytest.raises(TesterTrippedError, match="emergency stop"):
        resume_run(number, instruments, catalogue, person)
    assert newest(catalogue).state is RunState.STOPPED
    resume_run(number, instruments, catalogue, person, reset=True)
    assert history(catalogue, number)[-2:] == [
        ("running", "resumed after it was stopped, tester reset after emergency stop"),
        ("finished", None),
    ]


def test_a_run_that_another_process_carries_out_is_refused_by_name(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    refusals = []

    def intrude(event: Event) -> None:
        if isinstance(event, BlowAccepted):
            with pytest.raises(RunBusyError) as refused:
                resume_run(newest(catalogue).id, instruments, catalogue, person)
            refusals.append(str(refused.value))

    run_sequence(sequence, instruments, catalogue, person, intrude)
    assert len(refusals) == 4
    assert all("is being carried out by " in refusal and ", process " in refusal for refusal in refusals)
    assert newest(catalogue).state is RunState.FINISHED


def test_of_two_that_resume_at_once_one_is_refused(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    number = stop_after(BlowAccepted, 1, sequence, instruments, catalogue, person)
    ended: list[str] = []

    def resume() -> None:
        try:
            resume_run(number, instruments, catalogue, person)
        except RunBusyError:
            ended.append("refused")
        else:
            ended.append("done")

    threads = [threading.Thread(target=resume) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(ended) == ["done", "refused"]
    assert len(history(catalogue, number)) == 4


def test_a_run_that_cannot_be_resumed_is_refused_with_the_reason(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    with pytest.raises(NotFoundError):
        resume_run(77, instruments, catalogue, person)
    with catalogue.writing() as session:
        imported = start_run(session, kind="import", title="t", article="a", setup={})
        finish_run(session, imported.id, RunState.FAILED, "cut off")
    with pytest.raises(ResumeError, match=f"run {imported.id} was not measured from a sequence here"):
        resume_run(imported.id, instruments, catalogue, person)
    number = run_sequence(sequence, instruments, catalogue, person)
    with pytest.raises(ResumeError, match=f"run {number} is finished"):
        resume_run(number, instruments, catalogue, person)
    assert len(history(catalogue, number)) == 2


def test_a_run_of_another_rig_on_the_same_database_is_refused_before_anything_moves(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    stop_after(BlowAccepted, 1, sequence, instruments, catalogue, person)
    run, other = newest(catalogue), replace(instruments, rig="rig B")
    with pytest.raises(WrongRigError, match=f"run {run.id} belongs to rig 'rig', this is 'rig B'; resume it there"):
        resume_run(run.id, other, catalogue, person)
    planned = plan_run(sequence, instruments.limits, catalogue, rig=instruments.rig)
    with pytest.raises(WrongRigError, match=f"run {planned.id} belongs to rig 'rig'"):
        run_sequence(sequence, other, catalogue, person, planned=planned.id)
    assert newest(catalogue).state is RunState.CREATED
    resume_run(run.id, instruments, catalogue, person)


@pytest.mark.parametrize("change", [{"sensitivity": 2.3e-3}, {"serial": "H-02"}, {"maximum": 1000.0}])
def test_another_channel_than_the_run_began_with_is_refused_before_anything_moves(
    change: dict[str, Any],
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    channel_table: tuple[Channel, ...],
) -> None:
    number = stop_after(BlowAccepted, 1, sequence, instruments, catalogue, person)
    person.requests.clear()
    other = replace(instruments, channels=(replace(channel_table[0], **change), *channel_table[1:]))
    with pytest.raises(ResumeError, match="another setting or sensor on channel 'hammer'"):
        resume_run(number, other, catalogue, person)
    assert person.requests == []
    assert newest(catalogue).state is RunState.STOPPED


def test_only_the_instruments_of_the_remaining_steps_are_needed(
    document: dict[str, Any], instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    document["steps"].reverse()
    number = stop_after(BlowAccepted, 1, sequence_from(document), instruments, catalogue, person)
    resume_run(number, replace(instruments, tester_url="tcp://127.0.0.1:1"), catalogue, person)
    assert newest(catalogue).state is RunState.FINISHED


def test_a_run_that_lost_its_process_after_the_last_point_is_finished_without_instruments(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    number = run_sequence(sequence, instruments, catalogue, person)
    with catalogue.writing() as session:  # as if its process had been killed before it could store the end
        session.execute(text("UPDATE runs SET state = 'running', finished_at = NULL"))
    nowhere = replace(instruments, daq_address="grpc://127.0.0.1:1", tester_url="tcp://127.0.0.1:1")
    resume_run(number, nowhere, catalogue, person)
    assert history(catalogue, number)[-2:] == [("running", RESUMED_WITHOUT_END), ("finished", None)]


def test_a_stop_before_the_first_step_leaves_no_run(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    control = RunControl()
    control.stop()
    with pytest.raises(RunStoppedError):
        run_sequence(sequence, instruments, catalogue, person, control=control)
    with catalogue.reading() as session:
        assert list_runs(session) == []


def test_records_that_do_not_fit_the_sequence_are_not_taken_for_points_of_it(
    sequence: Sequence, catalogue: Catalogue
) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="sequence", title="t", article="beam 3", setup={})
        add_sine_record(session, run.id, SineRecord(1, "I", "shear", 0.1, 0.1, 55.0, 1.0, None, None, None))
    with pytest.raises(ResumeError, match=r"sine record 1 \(I, shear, 0\.1 mm, 55 Hz\) is not what"):
        completed_points(catalogue, run, sequence)


WAIT, SOAK = {"step": "wait", "seconds": 1}, {"step": "soak"}


@pytest.mark.parametrize(
    ("points", "sines", "left"),
    [
        ({}, 0, ["wait", "hammer 1", "soak", "hammer 2", "wait", "sweep 1", "wait"]),
        ({(1, "5y"): 2, (1, "1x"): 1}, 0, ["wait", "hammer 1", "soak", "hammer 2", "wait", "sweep 1", "wait"]),
        ({(1, "5y"): 2, (1, "1x"): 2}, 0, ["soak", "hammer 2", "wait", "sweep 1", "wait"]),
        ({(1, "5y"): 2, (1, "1x"): 2, (2, "6y"): 2}, 1, ["wait", "sweep 1", "wait"]),
        ({(1, "5y"): 2, (1, "1x"): 2, (2, "6y"): 2}, 2, ["wait"]),
    ],
)
def test_waits_are_done_again_where_the_step_they_serve_has_something_left(
    points: dict[tuple[int, str], int], sines: int, left: list[str], document: dict[str, Any]
) -> None:
    hammer, sweep = document["steps"]
    document["steps"] = [WAIT, hammer, SOAK, hammer | {"points": ["6y"]}, WAIT, sweep, WAIT]
    measured = CompletedPoints(
        tuple(CompletedPoint(*place, count, 0, count) for place, count in points.items()),
        frozenset(range(1, sines + 1)),
    )
    found = measured.remaining_steps(sequence_from(document))
    assert [f"{step.step} {number}" if number else step.step for step, number in found] == left


BLANK = {"step": "blank", "frequencies": {"first": 20, "last": 60, "step": 20}}


@pytest.mark.parametrize(
    ("sines", "left"),
    [
        (set(), ["blank 1", "sweep 4", "blank 6"]),
        ({1, 2}, ["blank 1", "sweep 4", "blank 6"]),
        ({1, 2, 3}, ["sweep 4", "blank 6"]),
        ({1, 2, 3, 4, 5}, ["blank 6"]),
        (set(range(1, 9)), []),
    ],
)
def test_blanks_and_the_sweep_share_one_row_of_order_numbers(
    sines: set[int], left: list[str], document: dict[str, Any]
) -> None:
    document["steps"] = [BLANK, document["steps"][1], BLANK | {"piece": "empty", "stiffness": 0}]
    found = CompletedPoints(sines=frozenset(sines)).remaining_steps(sequence_from(document))
    assert [f"{step.step} {number}" for step, number in found] == left


def test_a_seed_needs_an_order_to_draw(document: dict[str, Any]) -> None:
    document["steps"][1]["seed"] = 3
    with pytest.raises(SequenceError, match="a seed shuffles nothing in sequential order"):
        sequence_from(document)
    document["steps"][1]["order"] = "mountings"
    sweep = sequence_from(document).with_seed().sweep
    assert sweep is not None
    assert (sweep.order, sweep.seed) == (Order.MOUNTINGS, 3)


def test_a_seed_is_drawn_only_where_one_is_missing(document: dict[str, Any]) -> None:
    plain = sequence_from(document)
    assert plain.with_seed() == plain
    document["steps"][1]["order"] = "amplitudes"
    drawn = {sweep.seed for _ in range(5) if (sweep := sequence_from(document).with_seed().sweep)}
    assert len(drawn) == 5
    assert isinstance(plain.steps[0], HammerStep)
    assert isinstance(plain.steps[1], SweepStep)


def test_a_run_is_free_again_when_it_has_ended(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    stop_after(BlowAccepted, 1, sequence, instruments, catalogue, person)
    with run_lock(catalogue, newest(catalogue)):
        pass


def test_six_processes_killed_at_random_lose_and_double_nothing() -> None:
    hammer, wait, sweep = SMALL
    less = {"amplitudes_pp_mm": [0.1], "frequencies": {"first": 40, "last": 120, "step": 80}}
    with deterministic_site([hammer | {"points": ["5y", "1x"], "blows": 2}, wait, sweep | less]) as site:
        whole = site.uninterrupted()
        chance, runs = random.Random(4), list[Campaign]()
        while sum(run.kills for run in runs) < 6 or not any(run.resumed for run in runs):
            runs.append(site.killed(chance, 6, 1.5 * whole.to_first))
        dwells = site.laboratory.tester.actuator.log
    assert [run.wrong for run in (whole, *runs)] == [[]] * (1 + len(runs))
    for run in runs:
        assert len(run.measurement.points) == len(whole.measurement.points) == 4
        assert sine_errors(run, dwells).max() < 1e-3
        assert sine_difference(run, whole) < 1e-2  # k + ih over 2 % of amplitude
        assert accelerance_difference(run, whole) < 1e-2
