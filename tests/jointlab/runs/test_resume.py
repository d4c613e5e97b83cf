"""Runs that go on: what is there is not measured again, what is not is, and one process does it."""

import random
import threading
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from sqlalchemy import text

from analysis.dof import Dof
from daq.channels import Channel
from daq.errors import InstrumentAbsentError
from jointlab.runs.completed import completed_points
from jointlab.runs.orders import RESUMED_WITHOUT_END, plan_run
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import BlowAccepted, BlowRefused, Event, RestSeen, RunContinued, SinePointMeasured, SpecimenMounted
from rig.instruments import stored_channel
from rig.runs.completed_points import CompletedPoint, CompletedPoints, ResumeError
from rig.sequences.sequence import HammerStep, Sequence, SequenceError, SweepStep, sequence_from
from rig.sequences.sweep_plan import Order
from rig.tester.status import TesterTrippedError
from store.errors import NotFoundError, WrongRigError
from store.measurements.blows import list_blows
from store.measurements.locks import RunBusyError, run_lock
from store.measurements.runs import finish_run, get_run, list_runs, start_run
from store.measurements.sine_records import SineRecord, add_sine_record, list_sine_records
from store.states import RunState
from tests.bench.bench_resume import (
    SMALL,
    Campaign,
    accelerance_difference,
    deterministic_site,
    sine_difference,
    sine_errors,
)
from tests.jointlab.runs.site import Site, stopping
from tests.rig.person import Person


@pytest.fixture
def database_kind() -> str:
    """SQLite alone, unless a test asks for both; the ingest is tried on both."""
    return "sqlite"


@pytest.fixture
def shuffled(document: dict[str, Any]) -> Sequence:
    """Four blows, and eight sine points in two mountings in an order that a seed draws."""
    more = {"configurations": ["shear", "compression"], "amplitudes_pp_mm": [0.1, 0.05]}
    document["steps"][1] |= more | {"order": "all"}
    return sequence_from(document)


def test_a_run_stopped_twice_goes_on_as_the_same_run_until_everything_is_measured_once(
    shuffled: Sequence, site: Site
) -> None:
    number = site.stop_after(BlowAccepted, 3, shuffled)
    control, events = RunControl(), list[Event]()
    with pytest.raises(RunStoppedError):
        site.resume(number, observer=stopping(control, SinePointMeasured, 3, events), control=control)
    assert next(each for each in events if not isinstance(each, RestSeen)) == RunContinued(number, 3, 0)
    assert sum(isinstance(event, BlowAccepted) for event in events) == 1

    site.person.requests.clear()
    site.resume(number, observer=events.append)
    with site.catalogue.reading() as session:
        run = get_run(session, number)
        blows, sines = list_blows(session, number), list_sine_records(session, number)
    assert (run.state, run.reason) == (RunState.FINISHED, None)
    assert [(str(blow.point), blow.number) for blow in blows] == [("5y", 1), ("5y", 2), ("1x", 1), ("1x", 2)]
    assert [sine.order_number for sine in sines] == list(range(1, 9))
    asked = {(sine.configuration, sine.commanded_pp_mm, sine.frequency) for sine in sines}
    assert asked == {(c, a, f) for c in ("shear", "compression") for a in (0.1, 0.05) for f in (40.0, 120.0)}
    assert all(later.elapsed > earlier.elapsed for earlier, later in pairwise(sines))
    assert len(site.person.requests) == 2  # the mounting that was interrupted, and the one that was not begun
    assert site.history(number) == [
        ("running", None),
        ("stopped", "stopped by hand"),
        ("running", "resumed after it was stopped"),
        ("stopped", "stopped by hand"),
        ("running", "resumed after it was stopped"),
        ("finished", None),
    ]
    assert list(site.catalogue.waveforms.folder.glob("*.lock")) == []


def test_a_seed_is_drawn_once_and_kept_by_the_run(shuffled: Sequence, site: Site) -> None:
    number = site.stop_after(SpecimenMounted, 1, shuffled)
    stored = sequence_from(site.newest().sequence)
    assert stored.sweep is not None
    assert stored.sweep.seed is not None
    site.resume(number)
    assert sequence_from(site.newest().sequence) == stored


