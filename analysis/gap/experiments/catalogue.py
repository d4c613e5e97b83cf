"""The experiments that may be asked for: checks by an instrument, and further measurements that can be simulated.

What each explanation expects of an experiment follows from its own fit and the simulation, and so does the information
in it: `expected_data` and `information` beside this file. A check that the simulation does not contain, such as a
ruler, reads parameters with the accuracy of its instrument.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.verdict import UNKNOWN, Weighed
from analysis.gap.experiments.expected_data import (
    Reading,
    expected_data,
    expected_readings,
    readable_names,
    relevant_readings,
)
from analysis.gap.experiments.information import expected_information, log_posterior
from analysis.gap.fitting.model import Model
from analysis.gap.measurement import Measurement, Rig

LINES, POINTS = 40, 150
"""Lines of a simulated hammer set, and points of the tester."""
SAME = 1.01
"""Ratio up to which two amplitudes count as equal."""
FURTHER_MASS = 0.02
"""kg, about what an accelerometer weighs."""
REFUTED = 10.0
"""Misfit beyond that of the verdict, per pattern of an inexact law, from which an explanation cannot be right."""


class Experiment(StrEnum):
    """What to measure next; the value is its id in documents."""

    NOTHING = "nothing"
    """Simulation and measurement agree."""
    NEW_SET_UP = "new_set_up"
    """Nothing explains the gap: measure again after a new set-up, and see what moves with it."""
    CORRECT_EFFECTS = "correct_effects"
    """No experiment tells the verdict from another explanation: correct its effects and measure again."""
    READ_THERMOMETERS = "read_thermometers"
    MEASURE_PLACES = "measure_places"
    WEIGH_PARTS = "weigh_parts"
    MEASURE_CYLINDERS = "measure_cylinders"
    STRIKE_KNOWN_MASS = "strike_known_mass"
    BLANK_TEST = "blank_test"
    MASS_IN_TESTER = "mass_in_tester"
    HALF_FORCE = "half_force"
    HEAVIER_ACCELEROMETER = "heavier_accelerometer"
    ACCELEROMETER_LEFT = "accelerometer_left"
    ACCELEROMETER_MIDDLE = "accelerometer_middle"
    ACCELEROMETER_RIGHT = "accelerometer_right"
    LONG_RECORDS = "long_records"
    RANDOM_ORDER = "random_order"
    HALF_AMPLITUDE = "half_amplitude"
    ANOTHER_PRESET = "another_preset"
    TURN_ACCELEROMETER = "turn_accelerometer"
    OUT_OF_PLANE = "out_of_plane"
    GUIDED_HAMMER = "guided_hammer"
    FREE_BEAM = "free_beam"
    AT_FOUNDATION = "at_foundation"
    OTHER_LEVELS = "other_levels"
    HIGHER_FREQUENCY = "higher_frequency"


@dataclass(frozen=True)
class RigTime:
    """Durations of work on the rig, s.

    Attributes:
        point: all blows at one point.
        sine: one sine point, with settling.
        change: a change of the set-up by the operator.
    """

    point: float = 60.0
    sine: float = 5.0
    change: float = 300.0

    def minutes(self, further: Measurement, rigs: Sequence[Rig]) -> float:
        """Rig time of a further measurement, minutes."""
        rows = sum(len(each.inputs) for each in further.sets) if Rig.BEAM in rigs else 0
        sines = further.points.order.size if further.points is not None and Rig.TESTER in rigs else 0
        return (self.change + rows * self.point + sines * self.sine) / 60


PAPER_TIME = RigTime()
"""Rig time of about the paper's steps."""


