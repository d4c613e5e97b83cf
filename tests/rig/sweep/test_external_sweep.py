"""A sweep on a machine that its own software drives, through the wires of acquisition and thermometer alone."""

import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace

import pytest

from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import MotionSeen, SinePointMeasured, SinePointRefused, SpecimenMounted
from rig.sequences.sweep_plan import SweepPlan
from simlab.external_program import ProgramFault
from simlab.laboratory import Laboratory
from tests.rig.sweeping import Run
from tests.rig.watched import DISPLACEMENT, FORCE, PLAN, SPEED, Watched
from tests.waiting import until


@pytest.fixture(scope="module")
def running() -> Iterator[Laboratory]:
    with Laboratory(5, SPEED) as laboratory:
        yield laboratory


@pytest.fixture
def watched(running: Laboratory) -> Iterator[Watched]:
    yield Watched(running)
    running.program.rest()
    running.program.faults.clear()
    running.daq.faults.clear()


def test_every_planned_point_is_stored_once_in_whatever_order_the_machine_runs_them(watched: Watched) -> None:
    watched.sweep()
    assert sorted(point.order_number for point in watched.points) == [1, 2, 3, 4]
    assert {(point.amplitude_pp, point.frequency, point.driven_frequency) for point in watched.points} == {
        (amplitude, frequency, driven)
        for amplitude in (1e-4, 3e-5)
        for frequency, driven in ((40.0, 40.0), (50.0, 48.0))
    }
    assert not watched.wrong_points()
    assert all(point.block.duration * point.driven_frequency > 23.9 for point in watched.points)
    kinds = [type(event) for event in watched.events]
    assert (kinds.count(SpecimenMounted), kinds.count(SinePointMeasured)) == (1, 4)
    assert watched.asked == [4, 0]
    assert not watched.tasks
    assert not watched.offers


def test_what_is_stored_already_is_neither_asked_for_nor_mounted_for_nor_stored_again(watched: Watched) -> None:
    watched.sweep(completed=(1, 4))
    assert sorted(point.order_number for point in watched.points) == [2, 3]
    assert watched.asked == [2, 0]
    again = Watched(watched.laboratory)
    again.sweep(completed=(1, 2, 3, 4))
    assert not again.events
    assert not again.asked


def test_two_planned_points_that_the_mains_moves_to_one_frequency_are_both_measured(watched: Watched) -> None:
    watched.sweep(replace(PLAN, frequencies=(49.0, 50.0), amplitudes_pp=(1e-4,)))
    assert [(point.driven_frequency, point.frequency) for point in watched.points] == [(48.0, 49.0), (48.0, 50.0)]


def test_other_points_of_the_machine_are_ignored_and_shown(watched: Watched) -> None:
    begun = threading.Event()

    class Otherwise(Watched):
        def run_points(self, preset: float, points: Sequence[tuple[float, float]]) -> None:
            others = [(7e-5, 41.0), (2e-5, 130.0)]
            self.laboratory.program.run(preset, [*points, *others] if begun.is_set() else others)

    other, control = Otherwise(watched.laboratory), RunControl()
    run = Run(lambda control: other.sweep(control=control), control)
    until(lambda: "MotionSeen(frequency=41.0, amplitude_pp_mm=0.07, verdict='not in the plan')" in other.heard())
    control.stop()
    assert isinstance(run.ended(), RunStoppedError)
    assert not other.points
    begun.set()
    other.sweep()
    assert len(other.points) == 4
    assert not other.wrong_points()


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        (ProgramFault.WRONG_AMPLITUDE, "not in the plan"),
        (ProgramFault.OFF_FREQUENCY, "not in the plan"),
        (ProgramFault.WRONG_PRESET, "it moves about 0.25 mm, and 0.5 mm are planned"),
        (ProgramFault.DRIFTING_AMPLITUDE, "not settled|not in the plan|no steady sine"),
        (ProgramFault.DRIFTING_FREQUENCY, "not settled|not in the plan|no steady sine"),
    ],
)
def test_what_the_machine_runs_otherwise_is_not_stored_and_the_operator_is_told_why(
    watched: Watched, fault: ProgramFault, why: str
) -> None:
    watched.accepts = lambda: any(part in watched.heard() for part in why.split("|"))
    watched.laboratory.program.faults.set(fault)
    watched.sweep(patience=0.3)
    assert not watched.wrong_points()
    if fault not in (
        ProgramFault.DRIFTING_AMPLITUDE,
        ProgramFault.DRIFTING_FREQUENCY,
    ):  # a busy computer drifts in steps
        assert not watched.points
        assert "missing: about a mean of 0.5 mm, " in watched.offers[0]


