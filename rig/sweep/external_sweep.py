"""A sweep on a machine that its own software drives: each point of the plan is recognised from displacement and force.

The operator is told the points of a mounting; that software runs them in any order. Short looks at the displacement go
on until each is stored. A look that shows a planned point is followed by the record of that point, which is judged
by itself: the machine may have gone on meanwhile. An event reports what is seen and not stored, with the reason.

Nothing here moves or stops the machine, and nothing is known of it but what both channels show.
"""

import math
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import partial

from daq.block import Block
from daq.instrument import OnDemand
from rig.control import RunControl
from rig.errors import RigError
from rig.events import MotionSeen, Observer, SinePointRefused, SpecimenMounted
from rig.operator import Operator, mounting_text, points_text
from rig.sequences.sequence import DISPLACEMENT
from rig.sequences.sweep_plan import MountedSines, Sine, SweepPlan
from rig.sweep.driven_sweep import SinePoint, SineSink, point_of, report
from rig.sweep.recognition import NotAPointError, check_channels, check_settled, motion_in, planned_as
from rig.tester.displacement_witness import LOOK, oscillation_pp
from rig.tester.rest_judge import REST_PP
from rig.thermometer import Thermometer
from store.states import BLANK

SHORTEST_LOOK, LOOK_CYCLES = 0.3, 6.0
"""Shortest time of a look in s, and its length in cycles of the slowest point that is left; the longer one applies."""
LEAST_MOTION = 0.5
"""Share of the smallest amplitude of the plan; a smaller motion counts as rest."""
REPORT_INTERVAL = 1.0  # s between two events that differ only in their figures


def run_external_sweep(
    plan: SweepPlan,
    recorder: OnDemand,
    thermometer: Thermometer,
    operator: Operator,
    sink: SineSink,
    observer: Observer,
    control: RunControl,
    completed: Collection[int] = (),
    patience: float = math.inf,
) -> tuple[str, ...]:
    """Store every point of `plan` that the machine runs, whose order number is not in `completed`, once.

    Where no new point came for `patience` s, the operator may end this mounting without the points that are missing.
    Returns one text for each mounting that was ended in this way; it names the missing points.

    Raises:
        RunStoppedError: `control` asked for it; earlier points are in the sink.
        RigError, DaqError: an instrument failed, or the displacement is recorded without its mean.
    """
    if recorder.is_dc_coupled(DISPLACEMENT) is False:
        raise RigError(
            "the input of the displacement is AC coupled, so the preset cannot be measured; set it to DC coupling"
        )
    watch = _Watch(plan, recorder, thermometer, operator, sink, observer, control, patience)
    left_out = list[str]()
    for mounting in plan.mountings():
        left = {sine.order_number: sine for sine in mounting.sines if sine.order_number not in completed}
        if left:
            watch.measure(mounting, left)
        if left:
            points = points_text(plan.preset, [(sine.amplitude_pp, sine.frequency) for sine in left.values()])
            what = mounting_text(mounting.specimen, mounting.configuration)
            left_out.append(f"{len(left)} of {len(mounting.sines)} sine points with {what}, {points}")
    return tuple(left_out)