@dataclass(frozen=True)
class SizeCheck:
    """An instrument that reads the size of effects.

    Attributes:
        id: the experiment.
        minutes: that it takes.
        readings: of the instrument.
    """

    id: Experiment
    minutes: float
    readings: tuple[Reading, ...]

    def asked(
        self, weighed: Sequence[Weighed[Model]], none: Model | None, time: RigTime, calibration: Calibration
    ) -> tuple[float, float]:
        """Expected information in bits, and minutes; 0 bits where no explanation has an effect that it reads."""
        del none, time
        read = readable_names(weighed, self.readings)
        return (expected_information(expected_readings(weighed, read, calibration)) if read else 0.0), self.minutes

    def after(
        self, weighed: Sequence[Weighed[Model]], read: Mapping[str, float], calibration: Calibration
    ) -> tuple[Weighed[Model], ...]:
        """Explanations after a reading, as of `after_readings`."""
        return _after(weighed, [(self.readings, read)], calibration)


@dataclass(frozen=True)
class FurtherMeasurement:
    """A further measurement of a kind that can be simulated.

    Attributes:
        id: the experiment.
        rigs: that measure.
        planned: gives the further measurement after a first one; None where it is impossible.
    """

    id: Experiment
    rigs: tuple[Rig, ...]
    planned: Callable[[Measurement], Measurement | None]

    def asked(
        self, weighed: Sequence[Weighed[Model]], none: Model | None, time: RigTime, calibration: Calibration
    ) -> tuple[float, float]:
        """Expected information in bits, and minutes; nothing where it is impossible."""
        further = self.planned(weighed[0].model.fit.likelihood.measurement.thinned(LINES))
        if further is None:
            return 0.0, 0.0
        expected = expected_data(_standing(weighed, calibration), none, _thinned(further), self.rigs, calibration)
        return expected_information(expected), time.minutes(further, self.rigs)


def _standing(weighed: Sequence[Weighed[Model]], calibration: Calibration) -> list[Weighed[Model]]:
    """Explanations that the first data do not refute; further data of this kind tell nothing new about the others."""
    verdict = weighed[0]
    most = verdict.model.misfit.certain + REFUTED * calibration.patterns
    kept = [each for each in weighed[1:] if each.effects == UNKNOWN or each.model.misfit.certain < most]
    return [replace(verdict, probability=1 - sum(each.probability for each in kept)), *kept]


def _thinned(further: Measurement) -> Measurement:
    """A measurement with at most `POINTS` points of the tester, chosen at random."""
    points = further.points
    if points is None or points.order.size <= POINTS:
        return further
    chosen = np.random.default_rng(0).permutation(points.order.size) < POINTS
    return replace(further, points=points.only(chosen))


# --- further measurements that can be simulated ---


def _at_half_the_force(first: Measurement) -> Measurement | None:
    """The set with the softest blows at half their force, where noise counts twice."""
    if not first.sets:
        return None
    softest = min(first.sets, key=lambda each: each.peak_force)
    softer = replace(softest, peak_force=softest.peak_force / 2, deviation=2 * softest.deviation)
    return replace(first, sets=(softer,))


def _heavier_accelerometer(first: Measurement) -> Measurement | None:
    if not first.sets:
        return None
    heavier = replace(first.drawing, accelerometer_mass=first.drawing.accelerometer_mass + FURTHER_MASS)
    return replace(first, drawing=heavier, sets=first.sets[:1])


def _accelerometer_at(place: float, first: Measurement) -> Measurement | None:
    """The accelerometer at the node nearest to a share of the length, except at joints and at its present node."""
    if not first.sets:
        return None
    drawing = first.drawing
    taken = {drawing.accelerometer.node, *(joint.node for joint in drawing.joints)}
    free = [node for node in range(1, drawing.node_positions.size + 1) if node not in taken]
    if not free:
        return None
    wanted = place * float(np.max(drawing.node_positions))
    node = min(free, key=lambda each: abs(float(drawing.node_positions[each - 1]) - wanted))
    return replace(first, drawing=replace(drawing, accelerometer=Dof(node, Direction.Y)), sets=first.sets[:1])


def _in_random_order(first: Measurement) -> Measurement | None:
    points = first.points
    if points is None:
        return None
    return replace(first, points=replace(points, order=np.random.default_rng(0).permutation(points.order)))


