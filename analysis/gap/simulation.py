"""One simulation of both rigs with its derivatives: the paper's model, and effects on top of it.

Parameters are scores (see `analysis.gap.parameter`): first the baseline's, then each effect's, then for each hammer set
its gain, the stiffness of its joints and the offsets of its blows. Accelerances as a function of the bench, with their
sharp resonances, are differentiated analytically in `beam_rig`; the bench is a smooth function of the parameters, and
differences give it to five digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.baseline import Baseline, changed_by
from analysis.gap.beam_rig import Answer, BeamRig, Changes
from analysis.gap.bench import BeamBench, Loading, Setting, joint_matrices
from analysis.gap.effect import Effect, Given, acts_on
from analysis.gap.free_beam_modes import BeamModes
from analysis.gap.measurement import Configuration, Measurement, TesterPoints
from analysis.gap.parameter import Parameter
from analysis.gap.scales import Scales

STEP = 1e-7
"""In standard deviations of the prior: truncation and rounding are then both below 1e-5 of a derivative."""
AFFECTED_PARTS = {
    "cylinders": ("joints", "tester"),
    "mounting": ("joints", "surroundings", "tester"),
    "joints": ("joints",),
    "beam": ("surroundings",),
    "tester": ("tester",),
}
"""Parts of the bench that each method of an effect changes."""
SURROUNDINGS = tuple(field.name for field in fields(BeamBench) if field.name != "joints")


@dataclass(frozen=True, eq=False)
class Prediction:
    """Readings of both rigs, and their derivatives in the shared parameters.

    Attributes:
        accelerances: for each set, (rows, lines), (m/s^2)/N.
        by_shared: for each set, (shared, rows, lines) per score; empty where derivatives were not asked for.
        by_blow: for each set, (rows, lines) per score of the blow's offset; zero for blows along the beam.
        by_setup: for each set, (joints, rows, lines) per score of the stiffness of each joint after its set-up.
        stiffness: (points,) N/m.
        stiffness_by_shared: (shared, points).
    """

    accelerances: tuple[Complex, ...]
    by_shared: tuple[Complex, ...]
    by_blow: tuple[Complex, ...]
    by_setup: tuple[Complex, ...]
    stiffness: Complex
    stiffness_by_shared: Complex


@dataclass(frozen=True, eq=False)
class Values:
    """Values of parameters by name: of the baseline, and of each effect in the order in which they act."""

    baseline: Given
    acting: tuple[tuple[Effect, Given], ...]


@dataclass(frozen=True, eq=False)
class Simulation:
    """Both rigs of one measurement under the baseline and some effects.

    Attributes:
        baseline: the paper's model.
        modes: of the drawing.
        effects: of the model, in the order in which they act.
    """

    baseline: Baseline
    modes: BeamModes
    effects: tuple[Effect, ...] = ()

    def of(self, measurement: Measurement) -> Simulation:
        """The same model, priors included, of another measurement on the same drawing."""
        return replace(self, baseline=replace(self.baseline, measurement=measurement))

    def with_scales(self, scales: Scales) -> Simulation:
        """The same model with other scales of what differs on every bench."""
        return replace(self, baseline=replace(self.baseline, scales=scales))

    @cached_property
    def shared(self) -> tuple[Parameter, ...]:
        """Parameters of the baseline and of the effects."""
        own = (parameter for effect in self.effects for parameter in effect.parameters)
        return (*self.baseline.parameters, *own)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """Hammer sets that share one bench: the same lines and window."""
        measurement = self.baseline.measurement
        found = dict[tuple[object, ...], list[int]]()
        for number, each in enumerate(measurement.sets):
            found.setdefault((each.frequency.tobytes(), each.decay), []).append(number)
        return tuple(self._group(numbers) for numbers in found.values())

    def _group(self, numbers: list[int]) -> Group:
        drawing, sets = self.baseline.measurement.drawing, [self.baseline.measurement.sets[n] for n in numbers]
        inputs = tuple(dof for each in sets for dof in each.inputs)
        ends = np.cumsum([0, *(len(each.inputs) for each in sets)]).tolist()
        state = np.repeat(np.arange(len(sets)), np.diff(ends))
        rig = BeamRig(
            modes=self.modes,
            inputs=inputs,
            node_positions=drawing.node_positions,
            sensor=drawing.accelerometer.direction,
            sensor_mass=drawing.accelerometer_mass,
            joint_mass=np.array([joint.added_mass for joint in drawing.joints]),
            state=state,
        )
        first, force = sets[0], np.array([each.peak_force for each in sets])
        setting = Setting(inputs, first.frequency, force, state, first.decay)
        return Group(rig, setting, tuple(numbers), tuple(slice(*pair) for pair in pairwise(ends)))

    @cached_property
    def _names(self) -> tuple[tuple[str, ...], ...]:
        """Names of the parameters of the baseline, then of each effect."""
        owners = [self.baseline.parameters, *(effect.parameters for effect in self.effects)]
        return tuple(tuple(each.name for each in parameters) for parameters in owners)

    def values(self, scores: Sequence[float]) -> Values:
        """Values of the parameters at `scores` (shared,)."""
        values = iter([parameter.value(score) for parameter, score in zip(self.shared, scores, strict=True)])
        baseline, *own = [{name: next(values) for name in names} for names in self._names]
        return Values(baseline, tuple(zip(self.effects, own, strict=True)))

    # --- the bench as a function of the parameters ---

    @cached_property
    def affected(self) -> tuple[frozenset[str], ...]:
        """For each shared parameter, the parts of the bench that it changes: joints, surroundings, tester."""
        found = [changed_by(name) for name in self._names[0]]
        for effect in self.effects:
            parts = frozenset(part for hook, parts in AFFECTED_PARTS.items() if acts_on(effect, hook) for part in parts)
            found += [parts] * len(effect.parameters)
        return tuple(found)

    def surroundings(self, values: Values, setting: Setting) -> BeamBench:
        """The beam rig in one setting, without the stiffness of its joints."""
        mounting = self.baseline.mounting(values.baseline)
        for effect, given in values.acting:
            mounting = effect.mounting(given, mounting)
        bench = self.baseline.beam(values.baseline, setting, mounting)
        for effect, given in values.acting:
            bench = effect.beam(given, bench, setting)
        return bench

    def joints(self, values: Values, setting: Setting, pole: Complex, setups: Real) -> Complex:
        """(states, lines or 1, joints, 3, 3) stiffness of the joints in one setting.

        `setups` (states, joints) are factors by which the cylinders differ after each set-up.
        """
        cylinders, mounting = self.baseline.cylinders(values.baseline), self.baseline.mounting(values.baseline)
        for effect, given in values.acting:
            cylinders = effect.cylinders(given, cylinders, setting.loading)
            mounting = effect.mounting(given, mounting)
        joints = setups[:, None, :, None, None] * joint_matrices(cylinders, mounting)
        for effect, given in values.acting:
            joints = effect.joints(given, joints, pole)
        return joints

    def tester(self, values: Values, points: TesterPoints) -> Complex:
        """(points,) the tester's reading, N/m."""
        cylinders, mounting = self.baseline.cylinders(values.baseline), self.baseline.mounting(values.baseline)
        for effect, given in values.acting:
            cylinders = effect.cylinders(given, cylinders, self._tester_loading)
            mounting = effect.mounting(given, mounting)
        weights = self.baseline.weights(mounting, points)
        stiffness = self.baseline.in_tester(values.baseline, cylinders).complex_stiffness[:, :2, 0]
        alone = stiffness.shape[2] == 1
        seen = stiffness[points.specimen, :, 0 if alone else np.arange(points.order.size)]
        read = np.sum(weights * seen, axis=1)
        for effect, given in values.acting:
            read = effect.tester(given, read, points)
        return np.asarray(self.baseline.tester_gain(values.baseline, points) * read)

    @cached_property
    def _tester_loading(self) -> Loading:
        points = self.baseline.measurement.points
        assert points is not None
        return Loading(
            tester=True,
            frequency=points.frequency,
            amplitude=points.amplitude,
            level=np.ones((1, 1)),
            fraction=points.fraction,
            angled=points.configuration == Configuration.ANGLED,
        )

    # --- readings of both rigs ---

    def state(self, scores: Real, gains: Real, setups: Real, blows: Sequence[Real]) -> State:
        """Both rigs at one point.

        Args:
            scores: (shared,).
            gains: (sets,) of hammer and accelerometer together, relative to one.
            setups: (sets, joints) stiffness of each joint after each set-up, relative to one.
            blows: for each set, (rows,) offsets of the blows from their nodes, m.
        """
        answers, values = [], self.values(scores.tolist())
        for group in self.groups:
            around = self.surroundings(values, group.setting)
            own = 1 + setups[list(group.numbers)]
            at = replace(around, joints=self.joints(values, group.setting, around.pole, own))
            answers.append(group.rig.answer(at, np.concatenate([blows[number] for number in group.numbers])))
        points = self.baseline.measurement.points
        stiffness = np.zeros(0, dtype=complex) if points is None else self.tester(values, points)
        return State(self, scores, gains, setups, tuple(answers), stiffness)

    def change(self, setting: Setting, moved: Values, place: int, at: BeamBench, setups: Real) -> Changes:
        """Derivatives in one parameter of the fields of the bench that it changes.

        Args:
            setting: of the bench.
            moved: values one `STEP` from those of `at` in that parameter.
            place: index of the parameter among the shared ones.
            at: the bench.
            setups: (states, joints) factors of the joints' stiffness.
        """
        change, pole = dict[str, Complex | Real](), at.pole
        if "surroundings" in self.affected[place]:
            bench = self.surroundings(moved, setting)
            pole = bench.pole
            for field in SURROUNDINGS:
                difference = np.asarray(getattr(bench, field) - getattr(at, field))
                if difference.any():
                    change[field] = difference / STEP
        if "joints" in self.affected[place] or "pole" in change:
            difference = self.joints(moved, setting, pole, setups) - at.joints
            if difference.any():
                change["joints"] = difference / STEP
        return change


