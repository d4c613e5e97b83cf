"""The state of the rig after an event."""

from analysis.dof import Dof
from jointlab.drive.events import BlowWithdrawn, OperatorAsked, PromptKind, RunEnded, UnaskedMotion
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState, after, starting
from rig.events import (
    BlowAccepted,
    BlowInconsistent,
    InterlockReset,
    InterlockTripped,
    PointStarted,
    RestSeen,
    RestUnknown,
    RunPaused,
    RunResumed,
    SpecimenMounted,
    TesterLineLost,
)
from rig.registers import NO_INTERLOCK, Interlock
from rig.sequences.sequence import sequence_from
from store.states import RunState
from tests.api.conftest import paper


def test_an_interlock_that_follows_does_not_hide_the_first_one() -> None:
    first = after(RigState(), InterlockTripped(Interlock.FORCE, stopped=True))
    both = after(first, InterlockTripped(Interlock.EMERGENCY_STOP, stopped=True))
    assert both.interlocks == Interlock.FORCE | Interlock.EMERGENCY_STOP
    assert after(both, InterlockReset(both.interlocks)).interlocks == NO_INTERLOCK


def test_an_interlock_that_only_indicates_stops_nothing() -> None:
    assert after(RigState(), InterlockTripped(Interlock.FORCE, stopped=False)).interlocks == NO_INTERLOCK


def test_that_rest_is_unknown_outlives_the_end_of_its_run_and_the_next_start_until_rest_is_seen() -> None:
    unknown = after(RigState(Phase.RUNNING, 7), RestUnknown("it moves on"))
    ended = after(unknown, RunEnded(7, RunState.FAILED, "it moves on"))
    assert (unknown.phase, ended.phase, ended.rest_unknown) == (Phase.STOPPING, Phase.IDLE, "it moves on")
    next_run = starting(ended, sequence_from(paper()), 8)
    assert (next_run.phase, next_run.rest_unknown) == (Phase.STARTING, "it moves on")
    assert after(next_run, RestSeen()).rest_unknown is None


def test_rest_is_unknown_from_the_loss_of_the_line_on() -> None:
    lost = after(RigState(Phase.RUNNING, 7), TesterLineLost(None))
    assert lost.rest_unknown == "line to the tester lost; press the red button: the tester has no watchdog"


def test_motion_that_no_run_drives_ends_no_run_that_only_waits() -> None:
    assert after(RigState(Phase.RUNNING, 7), UnaskedMotion("it is CYCLING")).phase is Phase.RUNNING


def test_a_run_that_is_being_stopped_is_told_as_neither_paused_nor_running_by_what_was_asked_before() -> None:
    stopping = after(RigState(Phase.RUNNING, 7), RestUnknown("it moves on"))
    assert after(stopping, RunPaused(pressure=False)) == stopping
    assert after(stopping, RunResumed(1.0)) == stopping


def test_a_trip_without_a_name_stands_until_it_is_reset_and_outlives_the_next_start() -> None:
    tripped = after(RigState(), InterlockTripped(NO_INTERLOCK, stopped=True))
    next_run = starting(tripped, sequence_from(paper()), 7)
    assert (tripped.is_tripped, next_run.is_tripped, tripped.interlocks) == (True, True, NO_INTERLOCK)
    assert not after(next_run, InterlockReset(NO_INTERLOCK)).is_tripped


def test_a_trip_that_ends_a_run_is_no_trip_of_an_idle_rig() -> None:
    tripped = after(RigState(Phase.RUNNING, 7), InterlockTripped(Interlock.FORCE, stopped=True))
    ended = after(tripped, RunEnded(7, RunState.FAILED, "force"))
    assert not after(ended, InterlockTripped(Interlock.EMERGENCY_STOP, stopped=True)).idle_trip
    assert after(RigState(), InterlockTripped(Interlock.FORCE, stopped=True)).idle_trip


def test_blows_that_are_withdrawn_or_left_out_as_inconsistent_do_not_count() -> None:
    point = Dof.parse("5y")
    struck = RigState(Phase.RUNNING, 7)
    for number in (1, 2, 3):
        struck = after(struck, BlowAccepted(point, number, accepted=number, wanted=5, peak_force=100.0))
    left_out = after(struck, BlowInconsistent(point, 1, "it is unlike the others"))
    assert (struck.blows, left_out.blows) == (3, 2)
    assert after(left_out, BlowWithdrawn(7, "5y", 2, "double hit")).blows == 1
    assert after(left_out, BlowWithdrawn(6, "5y", 2, "of an earlier run")).blows == 2


def test_a_run_that_waits_for_a_mounting_is_told_as_neither_striking_nor_measuring() -> None:
    mount = OperatorAsked(4, PromptKind.MOUNT, "mount the cylinders of joint I in shear, and step back")
    for before in (PointStarted(Dof.parse("11x"), 11, 11), SpecimenMounted("I", "compression")):
        waits = after(after(RigState(Phase.RUNNING, 7), before), mount)
        assert (waits.activity, waits.point) == ("waiting for the operator", None)
    go = OperatorAsked(5, PromptKind.GO, "take the hammer to 1y")
    assert after(RigState(Phase.RUNNING, 7, activity="blows at 1y"), go).activity == "blows at 1y"
