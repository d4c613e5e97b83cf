"""Texts of the page: quantities with their units, interlocks, durations and times."""

from collections.abc import Mapping
from datetime import UTC, date, datetime, timedelta

from jointlab import durations
from jointlab.drive.state import RigState
from jointlab.quantities import TAKING_A_PREFIX, prefix_of
from jointlab.report.section import THIN, number
from jointlab.supervision.run_progress import is_cut_off
from rig.registers import Interlock
from store.measurements.runs import Run
from store.service.jobs import Job

INTERLOCKS = {
    Interlock.UPPER_DISPLACEMENT: "The actuator went above its displacement limit.",
    Interlock.LOWER_DISPLACEMENT: "The actuator went below its displacement limit.",
    Interlock.FORCE: "The force limit was exceeded.",
    Interlock.ERROR: "The actuator overshot the command (error limit).",
    Interlock.UNDERPEAK: "The amplitude stayed below the command.",
    Interlock.WATCHDOG: "The tester heard nothing from the program for too long.",
    Interlock.EMERGENCY_STOP: "The emergency stop has tripped: somebody pressed it, or the program tripped it.",
}
UNNAMED_TRIP = "The tester has tripped and does not name the cause. Look at its own display."
UNKNOWN = (
    "The drive process does not answer: what the machine does is not known. Keep away from it, and press the red "
    "button."
)
DUE = timedelta(days=365)
SMALL_ACCELERATION = 0.1  # m/s^2
UNITS = {"degC": "°C", "m/s^2": "m/s²", "V/(m/s^2)": "V/(m/s²)", "C/(m/s^2)": "C/(m/s²)"}
WHOLE_LIST = 10_000
"""Rows of a list that is shown whole: keys, instruments, sequences, specimens; a laboratory has fewer."""


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """A number with its unit, such as 1 234 Hz; a dash where it is not known."""
    if value is None or value != value:
        return "–"
    return f"{number(value, digits)}{THIN}{unit}" if unit else number(value, digits)


def scaled(value: float | None, unit: str, digits: int = 3) -> str:
    """A number with its unit, and the prefix that suits its size: 1.23 MN/m."""
    if value is None or value != value:
        return "–"
    scale, prefix = prefix_of(value)
    return quantity(value / scale, f"{prefix}{unit}", digits)


def in_unit(value: float | None, unit: str) -> str:
    """A number in the SI unit of a channel or check, with the prefix that suits its size where it takes one.

    A small acceleration takes one, a large one does not: nobody reads km/s².
    """
    takes_prefix = unit in TAKING_A_PREFIX or (
        unit == "m/s^2" and value is not None and abs(value) < SMALL_ACCELERATION
    )
    return (scaled if takes_prefix else quantity)(value, UNITS.get(unit, unit))


def accepted_text(counts: Mapping[str, tuple[int, int]]) -> str:
    """How many of the blows that are wanted were accepted; more than wanted at one point replace none at another.

    Args:
        counts: for each point, accepted blows and how many are wanted.
    """
    counted = sum(min(done, required) for done, required in counts.values())
    more = sum(max(done - required, 0) for done, required in counts.values())
    wanted = sum(required for _, required in counts.values())
    return f"{counted} of {wanted} blows accepted{f', and {more} more' if more else ''}"


def due(calibrated_on: date | None, due_on: date | None) -> str:
    """The date of a calibration, and whether it is over: at its day, or after a year where it has none."""
    if calibrated_on is None:
        return "–"
    if due_on is not None and date.today() > due_on:
        return f"{calibrated_on} – was valid until {due_on}, calibrate it"
    late = due_on is None and date.today() - calibrated_on > DUE
    return f"{calibrated_on} – more than a year ago, calibrate it" if late else str(calibrated_on)


def duration(seconds: float) -> str:
    """A length of time in the unit that suits its size."""
    return durations.duration(seconds, THIN)


def moment(at: datetime | None) -> str:
    """A UTC time by the clock of this computer."""
    return "–" if at is None else f"{at.replace(tzinfo=at.tzinfo or UTC).astimezone():%Y-%m-%d %H:%M:%S}"


def run_state(run: Run, rig: RigState | None, name: str | None) -> str:
    """The state of a run; `rig` and `name` are those of this service's rig, None where it drives none."""
    return "cut off" if is_cut_off(run, rig, name) else run.state.value


def trip_sentences(state: RigState) -> tuple[str, ...]:
    """What has stopped the tester and was not reset, a sentence each; none where nothing has."""
    named = tuple(INTERLOCKS[each] for each in state.interlocks)
    return named if named or not state.is_tripped else (UNNAMED_TRIP,)


def tripped_text(names: str) -> str:
    """A tripped tester in a few words; `names` of interlocks are empty where it names none."""
    return f"tripped: {names or 'it does not name why'}"


def job_progress(job: Job) -> str:
    """How far a job is, and what its worker has found so far."""
    return f"{job.stage}, {job.done} of {job.total}" + (f"; {job.now}" if job.now else "")
