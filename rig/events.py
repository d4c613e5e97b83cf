"""Events that a sequence reports to the programs that observe it, one for each thing that happened.

The command line shows events as progress, the page shows them live, a test collects them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, dataclass_transform

from analysis.dof import Dof
from rig.registers import Interlock
from store.quantity import quantity


@dataclass_transform(frozen_default=True)
@dataclass(frozen=True)
class Event:
    """One thing that happened. A subclass is a frozen dataclass without a decorator of its own."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True)(cls)


Observer = Callable[[Event], None]


def ignore_event(event: Event) -> None:
    """Do nothing: the observer of a sequence that no program observes."""


def notify_all(*observers: Observer) -> Observer:
    """One observer that passes every event on to `observers`, in this order."""

    def notify(event: Event) -> None:
        for observer in observers:
            observer(event)

    return notify


class HammerStarted(Event):
    """Roving-hammer set `set_number` begins: blows of about `peak_force` N."""

    set_number: int
    peak_force: Annotated[float, quantity("N")]


class RateCoerced(Event):
    """The instrument cannot sample at `requested` Hz; it samples at `used` Hz, and every computation uses that."""

    requested: Annotated[float, quantity("Hz")]
    used: Annotated[float, quantity("Hz")]


class RunStarted(Event):
    """Everything that is measured from now on goes into run `run_id`."""

    run_id: int


class RunContinued(Event):
    """Run `run_id` goes on where it ended before; `blows` accepted blows and `sine_points` are stored already."""

    run_id: int
    blows: int
    sine_points: int


class PromptStarted(Event):
    """The operator is asked to do the task `text`; the sequence waits until it is done."""

    text: str


class WaitStarted(Event):
    """The sequence waits for `seconds`."""

    seconds: Annotated[float, quantity("s")]


class SoakStarted(Event):
    """The sequence waits until the temperature has stayed within `band_celsius` for `seconds`, `limit` s at most."""

    band_celsius: Annotated[float, quantity("K")]
    seconds: Annotated[float, quantity("s")]
    limit: Annotated[float, quantity("s")]


class SoakEnded(Event):
    """The temperature, now `celsius`, has stayed within the band; the soak took `waited` seconds."""

    celsius: Annotated[float, quantity("degC")]
    waited: Annotated[float, quantity("s")]


class PointStarted(Event):
    """The hammer session moved on to `point`, the `index`-th (from 1) of `points`."""

    point: Dof
    index: int
    points: int


class BlowAccepted(Event):
    """Blow `blow` at `point` counts; `accepted` of `wanted` are there."""

    point: Dof
    blow: int
    accepted: int
    wanted: int
    peak_force: Annotated[float, quantity("N")]


class BlowRefused(Event):
    """Blow `blow` at `point` does not count, for `reason`, a sentence to show; its `faults` are such as double hit."""

    point: Dof
    blow: int
    reason: str
    peak_force: Annotated[float, quantity("N")]
    faults: tuple[str, ...]


class BlowInconsistent(Event):
    """Blow `blow` at `point` was accepted, but is inconsistent with those after it, for `reason`; strike one more.

    It stays in the store as it was taken; averages leave it out.
    """

    point: Dof
    blow: int
    reason: str


class BlowMissed(Event):
    """Nobody struck `point` within `waited` seconds of blow `blow` being armed."""

    point: Dof
    blow: int
    waited: Annotated[float, quantity("s")]


class PointFinished(Event):
    """`point` has all its accepted blows; `refused` more were struck and refused."""

    point: Dof
    accepted: int
    refused: int


class SpecimenMounted(Event):
    """The cylinders of joint `specimen` are in the tester, in `configuration`."""

    specimen: str
    configuration: str


class SinePointMeasured(Event):
    """One steady sine point is recorded, the `index`-th (from 1) of `points`.

    k and gamma are its own, before any correction of the tester; None where the record is no sine.
    """

    specimen: str
    configuration: str
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak, as asked for")]
    frequency: Annotated[float, quantity("Hz")]
    index: int
    points: int
    reached_pp_mm: Annotated[float, quantity("mm", "peak to peak, as recorded")]
    stiffness: Annotated[float | None, quantity("N/m", "k")]
    loss_factor: Annotated[float | None, quantity("1", "gamma")]


class SinePointRefused(Event):
    """One sine point could not be measured as asked, for `reason`, a sentence to show."""

    specimen: str
    configuration: str
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak, as asked for")]
    frequency: Annotated[float, quantity("Hz")]
    reason: str


class MotionSeen(Event):
    """A machine that is not driven from here moves so; `verdict` says what becomes of it. All 0: no sine is seen."""

    frequency: Annotated[float, quantity("Hz")]
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak")]
    verdict: str


class ExaminationStep(Event):
    """An examination of the rig has come to `subject`, a channel or instrument."""

    subject: str


class InterlockTripped(Event):
    """Interlocks of the tester fired, named as on its panel; `stopped` says whether that stopped the actuator.

    Without interlocks: it has tripped, and does not name the cause.
    """

    interlocks: Interlock
    stopped: bool


class InterlockReset(Event):
    """These interlocks of the tester were reset, after their cause was removed."""

    interlocks: Interlock


class TesterLineLost(Event):
    """The tester does not answer any more; its watchdog stops it within `stops_within` s (null: it has none)."""

    stops_within: Annotated[float | None, quantity("s")]


class ActuatorShutDown(Event):
    """The driven actuator was shut down for `reason` and is at rest; the run ends when its present wait is over."""

    reason: str


class RestUnknown(Event):
    """A stop of the driven actuator was not confirmed, for `reason`; a run that is carried out ends. It may move."""

    reason: str


class RestSeen(Event):
    """The driven actuator was seen at rest."""


class RunPaused(Event):
    """The run pauses as asked: nothing is armed, and an actuator that it drives is at rest.

    It is held at its preset where there is `pressure`; null where the run does not drive the tester at present.
    """

    pressure: bool | None


class RunResumed(Event):
    """The run goes on after `paused` seconds, with the point that it was at."""

    paused: Annotated[float, quantity("s")]