@dataclass
class _Watch:
    """Looks at the machine, again and again, for the points of one mounting."""

    plan: SweepPlan
    recorder: OnDemand
    thermometer: Thermometer
    operator: Operator
    sink: SineSink
    observer: Observer
    control: RunControl
    patience: float
    _verdict: str = ""  # of the last look
    _reported: tuple[MotionSeen, float] = (MotionSeen(0.0, 0.0, ""), 0.0)  # the last event, and when it was reported
    _refused: set[tuple[int, str]] = field(default_factory=set)  # order numbers and reasons that were reported

    def measure(self, mounting: MountedSines, left: dict[int, Sine]) -> None:
        """Ask the operator for `mounting`, then store the points in `left`, by order number, and remove them from it.

        Points that are in `left` afterwards were left out by the operator.
        """
        self.await_rest()
        self.operator.mount(mounting.specimen, mounting.configuration)
        self.observer(SpecimenMounted(mounting.specimen, mounting.configuration))
        self.operator.run_points(self.plan.preset, _points(left))
        is_accepted: Callable[[], bool] | None = None  # the offer to end the mounting
        since = time.monotonic()
        while left and not (is_accepted is not None and is_accepted()):
            point = self.control.carry_out(partial(self.look, mounting, left), self.observer)
            if point is not None:
                self.sink.add_sine(point)
                del left[point.order_number]
                report(self.observer, point, self.plan)
                since = time.monotonic()
                if is_accepted is not None and left:  # it is taken back
                    is_accepted = None
                    self.operator.run_points(self.plan.preset, _points(left))
            elif is_accepted is None and time.monotonic() - since > self.patience:
                is_accepted = self.operator.offer(
                    f"no new point came for {self.patience:g} s, and the search goes on; missing: "
                    f"{points_text(self.plan.preset, _points(left))}. Confirm to end this mounting without them"
                )
        self.operator.run_points(self.plan.preset, ())
        for sine in left.values():
            self.refuse(mounting, sine, "the operator has ended the mounting without it")

    def await_rest(self) -> None:
        """Ask the operator for rest while the displacement channel shows motion; ask once if it is overloaded."""
        usable = True
        while usable:
            block = self.control.carry_out(partial(self.record, LOOK), self.observer)
            motion_pp, usable = oscillation_pp(block.value(DISPLACEMENT)), DISPLACEMENT not in block.overloaded
            if usable and motion_pp <= REST_PP:
                return
            seen = f"moves by {1e3 * motion_pp:.2g} mm peak to peak" if usable else "is at an end of its range"
            self.operator.do_task(f"the displacement channel {seen}: bring the machine to rest by its own controls")

    def look(self, mounting: MountedSines, left: dict[int, Sine]) -> SinePoint | None:
        """Look once, and record the point that is seen; None where no point is seen that is to be stored."""
        least_pp = LEAST_MOTION * min(self.plan.amplitudes_pp)
        slowest = min(sine.driven_frequency for sine in left.values())
        sines = [*left.values(), *mounting.sines]  # the same sine may be planned twice: one that is left comes first
        seen = 0.0, 0.0
        try:
            fit = motion_in(self.record(max(SHORTEST_LOOK, LOOK_CYCLES / slowest)), least_pp)
            seen = fit.frequency, 1e3 * float(fit.amplitude_pp[0])
            sine = planned_as(fit, sines)
            if sine is None or sine.order_number not in left:
                raise NotAPointError("not in the plan" if sine is None else "stored already")
            tolerance = self.plan.tolerance_at(sine.amplitude_pp)
            scatter = float(fit.amplitude_scatter[0]) * math.sqrt(fit.cycles_per_block)
            block = self.record(self.plan.record_duration(sine.driven_frequency, scatter, tolerance))
            fit = motion_in(block, least_pp)
            if planned_as(fit, sines) is not sine:
                raise NotAPointError("it has gone on before it was recorded")
            check_settled(fit, tolerance)
        except NotAPointError as error:
            self.tell(*seen, str(error))
            return None
        try:
            check_channels(block, fit, self.plan.preset, is_specimen=mounting.configuration != BLANK)
        except NotAPointError as error:
            self.refuse(mounting, sine, str(error))
            return None
        reached_pp = float(fit.amplitude_pp[0])
        celsius = self.thermometer.celsius()
        return point_of(self.plan, mounting, sine, sine.amplitude_pp, reached_pp, celsius, block)

    def record(self, duration: float) -> Block:
        """The next `duration` s; AcquisitionCancelledError where the run is to pause or to end."""
        return self.recorder.record(duration, cancelled=self.control.is_interrupted)

    def tell(self, frequency: float, amplitude_mm: float, verdict: str) -> None:
        """Report what two looks in a row agree on: a new verdict, or new figures after `REPORT_INTERVAL` s."""
        sight = MotionSeen(float(f"{frequency:.4g}"), float(f"{amplitude_mm:.2g}"), verdict)
        told, since = self._reported
        changes = verdict != told.verdict or (sight != told and time.monotonic() - since > REPORT_INTERVAL)
        if verdict == self._verdict and changes:
            self._reported = sight, time.monotonic()
            self.observer(sight)
        self._verdict = verdict

    def refuse(self, mounting: MountedSines, sine: Sine, reason: str) -> None:
        """Report once why a planned point is not stored."""
        if (sine.order_number, reason) not in self._refused:
            self._refused.add((sine.order_number, reason))
            what = (mounting.specimen, mounting.configuration, 1e3 * sine.amplitude_pp, sine.frequency)
            self.observer(SinePointRefused(*what, reason))


def _points(left: dict[int, Sine]) -> tuple[tuple[float, float], ...]:
    return tuple((sine.amplitude_pp, sine.driven_frequency) for sine in left.values())
