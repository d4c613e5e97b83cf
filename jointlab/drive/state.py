"""The state of the rig: a snapshot, and how each event changes it."""

from dataclasses import dataclass, replace

from jointlab.drive.events import (
    BlowWithdrawn,
    ExaminationEnded,
    OperatorAsked,
    PromptKind,
    RunEnded,
    RunStopping,
    TesterAnswers,
    TesterSilent,
    UnaskedMotion,
)
from jointlab.drive.phase import Phase
from rig.events import (
    ActuatorShutDown,
    BlowAccepted,
    BlowInconsistent,
    BlowRefused,
    Event,
    ExaminationStep,
    InterlockReset,
    InterlockTripped,
    MotionSeen,
    PointStarted,
    PromptStarted,
    RestSeen,
    RestUnknown,
    RunContinued,
    RunPaused,
    RunResumed,
    RunStarted,
    SinePointMeasured,
    SoakStarted,
    SpecimenMounted,
    TesterLineLost,
    WaitStarted,
)
from rig.operator import mounting_text
from rig.registers import NO_INTERLOCK, Interlock
from rig.sequences.sequence import Sequence
from rig.tester.status import last_resort
from store.states import RunState

NOT_READ = "it was not read since the drive process began"
"""Why nothing is known of a tester at first."""


@dataclass(frozen=True)
class RigState:
    """The state of the rig.

    Attributes:
        run_id: the run that is carried out, or was last; None before the first.
        title: of that run.
        activity: its present step, or what is examined, to show.
        point: that is struck, such as 3y; None while none is.
        blows, blows_wanted: accepted blows of the run that count.
        refused_blows: since it was begun or resumed.
        sines, sines_wanted: its sine points.
        ended_as, reason: how the last run ended, and why; None while one is carried out. Created: it did not begin.
        pressure: whether hydraulics are on while the run is paused; None where it does not drive the tester then.
        interlocks: those that stopped the tester and were not reset.
        unnamed_trip: whether the tester was stopped without naming the cause, and was not reset.
        idle_trip: whether the trip in force came while no run was carried out: no end of a run tells of it.
        tester_silent: why the tester does not answer while no run drives it; None where it does.
        rest_unknown: why it is not known whether the actuator rests: it moved while no run drove it, or a stop was not
            confirmed. None where it was seen at rest since.
        shut_down: why the actuator was shut down while the run has not ended; None where it was not.
        is_driven: whether a tester is driven from here; where none is, nothing is known of a machine's rest.
    """

    phase: Phase = Phase.IDLE
    run_id: int | None = None
    title: str = ""
    activity: str = ""
    point: str | None = None
    blows: int = 0
    blows_wanted: int = 0
    refused_blows: int = 0
    sines: int = 0
    sines_wanted: int = 0
    ended_as: RunState | None = None
    reason: str | None = None
    pressure: bool | None = None
    interlocks: Interlock = NO_INTERLOCK
    unnamed_trip: bool = False
    idle_trip: bool = False
    tester_silent: str | None = None
    rest_unknown: str | None = None
    shut_down: str | None = None
    is_driven: bool = True

    @property
    def is_tripped(self) -> bool:
        """Whether the tester was stopped by something, named or not, that was not reset."""
        return self.unnamed_trip or bool(self.interlocks)


def starting(state: RigState, sequence: Sequence, run_id: int) -> RigState:
    """The state as run `run_id`, which carries out `sequence`, is about to begin."""
    return RigState(
        phase=Phase.STARTING,
        run_id=run_id,
        title=sequence.title,
        activity="connecting to the instruments",
        blows_wanted=sum(len(step.points) * step.blows for step in sequence.hammer_steps),
        sines_wanted=sum(step.points for step, _ in sequence.sine_steps),
        interlocks=state.interlocks,
        unnamed_trip=state.unnamed_trip,
        idle_trip=state.idle_trip,
        rest_unknown=state.rest_unknown,
        is_driven=state.is_driven,
    )


