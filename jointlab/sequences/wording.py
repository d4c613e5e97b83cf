"""The steps of a sequence in words; terminal and page say the same."""

from collections.abc import Iterable

from analysis.frequency_response import FEWEST_FOR_SCATTER
from jointlab.durations import duration
from rig.operator import SUSPENDED
from rig.registers import Interlock, name_of
from rig.sequences.sequence import BlankStep, HammerStep, PromptStep, SineStep, SoakStep, Step, SweepStep
from rig.sequences.steps import sweep_plan
from rig.sequences.sweep_plan import Order, SweepPlan
from rig.tester.detectors import StepDetectors

SECONDS_A_BLOW = 6.0  # to strike, to ring out, to step to the next
FEW_BLOWS = (
    f"with fewer than {FEWEST_FOR_SCATTER} at a point it is not known what blows have in common, and good joints may "
    "be refused"
)
MOST_MOVED = 8  # points that a line names


def step_text(step: Step) -> str:
    """What a step does and about how long it takes, in a line."""
    match step:
        case HammerStep():
            return _hammer_line(step)
        case SweepStep():
            return _sweep_line(step)
        case BlankStep():
            return _blank_line(step)
        case PromptStep():
            return f"by hand: {step.text}"
        case SoakStep():
            about = "" if step.celsius is None else f" about {step.celsius:g} C"
            band = f"{step.seconds:g} s within {step.band_celsius:g} K{about}"
            return f"soak: {band}, at most {step.limit_seconds:g} s"
        case _:
            return f"wait: {step.seconds:g} s"


def step_seconds(step: Step) -> float:
    """How long a step takes at least, s: blows at a usual pace, records alone, a soak that settles at once."""
    match step:
        case HammerStep():
            return len(step.points) * step.blows * SECONDS_A_BLOW
        case SweepStep() | BlankStep():
            plan = sweep_plan(step)
            series = sum(plan.record_duration(frequency, 0.0, 1.0) for _, frequency in plan.sines())
            return series * len(plan.specimens) * len(plan.configurations)
        case PromptStep():
            return 0.0
        case _:
            return step.seconds


def total_text(steps: Iterable[Step]) -> str:
    """How long the steps take together, and what comes on top of that, in a line."""
    least = duration(sum(map(step_seconds, steps)))
    return f"altogether at least {least}; settling, mounting, prompts and soaks that last longer come on top"


def _records_text(step: SineStep) -> str:
    return f"(records alone {duration(step_seconds(step))})"


def _hammer_line(step: HammerStep) -> str:
    blows = len(step.points) * step.blows
    where = " on the suspended beam" if step.beam == SUSPENDED else ""
    few = "" if step.blows >= FEWEST_FOR_SCATTER else f"; {FEW_BLOWS}"
    return (
        f"hammer{where}: {step.blows} blows at each of {', '.join(step.points)} "
        f"({blows} blows of about {step.peak_force:g} N, about {duration(step_seconds(step))}){few}"
    )


def _sweep_line(step: SweepStep) -> str:
    plan = sweep_plan(step)
    amplitudes = ", ".join(f"{amplitude:g}" for amplitude in step.amplitudes_pp_mm)
    order = "in sequence"
    if step.order is not Order.SEQUENTIAL:
        order = f"shuffled: {step.order}, seed {'drawn at the start' if step.seed is None else step.seed}"
    return (
        f"sweep: {plan.points} sine points, {step.frequencies.first:g} to {step.frequencies.last:g} Hz, "
        f"{amplitudes} mm p-p, preset {step.preset_mm:g} mm, "
        f"{', '.join(step.configurations)} of {', '.join(step.specimens)}, {order} "
        f"{_records_text(step)}{_beside_text(plan)}{_detector_text(step.detectors)}"
    )


def _blank_line(step: BlankStep) -> str:
    stiffness = "rigid" if step.stiffness is None else f"{step.stiffness:g} N/m"
    return (
        f"blank: {step.points} sine points on {step.piece!r} ({stiffness}, {step.mass:g} kg), "
        f"{step.frequencies.first:g} to {step.frequencies.last:g} Hz, {step.amplitude_pp_mm:g} mm p-p "
        f"{_records_text(step)}{_beside_text(sweep_plan(step))}{_detector_text(step.detectors)}"
    )


def _beside_text(plan: SweepPlan) -> str:
    """Points that are measured beside multiples of the mains, as the end of a line."""
    moved = [(each, plan.driven_frequency(each)) for each in plan.frequencies]
    moved = [(planned, driven) for planned, driven in moved if driven != planned]
    if not moved:
        return ""
    pairs = ", ".join(f"{planned:g} Hz at {driven:.4g}" for planned, driven in moved[:MOST_MOVED])
    rest = "" if len(moved) <= MOST_MOVED else f" and {len(moved) - MOST_MOVED} more"
    return f"; beside the mains: {pairs}{rest}"


def _detector_text(detectors: StepDetectors | None) -> str:
    """Detectors that are tighter while a step lasts, as the end of its line."""
    if detectors is None:
        return ""
    limits = [
        f"{name_of(interlock).replace('_', ' ')} {_limit_text(interlock, detector.limit)}"
        + ("" if detector.action is None else f" ({detector.action.name.lower().replace('_', ' ')})")
        for interlock, detector in detectors.in_si().items()
    ]
    return f"; tighter detectors: {', '.join(limits)}" if limits else ""


def _limit_text(interlock: Interlock, limit: float) -> str:
    if interlock is Interlock.FORCE:
        return f"{limit:g} N"
    return f"{100 * limit:g} %" if interlock is Interlock.UNDERPEAK else f"{1e3 * limit:g} mm"
