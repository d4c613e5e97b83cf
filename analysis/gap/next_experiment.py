"""The cheapest further measurement that would settle what a diagnosis leaves open.

Two explanations fit what was measured. A further measurement is simulated under the one; the other is fitted to it,
held by all that was measured before. What it cannot follow, in standard deviations, is the separation to expect. What
the simulation does not have, such as a ruler, tells the size of an effect instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap.evidence import PATTERNS
from analysis.gap.fit import Likelihood
from analysis.gap.measurement import Measurement
from analysis.gap.model import Model
from analysis.gap.verdict import UNKNOWN, Weighed
from analysis.inverse.levenberg_marquardt import inverse

CONVINCING = 5.0
"""Standard deviations of expected separation that settle a matter."""
LINES = 64
"""Of a simulated hammer set."""
SAME = 1.01
"""Ratio up to which two amplitudes are one."""
FURTHER_MASS = 0.02
"""kg, about what an accelerometer weighs."""


@dataclass(frozen=True)
class Check:
    """Something that tells the size of effects by itself.

    Attributes:
        deed: what to do.
        tells: effects whose size it tells.
        share: of their range, how well.
    """

    deed: str
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
class Further:
    """A further measurement of a kind that can be simulated.

    Attributes:
        deed: what to do.
        rig: "inverse" or "direct".
        planned: what it would be after a first measurement; empty where that has nothing of the kind.
        other_amplitude: whether it is at amplitudes at which nothing was measured, of which some laws know nothing.
    """

    deed: str
    rig: str
    planned: Callable[[Measurement], Measurement | None]
    other_amplitude: bool = False

    def separation(self, verdict: Model, rival: Model) -> float:
        """By how much the rival could not follow what the verdict expects."""
        further = self.planned(verdict.fit.likelihood.measurement.thinned(LINES))
        models = verdict, rival
        if further is None:
            return 0.0
        if self.other_amplitude and not all(effect.interpolates for model in models for effect in model.effects):
            return 0.0
        return separation(verdict, rival, further, self.rig)


def separation(verdict: Model, rival: Model, further: Measurement, rig: str) -> float:
    """Standard deviations that a rival cannot follow of what a verdict expects of a further measurement.

    No law is exact: as in weighing, what the verdict itself leaves of the first measurement counts as so much noise.

    Args:
        verdict, rival: fitted to the same first measurement.
        further: with its inputs, lines and noise; its values do not matter.
        rig: which of its data count: "inverse" or "direct".
    """
    seen = _expected(verdict, further)
    likelihood = Likelihood(rival.fit.likelihood.simulation.of(seen))
    shared = len(likelihood.simulation.shared)
    scores = np.zeros(likelihood.unknowns)
    scores[:shared] = rival.fit.scores[:shared]
    blocks = [block for block in likelihood.blocks(scores) if block.rig == rig]
    normal, descent = np.eye(likelihood.unknowns), np.zeros(likelihood.unknowns)
    normal[:shared, :shared] = inverse(inverse(rival.fit.at.normal)[:shared, :shared])
    for block in blocks:
        normal[np.ix_(block.unknowns, block.unknowns)] += block.normal
        descent[block.unknowns] += block.descent
    followed = descent @ np.linalg.solve(normal, descent)
    left = max(0.0, sum(block.chi_square for block in blocks) - followed)
    return float(np.sqrt(left / max(1.0, verdict.misfit.certain / PATTERNS)))


def _expected(model: Model, further: Measurement) -> Measurement:
    """What a model expects, without noise."""
    likelihood = Likelihood(model.fit.likelihood.simulation.of(further))
    scores = np.zeros(likelihood.unknowns)
    shared = len(likelihood.simulation.shared)
    scores[:shared] = model.fit.scores[:shared]
    found = likelihood.predict(scores, derivatives=False)
    sets = tuple(replace(each, accelerance=a) for each, a in zip(further.sets, found.accelerances, strict=True))
    points = None if further.points is None else replace(further.points, stiffness=found.stiffness)
    return replace(further, sets=sets, points=points)


# --- further measurements that can be simulated ---


def _at_half_the_force(first: Measurement) -> Measurement | None:
    """The softest set with softer blows, out of which noise stands the more."""
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
    """At the node nearest to a share of the beam's length, beside joints and where it sat before."""
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
    """The smallest amplitude halved; the same noise of force is then more of a stiffness."""
    points = first.points
    if points is None:
        return None
    smallest = points.only(points.amplitude <= SAME * np.min(points.amplitude))
    halved = replace(smallest, amplitude=smallest.amplitude / 2, deviation=2 * smallest.deviation)
    return replace(first, points=halved)