def after(state: RigState, event: Event) -> RigState:
    """The state after `event`."""
    match event:
        case RunStarted(run_id):
            return replace(state, phase=Phase.RUNNING, run_id=run_id)
        case RunContinued(run_id, blows, sines):
            return replace(state, phase=Phase.RUNNING, run_id=run_id, blows=blows, sines=sines)
        case PointStarted(point, index, points):
            return replace(state, activity=f"blows at {point} ({index} of {points})", point=str(point))
        case BlowAccepted():
            return replace(state, blows=state.blows + 1)
        case BlowRefused():
            return replace(state, refused_blows=state.refused_blows + 1)
        case BlowInconsistent():  # it was accepted before, and another one is asked for
            return replace(state, blows=state.blows - 1)
        case BlowWithdrawn(run_id) if run_id == state.run_id:
            return replace(state, blows=state.blows - 1)
        case SpecimenMounted(specimen, configuration):
            return replace(state, activity=f"measuring {mounting_text(specimen, configuration)}", point=None)
        case MotionSeen(frequency, amplitude, verdict):
            sine = f"{frequency:g} Hz at {amplitude:g} mm: " if frequency else ""
            return replace(state, activity=f"sees {sine}{verdict}")
        case SinePointMeasured():
            return replace(state, sines=state.sines + 1)
        case PromptStarted():
            return replace(state, activity="waiting for the operator")
        case OperatorAsked(_, PromptKind.MOUNT):  # somebody works at the tester, which rests
            return replace(state, activity="waiting for the operator", point=None)
        case WaitStarted(seconds):
            return replace(state, activity=f"waiting for {seconds:g} s")
        case SoakStarted(band, seconds):
            return replace(state, activity=f"waiting for {seconds:g} s within {band:g} K")
        case RunPaused() | RunResumed() if state.phase is Phase.STOPPING:
            return state  # it ends all the same
        case RunPaused(pressure):
            return replace(state, phase=Phase.PAUSED, pressure=pressure)
        case RunResumed():
            return replace(state, phase=Phase.RUNNING, pressure=None)
        case RunStopping():
            return replace(state, phase=Phase.STOPPING)
        case RunEnded(_, ended_as, reason):
            ended = replace(state, phase=Phase.IDLE, activity="", point=None, shut_down=None)
            return replace(ended, ended_as=ended_as, reason=reason)
        case ActuatorShutDown(reason):
            told = f"the actuator is shut down: {reason}"
            return replace(state, phase=Phase.STOPPING, activity=told, shut_down=reason)
        case ExaminationStep(subject):
            return replace(state, phase=Phase.EXAMINING, activity=f"examining {subject}", point=None)
        case ExaminationEnded():
            return replace(state, phase=Phase.IDLE, activity="")
        case InterlockTripped(interlocks, stopped):
            return _tripped(state, interlocks) if stopped else state
        case TesterLineLost(stops_within):
            lost = f"line to the tester lost; {last_resort(stops_within)}"
            return replace(state, activity=lost, rest_unknown=lost)
        case RestUnknown(reason):
            phase = Phase.STOPPING if state.phase.is_of_a_run else state.phase
            return replace(state, phase=phase, rest_unknown=reason)
        case UnaskedMotion(reason):
            return replace(state, rest_unknown=reason)
        case RestSeen():
            return replace(state, rest_unknown=None)
        case InterlockReset():
            return replace(state, interlocks=NO_INTERLOCK, unnamed_trip=False, idle_trip=False)
        case TesterSilent(reason):
            return replace(state, tester_silent=reason)
        case TesterAnswers():
            return replace(state, tester_silent=None)
        case _:
            return state


def _tripped(state: RigState, interlocks: Interlock) -> RigState:
    return replace(
        state,
        interlocks=state.interlocks | interlocks,
        unnamed_trip=state.unnamed_trip or not interlocks,
        idle_trip=state.idle_trip or (state.phase is Phase.IDLE and not state.is_tripped),
    )