@pytest.mark.parametrize("stopped_after", [2, 4])
def test_a_blow_beside_its_point_counts_no_more_after_an_interruption_than_without(
    stopped_after: int, document: dict[str, Any], site: Site
) -> None:
    """Two blows cannot tell it, the third does; the session that goes on knows what the interrupted one knew."""

    class Astray(Person):
        def strike(self, point: Dof, blow: int) -> None:
            super().strike(Dof.parse("8y") if blow == 1 else point, blow)

    document["steps"][0] |= {"points": ["5y"], "blows": 4}
    number = site.stop_after(BlowAccepted, stopped_after, sequence_from(document), operator=Astray(site.laboratory))
    events = list[Event]()
    site.resume(number, observer=events.append)
    with site.catalogue.reading() as session:
        blows = list_blows(session, number)
    assert [blow.number for blow in blows] == [1, 2, 3, 4, 5]
    (continued,) = [event for event in events if isinstance(event, RunContinued)]
    assert continued.blows == (2 if stopped_after == 2 else 3)
    assert site.newest().state is RunState.FINISHED


def test_blow_numbers_go_on_after_refused_blows(site: Site) -> None:
    class Clumsy(Person):
        def strike(self, point: Dof, blow: int) -> None:
            self.laboratory.bench.strike(point.node, point.direction.value, what="double" if blow <= 2 else "clean")

    number = site.stop_after(BlowRefused, 2, operator=Clumsy(site.laboratory))
    site.resume(number)
    with site.catalogue.reading() as session:
        blows = list_blows(session, number)
    first = [(blow.number, blow.accepted) for blow in blows if str(blow.point) == "5y"]
    assert first == [(1, False), (2, False), (3, True), (4, True)]
    assert site.person.requests[0] == "5y 3"


def test_a_failed_run_goes_on_when_the_instrument_is_back(site: Site) -> None:
    def unplug(event: Event) -> None:
        if isinstance(event, SinePointMeasured):
            site.laboratory.daq.faults.set("device_gone")

    with pytest.raises(InstrumentAbsentError):
        site.run(observer=unplug)
    failed = site.newest()
    with pytest.raises(InstrumentAbsentError):
        site.resume(failed.id)
    assert site.newest() == failed  # nothing changed
    site.repair()
    site.resume(failed.id)
    (_, first), (_, second), *_ = site.history(failed.id)[1:]
    assert first == failed.reason
    assert second == "resumed after it was failed"
    assert site.newest().state is RunState.FINISHED


def test_a_tripped_tester_is_reset_only_if_asked_for_and_that_is_recorded(site: Site) -> None:
    number = site.stop_after(SinePointMeasured, 1)
    site.laboratory.tester.emergency_stop()
    site.laboratory.tester.release_emergency_stop()
    with pytest.raises(TesterTrippedError, match="emergency stop"):
        site.resume(number)
    assert site.newest().state is RunState.STOPPED
    site.resume(number, reset=True)
    assert site.history(number)[-2:] == [
        ("running", "resumed after it was stopped, tester reset after emergency stop"),
        ("finished", None),
    ]


def test_a_run_that_another_process_carries_out_is_refused_by_name(site: Site) -> None:
    refusals = []

    def intrude(event: Event) -> None:
        if isinstance(event, BlowAccepted):
            with pytest.raises(RunBusyError) as refused:
                site.resume(site.newest().id)
            refusals.append(str(refused.value))

    site.run(observer=intrude)
    assert len(refusals) == 4
    assert all("is being carried out by " in refusal and ", process " in refusal for refusal in refusals)
    assert site.newest().state is RunState.FINISHED


def test_of_two_that_resume_at_once_one_is_refused(site: Site) -> None:
    number = site.stop_after(BlowAccepted, 1)
    ended: list[str] = []

    def resume() -> None:
        try:
            site.resume(number)
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
    assert len(site.history(number)) == 4


def test_a_run_that_cannot_be_resumed_is_refused_with_the_reason(site: Site) -> None:
    with pytest.raises(NotFoundError):
        site.resume(77)
    with site.catalogue.writing() as session:
        imported = start_run(session, kind="import", title="t", article="a", setup={})
        finish_run(session, imported.id, RunState.FAILED, "cut off")
    with pytest.raises(ResumeError, match=f"run {imported.id} was not measured from a sequence here"):
        site.resume(imported.id)
    number = site.run()
    with pytest.raises(ResumeError, match=f"run {number} is finished"):
        site.resume(number)
    assert len(site.history(number)) == 2