EXPERIMENTS: tuple[Check | Further, ...] = (
    Check("read the thermometers of both rigs", ("temperature_shift",), 0.05),
    Check("measure the places of joints and points with a ruler", ("support_position", "impact_position"), 0.1),
    Check("weigh the accelerometer, the caps and the bar", ("accelerometer_mass", "joint_mass", "density"), 0.05),
    Check("measure how the cylinders lean and sit", ("cylinder_angle", "vertical_offset", "contact_patch"), 0.1),
    Check("strike a known free mass", ("sensor_gain", "channel_delay", "highpass_corner"), 0.05),
    Check("take a blank test of the tester", ("frame_compliance", "frame_resonance", "fixture_inertia"), 0.05),
    Check("test a known mass in the tester", ("transducer_lag", "fixture_inertia"), 0.05),
    Further("strike again at half the peak force", "inverse", _at_half_the_force, other_amplitude=True),
    Further(
        f"strike again with {1e3 * FURTHER_MASS:.0f} g more on the accelerometer", "inverse", _heavier_accelerometer
    ),
    Further("strike again with the accelerometer at the left end", "inverse", partial(_accelerometer_at, 0.0)),
    Further("strike again with the accelerometer in the middle", "inverse", partial(_accelerometer_at, 0.5)),
    Further("strike again with the accelerometer at the right end", "inverse", partial(_accelerometer_at, 1.0)),
    Check("take records of twice the length", ("exponential_window", "beam_damping"), 0.1),
    Further("repeat the tester's points in random order", "direct", _in_random_order),
    Further("repeat the tester's points at half the smallest amplitude", "direct", _at_half_the_amplitude, True),
    Check("repeat the tester's points at another preset", ("preload_stiffening",), 0.1),
    Check("turn the accelerometer, or use one of three axes", ("cross_axis_sensitivity",), 0.1),
    Check("listen out of the plane", ("out_of_plane_bending",), 0.1),
    Check("strike with a guided hammer", ("impact_angle",), 0.1),
    Check("suspend the bar and measure it free", ("youngs_modulus", "density", "beam_damping", "mesh_error"), 0.1),
    Check("listen at the foundation", ("foundation_compliance",), 0.1),
    Check(
        "strike at a third level and test at a fourth amplitude",
        ("amplitude_dependence", "cubic_stiffness", "coulomb_friction"),
        0.1,
    ),
    Check("test to a higher frequency", ("frequency_dependence", "loss_law"), 0.2),
)
"""The cheapest first."""


def next_experiment(status: str, weighed: Sequence[Weighed], groups: Sequence[Sequence[str]]) -> str:
    """In a sentence, what to measure next.

    Args:
        status: of the diagnosis.
        weighed: explanations, the verdict first.
        groups: of effects that these data cannot tell apart.
    """
    if status == "none":
        return "nothing is asked for: simulation and measurement agree within noise and tolerances"
    if status == "unknown":
        return (
            "look at the bench where the map shows the gap; repeat the measurement after a new set-up, at another "
            "level and with the accelerometer at a second place, to see what moves with it"
        )
    verdict, rivals = weighed[0], _rivals(weighed, groups)
    doubtful = [name for group in groups for name in group] or list(verdict.effects)
    deed, expected = _cheapest(verdict.model, [rival.model for rival in rivals])
    if expected == 0.0:
        return f"repeat the measurement with {' and '.join(verdict.effects)} put right"
    purpose = f"tell {' from '.join(doubtful)}" if groups else f"confirm {' and '.join(doubtful)}"
    return f"{deed}: expected to {purpose} by {expected:.0f} standard deviations"


def _rivals(weighed: Sequence[Weighed], groups: Sequence[Sequence[str]]) -> list[Weighed]:
    """The most probable explanation with each twin; without twins, the most probable that lacks part of the verdict."""
    verdict, others = weighed[0], [each for each in weighed[1:] if each.effects != UNKNOWN]
    twins = {name for group in groups for name in group} - set(verdict.effects)
    found = [next(each for each in others if name in each.effects) for name in sorted(twins)]
    return found or [each for each in others if not set(verdict.effects) <= set(each.effects)][:1]


def _cheapest(verdict: Model, rivals: Sequence[Model]) -> tuple[str, float]:
    """The first experiment that tells the verdict from all rivals, else the one that comes nearest."""
    best = "", 0.0
    for experiment in EXPERIMENTS:
        expected = min((experiment.separation(verdict, rival) for rival in rivals), default=0.0)
        if expected > best[1]:
            best = experiment.deed, expected
        if expected >= CONVINCING:
            break
    return best


def _size(model: Model, effect: int) -> float:
    """Of an effect, in standard deviations of its prior, as far as the data are sure of it."""
    places = list(model.places(effect))
    scores = model.fit.scores[places]
    certain = np.linalg.inv(model.fit.covariance[np.ix_(places, places)])
    weight = np.diag(certain) / np.max(np.diag(certain))
    return float(np.sqrt(np.sum(weight * scores**2) / np.sum(weight)))
