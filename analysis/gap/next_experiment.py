"""The cheapest further measurement that would settle what a diagnosis leaves open.

Two explanations fit the same data. A further measurement is simulated under the first; the second is fitted to it,
constrained by the first measurement. The residual, in standard deviations, is the separation to expect. A check that
the simulation does not contain, such as a ruler, measures the size of an effect instead.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap.calibration import UNCALIBRATED
from analysis.gap.fit import in_other_set_up
from analysis.gap.measurement import Measurement
from analysis.gap.model import Model
from analysis.gap.verdict import UNKNOWN, Status, Weighed, leading
from analysis.inverse.levenberg_marquardt import inverse

CONVINCING = 5.0
"""Expected separation in standard deviations that is enough to decide."""
LINES = 64
"""Of a simulated hammer set."""
SAME = 1.01
"""Ratio up to which two amplitudes count as equal."""
FURTHER_MASS = 0.02
"""kg, about what an accelerometer weighs."""


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
class NextExperiment:
    """What a diagnosis asks for next.

    Attributes:
        id: the experiment.
        effects: ids of those that it is expected to tell apart or to confirm, or that are to be corrected.
        tells_apart: whether these data cannot tell `effects` apart; otherwise the experiment confirms them.
        separation: that is expected, in standard deviations; 0 where none was computed.
        corrections: ids of effects that records show; their cause is to be removed before anything is measured again.
    """

    id: Experiment
    effects: tuple[str, ...] = ()
    tells_apart: bool = False
    separation: float = 0.0
    corrections: tuple[str, ...] = ()


@dataclass(frozen=True)
class Check:
    """A check that measures the size of effects directly.

    Attributes:
        id: the experiment.
        tells: ids of effects whose size it measures.
        share: standard deviation of the check, over the range of the effect.
    """

    id: Experiment
    tells: tuple[str, ...]
    share: float

    def separation(self, verdict: Model, rival: Model) -> float:
        """Standard deviations between the sizes of an effect in two explanations."""
        found = [
            _size(one, place) / self.share
            for one, other in ((verdict, rival), (rival, verdict))
            for place, effect in enumerate(one.effects)
            if effect.id in self.tells and effect.id not in other.ids
        ]
        return max(found, default=0.0)


@dataclass(frozen=True)
class FurtherMeasurement:
    """A further measurement of a kind that can be simulated.

    Attributes:
        id: the experiment.
        rig: "inverse" or "direct".
        planned: gives the further measurement after a first one; None where it is impossible.
    """

    id: Experiment
    rig: str
    planned: Callable[[Measurement], Measurement | None]

    def separation(self, verdict: Model, rival: Model) -> float:
        """Standard deviations by which the rival cannot follow the data that the verdict expects."""
        further = self.planned(verdict.fit.likelihood.measurement.thinned(LINES))
        return 0.0 if further is None else separation(verdict, rival, further, self.rig)


def separation(verdict: Model, rival: Model, further: Measurement, rig: str) -> float:
    """Standard deviations by which a rival cannot follow the data that a verdict expects of a further measurement.

    No law is exact: as in weighing, the misfit that the verdict itself leaves counts as noise.

    Args:
        verdict, rival: fitted to the same first measurement.
        further: with its inputs, lines and noise; its values do not matter.
        rig: which of its data count: "inverse" or "direct".
    """
    likelihood, scores = in_other_set_up(rival.fit, _expected(verdict, further))
    shared = len(likelihood.simulation.shared)
    blocks = [block for block in likelihood.blocks(scores) if block.rig == rig]
    normal, descent = np.eye(likelihood.unknowns), np.zeros(likelihood.unknowns)
    normal[:shared, :shared] = inverse(inverse(rival.fit.at.normal)[:shared, :shared])
    for block in blocks:
        normal[np.ix_(block.unknowns, block.unknowns)] += block.normal
        descent[block.unknowns] += block.descent
    followed = descent @ np.linalg.solve(normal, descent)
    left = max(0.0, sum(block.chi_square for block in blocks) - followed)
    return float(np.sqrt(left / max(1.0, verdict.misfit.certain / UNCALIBRATED.patterns)))


def _expected(model: Model, further: Measurement) -> Measurement:
    """The further measurement as a model expects it, without noise."""
    likelihood, scores = in_other_set_up(model.fit, further)
    found = likelihood.predict(scores, derivatives=())
    sets = tuple(
        replace(each, accelerance=a, reference=None) for each, a in zip(further.sets, found.accelerances, strict=True)
    )
    points = None if further.points is None else replace(further.points, stiffness=found.stiffness)
    return replace(further, sets=sets, points=points)


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
    """At the node nearest to a share of the beam's length, except at joints and at its present node."""
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
    """Half of the smallest amplitude; the same noise of force is then twice the noise of stiffness."""
    points = first.points
    if points is None:
        return None
    smallest = points.only(points.amplitude <= SAME * np.min(points.amplitude))
    halved = replace(smallest, amplitude=smallest.amplitude / 2, deviation=2 * smallest.deviation)
    return replace(first, points=halved)