@pytest.mark.parametrize(
    ("fault", "physical", "why"),
    [
        ("inverted", FORCE, "polarity"),
        ("inverted", DISPLACEMENT, "it moves about -0.5 mm"),
        ("dead", FORCE, "force channel connected|force is constant"),
        ("saturated", FORCE, "the force channel is at an end of its range"),
        ("saturated", DISPLACEMENT, "the displacement channel is at an end of its range"),
        ("dead", DISPLACEMENT, "nothing moves|no steady sine|one value alone"),
        ("weak", DISPLACEMENT, "not in the plan|nothing moves"),
    ],
)
def test_a_point_of_a_faulty_channel_is_not_stored_and_the_operator_is_told_why(
    watched: Watched, fault: str, physical: str, why: str
) -> None:
    watched.accepts = lambda: any(part in watched.heard() for part in why.split("|"))
    watched.laboratory.daq.faults.set(fault, physical)
    watched.sweep(patience=0.3)
    assert not watched.points
    left_out = [event for event in watched.events if isinstance(event, SinePointRefused) and "ended" in event.reason]
    assert len(left_out) == PLAN.points


def test_a_machine_that_ends_half_way_leaves_the_rest_to_be_asked_for(watched: Watched) -> None:
    watched.laboratory.program.faults.set(ProgramFault.ENDS, 1)
    again = [(amplitude_pp, PLAN.driven_frequency(frequency)) for amplitude_pp, frequency in PLAN.sines()]
    watched.on_offer = lambda: watched.laboratory.program.run(PLAN.preset, again)
    watched.sweep(patience=0.3)
    assert len(watched.points) == 4
    assert not watched.wrong_points()
    assert watched.offers
    assert watched.asked[0] == 4
    assert watched.asked[-1] == 0


def test_a_stop_ends_the_recording_at_once(watched: Watched) -> None:
    control = RunControl()
    watched.on_point = control.stop
    with pytest.raises(RunStoppedError):
        watched.sweep(control=control)
    assert len(watched.points) == 1


def test_a_pause_repeats_what_it_interrupts(watched: Watched) -> None:
    control = RunControl()

    def pause() -> None:
        watched.on_point = int
        control.pause()
        threading.Timer(0.2, control.resume).start()

    watched.on_point = pause
    watched.sweep(control=control)
    assert len(watched.points) == 4
    assert not watched.wrong_points()


def test_nobody_is_asked_to_reach_into_a_machine_that_the_displacement_channel_sees_move(watched: Watched) -> None:
    watched.mount("I", "shear")
    watched.laboratory.program.run(5e-4, [(1e-4, 30.0)])
    until(lambda: watched.laboratory.tester.actuator.steady_pp() > 0)
    watched.sweep()
    assert watched.tasks[0].endswith(" mm peak to peak: bring the machine to rest by its own controls")
    assert len(watched.points) == 4


def test_a_known_piece_is_measured_too(watched: Watched) -> None:
    plan = SweepPlan(
        frequencies=(60.0,), amplitudes_pp=(1e-4,), configurations=("blank",), specimens=("empty",), preset=0.0
    )
    watched.sweep(plan)
    assert [point.configuration for point in watched.points] == ["blank"]
    assert not any(isinstance(event, MotionSeen) and "polarity" in event.verdict for event in watched.events)