def _at_half_the_amplitude(first: Measurement) -> Measurement | None:
    """Points at half of the smallest amplitude, where noise of force is twice the noise of stiffness."""
    points = first.points
    if points is None:
        return None
    smallest = points.only(points.amplitude <= SAME * np.min(points.amplitude))
    halved = replace(smallest, amplitude=smallest.amplitude / 2, deviation=2 * smallest.deviation)
    return replace(first, points=halved)


def _at_other_levels(first: Measurement) -> Measurement | None:
    """A further hammer level twice as hard as the hardest, and the largest amplitude of the tester twice as large."""
    if not first.sets:
        return None
    hardest = max(first.sets, key=lambda each: each.peak_force)
    harder = replace(hardest, peak_force=2 * hardest.peak_force, deviation=hardest.deviation / 2)
    points = first.points
    if points is not None:
        largest = points.only(points.amplitude * SAME >= np.max(points.amplitude))
        points = replace(largest, amplitude=2 * largest.amplitude)
    return replace(first, sets=(harder,), points=points)


def _to_a_higher_frequency(first: Measurement) -> Measurement | None:
    """The upper half of the tester's points at frequencies that are twice as high."""
    points = first.points
    if points is None:
        return None
    upper = points.only(points.frequency >= np.median(points.frequency))
    return replace(first, points=replace(upper, frequency=2 * upper.frequency))


BY_HAND = 5.0
"""Minutes of a check by hand, the rig at rest."""
SET_UP = 20.0
"""Minutes of a check that needs a set-up of its own."""
BOTH = (Rig.BEAM, Rig.TESTER)

