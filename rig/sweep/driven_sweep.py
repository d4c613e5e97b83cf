"""The swept sine of the direct method: dynamic stiffness records over frequency, amplitude and configuration.

For each specimen and configuration: hydraulics off, the operator mounts, hydraulics on, preset; then for each amplitude
and frequency the tester is brought to the amplitude, one record of displacement and force is taken on one clock, and
passed to a sink with both amplitudes and the temperature. A sweep can be paused, resumed and stopped.
From hydraulics on to hydraulics off the tester is monitored, also while a record is taken or stored. While the operator
mounts, it is polled, and hydraulics have to be off. Where it reports rest, the displacement channel has to agree.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from analysis.direct.dynamic_stiffness import SMALLEST_SIGNAL, dynamic_stiffness
from analysis.direct.sine import SineFit, fit_sine
from analysis.errors import AnalysisError
from daq.block import Block
from daq.errors import AcquisitionCancelledError
from daq.instrument import OnDemand
from rig.control import RunControl
from rig.errors import RigError
from rig.events import Observer, SinePointMeasured, SinePointRefused, SpecimenMounted, ignore_event
from rig.operator import Operator
from rig.sequences.sequence import DISPLACEMENT, FORCE
from rig.sequences.sweep_plan import MountedSines, Sine, SweepPlan
from rig.sweep.amplitude import AmplitudeControl, Reached
from rig.tester.detectors import tightened_detectors
from rig.tester.displacement_witness import DisplacementWitness
from rig.tester.driver import Tester
from rig.tester.monitor import kept_without_pressure, monitored
from rig.thermometer import Thermometer

_Recorded = TypeVar("_Recorded")

STORE_TIME = 10.0  # s that storing a point may take while the actuator cycles
DISK_SILENT = (
    f"a sine point was not stored within {STORE_TIME:g} s; check the space and the health of the disk that has the "
    "folder of the drive process, then resume the run"
)
RECORDS = 3  # of one point at most, before its amplitude is accepted as reached
HARMONICS = 3
SIGNALS = (DISPLACEMENT, FORCE)
OTHER_MOTION = 0.5
"""Share of the amplitude asked for: a record is refused where its motion at other frequencies is larger than this, and
larger than the motion at its own frequency."""


@dataclass(frozen=True, eq=False)
class SinePoint:
    """One sine point as it was measured; SI units.

    Attributes:
        order_number: in the run, from 1.
        specimen: the joint whose cylinders were in the tester, or the known piece.
        configuration: compression, shear or angled; blank for a known piece.
        amplitude_pp: peak-to-peak displacement asked for, m.
        frequency: planned frequency, Hz.
        driven_frequency: frequency at which the actuator moved, Hz; it differs near multiples of the mains.
        preset: mean displacement, m.
        commanded_pp: peak-to-peak amplitude that was commanded, m; `amplitude_pp` where the command is not known.
        reached_pp: first harmonic of the recorded displacement, peak to peak, m.
        within_tolerance: whether `reached_pp` is `amplitude_pp` within the tolerance of the plan.
        temperature_celsius: of the room, when the record was taken.
        block: the record, channels ``displacement`` and ``force`` on one clock.
    """

    order_number: int
    specimen: str
    configuration: str
    amplitude_pp: float
    frequency: float
    driven_frequency: float
    preset: float
    commanded_pp: float
    reached_pp: float
    within_tolerance: bool
    temperature_celsius: float
    block: Block


class SineSink(Protocol):
    """Destination of sine points; gets each as soon as it is measured."""

    def add_sine(self, point: SinePoint) -> None:
        """Store `point`; when this returns, it is stored."""


def run_sweep(
    plan: SweepPlan,
    tester: Tester,
    recorder: OnDemand,
    thermometer: Thermometer,
    operator: Operator,
    sink: SineSink,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
    completed: Collection[int] = (),
) -> None:
    """Measure every point of `plan`; afterwards the actuator is at rest and hydraulics are off, whatever happens.

    A point whose amplitude cannot be reached is recorded with the amplitude reached, and reported. Points whose order
    numbers are in `completed` are left out, and a specimen without any other point is not mounted.

    Raises:
        LimitExceededError: the plan is beyond the rig's limits; nothing moved.
        DetectorError: a detector of the plan is looser than that in force at the tester; nothing moved.
        RunStoppedError: `control` asked for it; earlier points are in the sink.
        ActuatorNotAtRestError, StopDisobeyedError: a stop that anybody asked for ended in the emergency stop.
        RigError, DaqError: an instrument failed; earlier points are in the sink.
    """
    plan.check(tester.limits)
    control = control or RunControl()
    witness = DisplacementWitness(recorder)
    sweep = _Sweep(plan, tester, witness, thermometer, control, observer)
    with (
        tester.obeying_stops(),
        tightened_detectors(tester, plan.detectors),
        tester.witnessed_by(witness.motion_pp),
        tester.at_rest_afterwards(),
        control.driving(tester),
    ):
        for mounting in plan.mountings():
            sines = [sine for sine in mounting.sines if sine.order_number not in completed]
            if sines:
                sweep.mount(mounting, operator)
                sweep.measure_and_store(mounting, sines, sink)


@dataclass(frozen=True)
class _Sweep:
    """The steps of a sweep; what begins, goes to the preset or measures may be interrupted and repeated."""

    plan: SweepPlan
    tester: Tester
    witness: DisplacementWitness
    thermometer: Thermometer
    control: RunControl
    observer: Observer

    def mount(self, mounting: MountedSines, operator: Operator) -> None:
        """Let the operator mount a specimen, without hydraulics."""
        self.tester.shut_down()  # the operator reaches into the machine
        with kept_without_pressure(self.tester, "the operator mounts"):
            operator.mount(mounting.specimen, mounting.configuration)
        self.observer(SpecimenMounted(mounting.specimen, mounting.configuration))

    def measure_and_store(self, mounting: MountedSines, sines: Sequence[Sine], sink: SineSink) -> None:
        """Measure `sines` of the mounted specimen, each of which is in `sink` before the next one is measured."""
        with monitored(self.tester) as monitor:
            self.control.carry_out(self.begin, self.observer)
            amplitudes = AmplitudeControl(self.tester)
            for sine in sines:
                point = self.point(mounting, sine, amplitudes)
                with monitor.within(STORE_TIME, DISK_SILENT):
                    sink.add_sine(point)
                report(self.observer, point, self.plan)

    def begin(self) -> None:
        """Switch hydraulics on, and go to the preset."""
        self.tester.start()
        self.go_to_preset()
        self.undisturbed(self.witness.learn)

    def go_to_preset(self) -> None:
        """Go to the preset, from any state in which an interruption left the actuator."""
        self.tester.preset(self.plan.preset)

    def point(self, mounting: MountedSines, sine: Sine, amplitudes: AmplitudeControl) -> SinePoint:
        """Measure one point; repeat it where a pause interrupts it."""
        measure = partial(self.measure, amplitudes, sine.amplitude_pp, sine.driven_frequency)
        reached, reached_pp, block = self.control.carry_out(measure, self.observer, self.go_to_preset)
        celsius = self.thermometer.celsius()
        return point_of(self.plan, mounting, sine, reached.commanded_pp, reached_pp, celsius, block)

    def measure(
        self, amplitudes: AmplitudeControl, amplitude_pp: float, frequency: float
    ) -> tuple[Reached, float, Block]:
        """Approach the amplitude and record; repeat both if the record shows another amplitude than the tester.

        A signal without a sine raises RigError before anything is corrected by it.
        """
        tolerance = self.plan.tolerance_at(amplitude_pp)
        for _ in range(RECORDS):
            reached = amplitudes.approach(amplitude_pp, frequency, tolerance)
            duration = self.plan.record_duration(frequency, reached.scatter, tolerance)
            block = self.undisturbed(partial(self.witness.record, duration))
            fit = _fit(block, amplitude_pp, frequency)
            reached_pp = float(fit.amplitude_pp[0])
            if _is_reached(self.plan, amplitude_pp, reached_pp):
                break
            amplitudes.correct(amplitude_pp, frequency, reached_pp / reached.commanded_pp)
        _check_motion(fit, amplitude_pp, frequency)
        return reached, reached_pp, block

    def undisturbed(self, record: Callable[[Callable[[], bool]], _Recorded]) -> _Recorded:
        """The result of `record`, which asks `is_cancelled` whether to end; raises an error if something interferes."""
        try:
            recorded = record(self.is_cancelled)
        except AcquisitionCancelledError:
            self.tester.measured()  # raises the reason, where it was the tester
            raise
        self.tester.measured()
        return recorded

    def is_cancelled(self) -> bool:
        """Whether the record is to end early."""
        return self.control.is_interrupted() or self.tester.failure is not None


def uncorrected(
    displacement: ArrayLike, force: ArrayLike, sample_rate: float, frequency: float
) -> tuple[float, float] | None:
    """k in N/m and gamma of one record, before any correction of the tester; None where the record is no sine.

    The frequency is taken as commanded, as it is for the amplitude: refining it takes longer than everything else, and
    changes k and gamma by less than their errors.

    Args:
        displacement: (samples,) in m.
        force: (samples,) in N.
        sample_rate: in Hz.
        frequency: as commanded, in Hz.
    """
    try:
        found = dynamic_stiffness(displacement, force, sample_rate, frequency, harmonics=HARMONICS, refine=False)
    except AnalysisError:
        return None
    return found.stiffness, found.loss_factor


def _fit(block: Block, amplitude_pp: float, frequency: float) -> SineFit:
    """The sine of both signals. Raises RigError where one of them has none, such as that of a dead channel."""
    signals = np.stack([block.value(name) for name in SIGNALS])
    try:
        fit = fit_sine(signals, block.sample_rate, frequency, harmonics=HARMONICS, refine=False, names=SIGNALS)
    except AnalysisError as error:
        raise RigError(f"{error} The point was not stored") from error
    lost = np.abs(fit.first) < SMALLEST_SIGNAL * fit.residual_standard_error
    if lost.any():
        _check_motion(fit, amplitude_pp, frequency)
        name = SIGNALS[int(np.argmax(lost))]
        raise RigError(
            f"the {name} has no sine at {frequency:g} Hz, or one that is lost in noise: look at its channel, sensor "
            "and cable. The point was not stored"
        )
    return fit


def _check_motion(fit: SineFit, amplitude_pp: float, frequency: float) -> None:
    """Check that the record moves at its own frequency. Raises RigError where it moves more at others."""
    own_pp, other_pp = float(fit.amplitude_pp[0]), float(fit.other_pp[0])
    if other_pp > max(own_pp, OTHER_MOTION * amplitude_pp):
        raise RigError(
            f"most of the motion is not at {frequency:g} Hz: {1e3 * own_pp:.3g} mm peak to peak there, "
            f"{1e3 * other_pp:.3g} mm at other frequencies. The point was not stored; check whether the tester follows "
            "its commands and whether the displacement channel is disturbed"
        )


def point_of(
    plan: SweepPlan,
    mounting: MountedSines,
    sine: Sine,
    commanded_pp: float,
    reached_pp: float,
    celsius: float,
    block: Block,
) -> SinePoint:
    """The point `sine` of `plan` as it was measured; see `SinePoint`."""
    return SinePoint(
        sine.order_number,
        mounting.specimen,
        mounting.configuration,
        sine.amplitude_pp,
        sine.frequency,
        sine.driven_frequency,
        plan.preset,
        commanded_pp,
        reached_pp,
        _is_reached(plan, sine.amplitude_pp, reached_pp),
        celsius,
        block,
    )


def _is_reached(plan: SweepPlan, amplitude_pp: float, reached_pp: float) -> bool:
    return abs(reached_pp / amplitude_pp - 1) <= plan.tolerance_at(amplitude_pp)


def report(observer: Observer, point: SinePoint, plan: SweepPlan) -> None:
    """Report a stored point to `observer`, with k and gamma before any correction."""
    what = (point.specimen, point.configuration, 1e3 * point.amplitude_pp, point.frequency)
    if not point.within_tolerance:
        reason = f"{1e3 * point.reached_pp:.4g} mm were reached of {1e3 * point.amplitude_pp:g} mm; recorded as reached"
        observer(SinePointRefused(*what, reason))
    block, number = point.block, point.order_number - plan.first_number + 1
    found = uncorrected(block.value("displacement"), block.value("force"), block.sample_rate, point.driven_frequency)
    stiffness, loss_factor = (None, None) if found is None else found
    observer(SinePointMeasured(*what, number, plan.points, 1e3 * point.reached_pp, stiffness, loss_factor))