EXPERIMENTS: tuple[Check | FurtherMeasurement, ...] = (
    Check(Experiment.READ_THERMOMETERS, ("temperature_shift",), 0.05),
    Check(Experiment.MEASURE_PLACES, ("support_position", "impact_position"), 0.1),
    Check(Experiment.WEIGH_PARTS, ("accelerometer_mass", "joint_mass", "density"), 0.05),
    Check(Experiment.MEASURE_CYLINDERS, ("cylinder_angle", "vertical_offset", "contact_patch"), 0.1),
    Check(Experiment.STRIKE_KNOWN_MASS, ("sensor_gain", "channel_delay", "highpass_corner"), 0.05),
    Check(Experiment.BLANK_TEST, ("frame_compliance", "frame_resonance", "fixture_inertia"), 0.05),
    Check(Experiment.MASS_IN_TESTER, ("transducer_lag", "fixture_inertia"), 0.05),
    FurtherMeasurement(Experiment.HALF_FORCE, "inverse", _at_half_the_force),
    FurtherMeasurement(Experiment.HEAVIER_ACCELEROMETER, "inverse", _heavier_accelerometer),
    FurtherMeasurement(Experiment.ACCELEROMETER_LEFT, "inverse", partial(_accelerometer_at, 0.0)),
    FurtherMeasurement(Experiment.ACCELEROMETER_MIDDLE, "inverse", partial(_accelerometer_at, 0.5)),
    FurtherMeasurement(Experiment.ACCELEROMETER_RIGHT, "inverse", partial(_accelerometer_at, 1.0)),
    Check(Experiment.LONG_RECORDS, ("exponential_window", "beam_damping"), 0.1),
    FurtherMeasurement(Experiment.RANDOM_ORDER, "direct", _in_random_order),
    FurtherMeasurement(Experiment.HALF_AMPLITUDE, "direct", _at_half_the_amplitude),
    Check(Experiment.ANOTHER_PRESET, ("preload_stiffening",), 0.1),
    Check(Experiment.TURN_ACCELEROMETER, ("cross_axis_sensitivity",), 0.1),
    Check(Experiment.OUT_OF_PLANE, ("out_of_plane_bending",), 0.1),
    Check(Experiment.GUIDED_HAMMER, ("impact_angle",), 0.1),
    Check(Experiment.FREE_BEAM, ("youngs_modulus", "density", "beam_damping", "mesh_error"), 0.1),
    Check(Experiment.AT_FOUNDATION, ("foundation_compliance",), 0.1),
    Check(Experiment.OTHER_LEVELS, ("amplitude_dependence", "cubic_stiffness", "coulomb_friction"), 0.1),
    Check(Experiment.HIGHER_FREQUENCY, ("frequency_dependence", "loss_law"), 0.2),
)
"""The cheapest first."""


def next_experiment(status: Status, weighed: Sequence[Weighed], groups: Sequence[Sequence[str]]) -> NextExperiment:
    """What to measure next.

    Args:
        status: of the diagnosis.
        weighed: explanations, the verdict first.
        groups: of effects that these data cannot tell apart.
    """
    if status is Status.NONE:
        return NextExperiment(Experiment.NOTHING)
    if status is Status.UNKNOWN:
        return NextExperiment(Experiment.NEW_SET_UP)
    verdict, rivals = leading(weighed), _rivals(weighed, groups)
    found, expected = Experiment.CORRECT_EFFECTS, 0.0
    for experiment in EXPERIMENTS:  # the first that tells the verdict from all rivals, else the one that comes nearest
        told = min((experiment.separation(verdict.model, rival.model) for rival in rivals), default=0.0)
        if told > expected:
            found, expected = experiment.id, told
        if told >= CONVINCING:
            break
    if expected == 0.0:
        return NextExperiment(Experiment.CORRECT_EFFECTS, verdict.effects)
    doubtful = tuple(name for group in groups for name in group) or verdict.effects
    return NextExperiment(found, doubtful, tells_apart=bool(groups), separation=expected)


def _rivals(weighed: Sequence[Weighed], groups: Sequence[Sequence[str]]) -> list[Weighed]:
    """The best explanation with each confounded effect; without these, the best that lacks part of the verdict."""
    verdict = leading(weighed)
    others = [each for each in weighed if each is not verdict and each.effects != UNKNOWN]
    others_of_group = {name for group in groups for name in group} - set(verdict.effects)
    found = [next(each for each in others if name in each.effects) for name in sorted(others_of_group)]
    return found or [each for each in others if not set(verdict.effects) <= set(each.effects)][:1]


def _size(model: Model, effect: int) -> float:
    """Size of an effect in standard deviations of its prior, weighted by how certain its parameters are."""
    places = list(model.places(effect))
    scores = model.fit.scores[places]
    certain = np.linalg.inv(model.fit.covariance[np.ix_(places, places)])
    weight = np.diag(certain) / np.max(np.diag(certain))
    return float(np.sqrt(np.sum(weight * scores**2) / np.sum(weight)))
