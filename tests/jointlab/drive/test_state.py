"""The state of the rig after an event."""

from jointlab.drive.state import RigState, after
from rig.events import InterlockReset, InterlockTripped
from rig.registers import NO_INTERLOCK, Interlock


def test_an_interlock_that_follows_does_not_hide_the_first_one() -> None:
    first = after(RigState(), InterlockTripped(Interlock.FORCE, stopped=True))
    both = after(first, InterlockTripped(Interlock.EMERGENCY_STOP, stopped=True))
    assert both.interlocks == Interlock.FORCE | Interlock.EMERGENCY_STOP
    assert after(both, InterlockReset(both.interlocks)).interlocks == NO_INTERLOCK


def test_an_interlock_that_only_indicates_stops_nothing() -> None:
    assert after(RigState(), InterlockTripped(Interlock.FORCE, stopped=False)).interlocks == NO_INTERLOCK