@dataclass(frozen=True, eq=False)
class Group:
    """Hammer sets that share one bench, treated as one set with all their rows.

    Attributes:
        rig: with the rows of all of them.
        setting: of all of them.
        numbers: indices of the sets.
        rows: of each set among those of the rig.
    """

    rig: BeamRig
    setting: Setting
    numbers: tuple[int, ...]
    rows: tuple[slice, ...]


@dataclass(frozen=True, eq=False)
class State:
    """Both rigs at one point: readings are known, and derivatives are computed on demand.

    Attributes:
        simulation: of both.
        scores: (shared,).
        gains: (sets,) relative to one.
        setups: (sets, joints) relative to one.
        answers: responses of the beam rig to each group of hammer sets.
        stiffness: (points,) the tester's reading, N/m.
    """

    simulation: Simulation
    scores: Real
    gains: Real
    setups: Real
    answers: tuple[Answer, ...]
    stiffness: Complex

    def prediction(self, derivatives: Sequence[int] | None = None) -> Prediction:
        """Readings of both rigs, with derivatives in some shared parameters, by index; in all by default."""
        return self._whole if derivatives is None else self._prediction(derivatives)

    @cached_property
    def _whole(self) -> Prediction:
        return self._prediction(range(self.scores.size))

    def _prediction(self, wanted: Sequence[int]) -> Prediction:
        simulation = self.simulation
        steps = {place: STEP * (np.arange(self.scores.size) == place) for place in wanted}
        moved = {place: simulation.values((self.scores + step).tolist()) for place, step in steps.items()}
        own = simulation.baseline.measurement.tolerances.impact_position
        scatter = simulation.baseline.scales.setup_scatter
        accelerances, by_shared, by_blow, by_setup = ([np.empty(0, dtype=complex)] * self.gains.size for _ in range(4))
        for group, answer in zip(simulation.groups, self.answers, strict=True):
            setups = 1 + self.setups[list(group.numbers)]
            changes: list[Changes] = [
                simulation.change(group.setting, moved[n], n, answer.bench, setups) for n in wanted
            ]
            if len(wanted):
                changes += self._by_setups(group.setting, answer.bench, setups)
            columns = answer.derivatives(changes)
            for number, rows in zip(group.numbers, group.rows, strict=True):
                gain = 1 + self.gains[number]
                accelerances[number] = gain * answer.accelerance[rows]
                by_shared[number] = gain * columns[: len(wanted), rows]
                by_setup[number] = gain * scatter * columns[len(wanted) :, rows]
                if len(wanted):
                    by_blow[number] = gain * own * answer.by_blow_offset[rows]
        by_score = [self._tester_slope(place, moved[place]) for place in wanted]
        return Prediction(
            tuple(accelerances),
            tuple(by_shared),
            tuple(by_blow),
            tuple(by_setup),
            self.stiffness,
            np.array(by_score).reshape(len(wanted), self.stiffness.size),
        )

    def _by_setups(self, setting: Setting, at: BeamBench, setups: Real) -> list[Changes]:
        """Derivatives of the bench in the factor of each joint's stiffness, in every state at once."""
        values, joints = self.simulation.values(self.scores.tolist()), self.simulation.joints
        steps = STEP * np.eye(setups.shape[1])
        return [{"joints": (joints(values, setting, at.pole, setups + step) - at.joints) / STEP} for step in steps]

    def _tester_slope(self, place: int, moved: Values) -> Complex:
        """(points,) derivative in one parameter."""
        simulation, points = self.simulation, self.simulation.baseline.measurement.points
        if points is None or "tester" not in simulation.affected[place]:
            return np.zeros_like(self.stiffness)
        return np.asarray((simulation.tester(moved, points) - self.stiffness) / STEP)