@pytest.mark.parametrize("database_kind", ["sqlite", "postgresql"])
def test_a_run_of_another_rig_on_the_same_database_is_refused_before_anything_moves(site: Site) -> None:
    site.stop_after(BlowAccepted, 1)
    run, other = site.newest(), replace(site.instruments, rig="rig B")
    with pytest.raises(WrongRigError, match=f"run {run.id} belongs to rig 'rig', this is 'rig B'; resume it there"):
        site.resume(run.id, instruments=other)
    planned = plan_run(site.sequence, site.instruments.limits, site.catalogue, rig=site.instruments.rig)
    with pytest.raises(WrongRigError, match=f"run {planned.id} belongs to rig 'rig'"):
        site.run_planned(planned.id, instruments=other)
    assert site.newest().state is RunState.CREATED
    site.resume(run.id)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"sensitivity": 2.3e-3}, r"sensitivity .*, now 0\.0023\. Restore"),
        ({"serial": "H-02"}, r"serial .*, now H-02\. Restore"),
        ({"maximum": 1000.0}, r"maximum .*, now 1000\.0\. Restore"),
        ({"polarity": -1}, r"polarity 1, now -1\. Restore"),
    ],
)
def test_another_channel_than_the_run_began_with_is_refused_before_anything_moves(
    change: dict[str, Any], said: str, channel_table: tuple[Channel, ...], site: Site
) -> None:
    number = site.stop_after(BlowAccepted, 1)
    site.person.requests.clear()
    other = replace(site.instruments, channels=(replace(channel_table[0], **change), *channel_table[1:]))
    with pytest.raises(ResumeError, match=f"channel 'hammer' has changed since run {number} began: {said}"):
        site.resume(number, instruments=other)
    assert site.person.requests == []
    assert site.newest().state is RunState.STOPPED


def test_a_run_of_a_version_that_did_not_store_polarities_goes_on(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as older:
        older.setattr("rig.runs.run.stored_channel", lambda channel: replace(stored_channel(channel), polarity=None))
        number = site.stop_after(BlowAccepted, 1)
    site.resume(number)
    assert site.newest().state is RunState.FINISHED


def test_only_the_instruments_of_the_remaining_steps_are_needed(document: dict[str, Any], site: Site) -> None:
    document["steps"].reverse()
    number = site.stop_after(BlowAccepted, 1, sequence_from(document))
    site.resume(number, instruments=replace(site.instruments, tester_url="tcp://127.0.0.1:1"))
    assert site.newest().state is RunState.FINISHED


def test_a_run_that_lost_its_process_after_the_last_point_is_finished_without_instruments(site: Site) -> None:
    number = site.run()
    with site.catalogue.writing() as session:  # as if its process had been killed before it could store the end
        session.execute(text("UPDATE runs SET state = 'running', finished_at = NULL"))
    nowhere = replace(site.instruments, daq_address="grpc://127.0.0.1:1", tester_url="tcp://127.0.0.1:1")
    site.resume(number, instruments=nowhere)
    assert site.history(number)[-2:] == [("running", RESUMED_WITHOUT_END), ("finished", None)]


def test_a_stop_before_the_first_step_leaves_no_run(site: Site) -> None:
    control = RunControl()
    control.stop()
    with pytest.raises(RunStoppedError):
        site.run(control=control)
    with site.catalogue.reading() as session:
        assert list_runs(session) == []


def test_records_that_do_not_fit_the_sequence_are_not_taken_for_points_of_it(site: Site) -> None:
    with site.catalogue.writing() as session:
        run = start_run(session, kind="sequence", title="t", article="beam 3", setup={})
        add_sine_record(session, run.id, SineRecord(1, "I", "shear", 0.1, 0.1, 55.0, 1.0, None, None, None))
    with pytest.raises(ResumeError, match=r"sine record 1 \(I, shear, 0\.1 mm, 55 Hz\) is not what"):
        completed_points(site.catalogue, run, site.sequence)


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


def test_a_run_is_free_again_when_it_has_ended(site: Site) -> None:
    site.stop_after(BlowAccepted, 1)
    with run_lock(site.catalogue, site.newest()):
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