EXPERIMENTS: tuple[SizeCheck | FurtherMeasurement, ...] = (
    SizeCheck(Experiment.READ_THERMOMETERS, BY_HAND, (Reading("temperature_shift", "delta_t", 0.5),)),
    SizeCheck(
        Experiment.MEASURE_PLACES,
        BY_HAND,
        (Reading("support_position", "dx", 5e-4), Reading("impact_position", "shift", 5e-4)),
    ),
    SizeCheck(
        Experiment.WEIGH_PARTS,
        2 * BY_HAND,
        (
            Reading("accelerometer_mass", "m", 5e-4),
            Reading("joint_mass", "m", 2e-3),
            Reading("density", "relative", 1e-3),
        ),
    ),
    SizeCheck(
        Experiment.MEASURE_CYLINDERS,
        2 * BY_HAND,
        (
            Reading("cylinder_angle", "delta_deg", 0.3),
            Reading("vertical_offset", "shift", 3e-4),
            Reading("contact_patch", "length", 2e-3),
        ),
    ),
    SizeCheck(
        Experiment.STRIKE_KNOWN_MASS,
        2 * BY_HAND,
        (
            Reading("sensor_gain", "gain", 3e-3),
            Reading("channel_delay", "tau", 2e-6),
            Reading("highpass_corner", "corner", 0.1),
        ),
    ),
    SizeCheck(
        Experiment.BLANK_TEST,
        SET_UP,
        (
            Reading("frame_compliance", "c", 2e-9),
            Reading("frame_resonance", "f_r", 1e-4, reciprocal=True),
            Reading("fixture_inertia", "m", 5e-3),
        ),
    ),
    SizeCheck(
        Experiment.MASS_IN_TESTER,
        SET_UP,
        (Reading("transducer_lag", "tau", 1e-5), Reading("fixture_inertia", "m", 5e-3)),
    ),
    FurtherMeasurement(Experiment.HALF_FORCE, (Rig.BEAM,), _at_half_the_force),
    FurtherMeasurement(Experiment.HEAVIER_ACCELEROMETER, (Rig.BEAM,), _heavier_accelerometer),
    FurtherMeasurement(Experiment.ACCELEROMETER_LEFT, (Rig.BEAM,), partial(_accelerometer_at, 0.0)),
    FurtherMeasurement(Experiment.ACCELEROMETER_MIDDLE, (Rig.BEAM,), partial(_accelerometer_at, 0.5)),
    FurtherMeasurement(Experiment.ACCELEROMETER_RIGHT, (Rig.BEAM,), partial(_accelerometer_at, 1.0)),
    SizeCheck(Experiment.LONG_RECORDS, SET_UP, (Reading("exponential_window", "s", 0.3),)),
    FurtherMeasurement(Experiment.RANDOM_ORDER, (Rig.TESTER,), _in_random_order),
    FurtherMeasurement(Experiment.HALF_AMPLITUDE, (Rig.TESTER,), _at_half_the_amplitude),
    SizeCheck(Experiment.ANOTHER_PRESET, 3 * SET_UP, (Reading("preload_stiffening", "s", 0.03),)),
    SizeCheck(Experiment.TURN_ACCELEROMETER, SET_UP, (Reading("cross_axis_sensitivity", "sensitivity", 3e-3),)),
    SizeCheck(Experiment.OUT_OF_PLANE, SET_UP, (Reading("out_of_plane_bending", "coupling", 3e-3),)),
    SizeCheck(Experiment.GUIDED_HAMMER, SET_UP, (Reading("impact_angle", "angle_deg", 0.3),)),
    SizeCheck(
        Experiment.FREE_BEAM,
        2 * SET_UP,
        (
            Reading("youngs_modulus", "relative", 2e-3),
            Reading("beam_damping", "eta", 3e-4),
            Reading("mesh_error", "third_mode", 3e-4),
        ),
    ),
    SizeCheck(Experiment.AT_FOUNDATION, SET_UP, (Reading("foundation_compliance", "k_f", 5e-9, reciprocal=True),)),
    FurtherMeasurement(Experiment.OTHER_LEVELS, BOTH, _at_other_levels),
    FurtherMeasurement(Experiment.HIGHER_FREQUENCY, (Rig.TESTER,), _to_a_higher_frequency),
)
"""All experiments that may be asked for."""
CHECKS = {each.id: each for each in EXPERIMENTS if isinstance(each, SizeCheck)}
CHANGES_THE_BENCH = (
    Experiment.HEAVIER_ACCELEROMETER,
    Experiment.ACCELEROMETER_LEFT,
    Experiment.ACCELEROMETER_MIDDLE,
    Experiment.ACCELEROMETER_RIGHT,
)
"""Experiments whose data are not diagnosed together with the first."""


def after_readings(
    weighed: Sequence[Weighed[Model]], read: Sequence[tuple[Experiment, Mapping[str, float]]], calibration: Calibration
) -> tuple[Weighed[Model], ...]:
    """Explanations after the readings of all checks, the most probable first.

    They are weighed together: two checks may read one parameter, or parameters that the data bind to each other.

    Args:
        weighed: explanations before.
        read: by check, values by name, as of `relevant_readings`; other names do not count.
        calibration: how wrong laws may be.
    """
    return _after(weighed, [(CHECKS[check].readings, values) for check, values in read], calibration)


def _after(
    weighed: Sequence[Weighed[Model]],
    read: Sequence[tuple[Sequence[Reading], Mapping[str, float]]],
    calibration: Calibration,
) -> tuple[Weighed[Model], ...]:
    possible = [each for each in weighed if each.probability > 0]
    found = [
        (name, reading, values[name] / reading.deviation)
        for readings, values in read
        for name, reading in relevant_readings(possible, readings, values)
    ]
    if not found:
        return tuple(weighed)
    expected = expected_readings(possible, [(name, reading) for name, reading, _ in found], calibration)
    logs = log_posterior(expected, np.array([value for _, _, value in found]))
    after = [replace(e, probability=float(np.exp(p)), score=float(p)) for e, p in zip(possible, logs, strict=True)]
    return tuple(sorted(after, key=lambda each: -each.probability))
