"""One simulation of both rigs with its derivatives: the paper's model, and effects on top of it.

Parameters are scores (see `analysis.gap.parameter`): first the baseline's, then each effect's, then for each hammer set
its gain, the stiffness of its joints, and the offsets and leans of its blows. Accelerances as a function of the bench,
with their sharp resonances, are differentiated analytically in `beam_rig_derivatives`; the bench is a smooth function
of the parameters, and differences give it to five digits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BeamBench, BlowAmplitudes, Mounting, Setting, joint_matrices
from analysis.gap.effect import Effect, Given, acts_on
from analysis.gap.measurement import Indices, Measurement, TesterPoints
from analysis.gap.parameter import Parameter
from analysis.gap.simulation.baseline import Baseline, changed_by
from analysis.gap.simulation.beam_rig import BeamResponse
from analysis.gap.simulation.beam_rig_derivatives import Changes, Derivatives
from analysis.gap.simulation.blow_motion import (
    BlowMotion,
    EquivalentLinearisation,
    blow_amplitudes_of,
    equivalent_linearisation,
    factors_of,
    half_sine,
)
from analysis.gap.simulation.free_beam_modes import BeamModes
from analysis.gap.simulation.hammer_groups import Group, groups_of
from analysis.gap.simulation.scales import Scales
from analysis.gap.simulation.tester_rig import reading_of_tester

STEP = 1e-7
"""Step of the differences, in standard deviations of the prior; truncation and rounding are below 1e-5."""
AFFECTED_PARTS = {
    "cylinders": ("joints", "tester"),
    "mounting": ("joints", "surroundings", "tester"),
    "setups": ("joints",),
    "joints": ("joints",),
    "beam": ("surroundings",),
    "tester": ("tester",),
}
"""Parts of the bench that each method of an effect changes."""
SURROUNDINGS = tuple(field.name for field in fields(BeamBench) if field.name not in ("joints", "local", "on_base"))


@dataclass(frozen=True, eq=False)
class Prediction:
    """Readings of both rigs, and their derivatives in the shared parameters.

    Attributes:
        accelerances: for each set, (rows, lines), (m/s^2)/N.
        by_shared: for each set, (shared, rows, lines) per score; empty where derivatives were not asked for.
        by_blow: for each set, (2, rows, lines) per score of the blow's offset and of its lean.
        by_setup: for each set, (joints, rows, lines) per score of the stiffness of each joint after its set-up.
        by_amplitude: for each set, (2 joints, rows, lines) per logarithm of the amplitude of each joint under a row's
            blows; empty where no effect follows motion.
        stiffness: (points,) N/m.
        stiffness_by_shared: (shared, points).
    """

    accelerances: tuple[Complex, ...]
    by_shared: tuple[Complex, ...]
    by_blow: tuple[Complex, ...]
    by_setup: tuple[Complex, ...]
    by_amplitude: tuple[Complex, ...]
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
        own = self.baseline.measurement
        return self if measurement is own else replace(self, baseline=replace(self.baseline, measurement=measurement))

    def with_scales(self, scales: Scales) -> Simulation:
        """The same model with other scales of the nuisances."""
        return replace(self, baseline=replace(self.baseline, scales=scales))

    @cached_property
    def shared(self) -> tuple[Parameter, ...]:
        """Parameters of the baseline and of the effects."""
        own = (parameter for effect in self.effects for parameter in effect.parameters)
        return (*self.baseline.parameters, *own)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """Hammer sets that share one bench."""
        by_row = any(effect.by_row or effect.follows_motion for effect in self.effects)
        return groups_of(self.baseline.measurement, self.modes, by_row)

    @cached_property
    def follows_motion(self) -> bool:
        """Whether joints under the beam follow the motion that each row's own blows make."""
        return any(effect.follows_motion for effect in self.effects)

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

    def moved(self, values: Values, place: int, score: float) -> Values:
        """Values with that of one shared parameter, by index, at another score."""
        owner, new = self._owner[place], {self.shared[place].name: self.shared[place].value(score)}
        if owner < 0:
            return Values({**values.baseline, **new}, values.acting)
        acting = [
            (effect, {**own, **new} if number == owner else own) for number, (effect, own) in enumerate(values.acting)
        ]
        return Values(values.baseline, tuple(acting))

    @cached_property
    def _owner(self) -> list[int]:
        """For each shared parameter, the index of its effect; -1 for the baseline."""
        return [owner for owner, names in enumerate(self._names, -1) for _ in names]

    # --- the bench as a function of the parameters ---

    @cached_property
    def affected(self) -> tuple[frozenset[str], ...]:
        """For each shared parameter, the parts of the bench that it changes, as of `changed_by`."""
        found = [changed_by(each.kind) for each in self.baseline.parameters]
        for effect in self.effects:
            parts = frozenset(part for hook, parts in AFFECTED_PARTS.items() if acts_on(effect, hook) for part in parts)
            found += [parts] * len(effect.parameters)
        return tuple(found)

    @cached_property
    def under_beam(self) -> Indices:
        """Indices of the shared parameters that change the beam rig; the others change the tester alone."""
        found = [place for place, parts in enumerate(self.affected) if not parts <= {"tester", "factor"}]
        return np.array(found, dtype=np.intp)

    def mounting(self, values: Values) -> Mounting:
        """How the cylinders hold the beam."""
        mounting = self.baseline.mounting(values.baseline)
        for effect, given in values.acting:
            mounting = effect.mounting(given, mounting)
        return mounting

    def surroundings(self, values: Values, setting: Setting) -> BeamBench:
        """The beam rig in one setting, without the stiffness of its joints."""
        bench = self.baseline.beam(values.baseline, setting, self.mounting(values))
        for effect, given in values.acting:
            bench = effect.beam(given, bench, setting)
        return bench

    def decays(self, scores: Real) -> Real:
        """(sets,) decay of the exponential window on the records, stated and not, 1/s; for `scores` (unknowns,)."""
        values, found = self.values(scores[: len(self.shared)].tolist()), np.zeros(len(self.baseline.measurement.sets))
        for group in self.groups:
            found[list(group.numbers)] = self.surroundings(values, group.setting).pole[0].real
        return found

    def joints(self, values: Values, setting: Setting, pole: Complex, setups: Real) -> Complex:
        """(states, lines or 1, joints, 3, 3) stiffness of the joints in one setting.

        `setups` (states, joints) are factors by which the cylinders differ after each set-up.
        """
        cylinders, mounting = self.baseline.cylinders(values.baseline), self.baseline.mounting(values.baseline)
        for effect, given in values.acting:
            cylinders = effect.cylinders(given, cylinders, setting.loading)
            mounting = effect.mounting(given, mounting)
            setups = effect.setups(given, setups, setting)
        each = setups.T[:, None, :, None]
        joints = joint_matrices(cylinders.scaled(each, each), mounting)
        for effect, given in values.acting:
            joints = effect.joints(given, joints, pole)
        return joints

    def tester(self, values: Values, points: TesterPoints) -> Complex:
        """(points,) the tester's reading, N/m."""
        return reading_of_tester(self.baseline, values.baseline, values.acting, points)

    # --- readings of both rigs ---

    def state(
        self, scores: Real, gains: Real, setups: Real, blows: Sequence[Real], errors: Sequence[Real]
    ) -> SimulationState:
        """Both rigs at given values of all unknowns.

        Args:
            scores: (shared,).
            gains: (sets,) of hammer and accelerometer together, relative to one.
            setups: (sets, joints) stiffness of each joint after each set-up, relative to one.
            blows: for each set, (2, rows) offsets of the blows from their nodes, m, and their leans, rad.
            errors: for each set, (rows, 2 joints) logarithm of `BlowAmplitudes.error`; empty where no effect follows
                motion.
        """
        groups, values = list[GroupState](), self.values(scores.tolist())
        for group in self.groups:
            own = 1 + setups[group.set_of_state]
            struck = np.concatenate([blows[number] for number in group.numbers], axis=1)
            error = np.concatenate([errors[number] for number in group.numbers])
            moving, setting = None, group.setting
            if self.follows_motion:
                moving = self._moving(values, group, 1 + setups[list(group.numbers)], struck)
                amplitudes = moving.linearisation.blow_amplitudes(moving.linearisation.motion.logarithm)
                setting = replace(setting, blow_amplitudes=replace(amplitudes, error=factors_of(error)))
            around = self.surroundings(values, setting)
            at = replace(around, joints=self.joints(values, setting, around.pole, own))
            groups.append(GroupState(group, setting, own, group.rig.response(at, struck), moving))
        points = self.baseline.measurement.points
        stiffness = np.zeros(0, dtype=complex) if points is None else self.tester(values, points)
        return SimulationState(self, scores, gains, tuple(groups), stiffness)

    def _moving(self, values: Values, group: Group, setups: Real, blows: Real) -> Moving:
        """The joints of a group in the motion that the blows of each row make.

        `setups` (sets, joints) are factors by which the cylinders differ after each set-up.
        """
        setting, sets = group.in_motion, group.in_motion.state
        around, mounting = self.surroundings(values, setting), self.mounting(values)
        pulse = half_sine(around.pole) * setting.peak_force[sets, None]

        def stiffness_at(amplitudes: BlowAmplitudes) -> Complex:
            return self.joints(values, replace(setting, blow_amplitudes=amplitudes), around.pole, setups)

        def motion_of(stiffness: Complex) -> BlowMotion:
            response = group.of_sets.response(replace(around, joints=stiffness), blows)
            moved = response.joint_motion * pulse[..., None, None]
            return BlowMotion(moved, response.joint_receptance, sets, group.measured, mounting)

        found = equivalent_linearisation(stiffness_at, motion_of, setting.peak_force, len(mounting.position))
        mean = found.motion.average @ found.motion.logarithm
        amplitudes = blow_amplitudes_of(mean, np.eye(len(mean)), np.arange(len(mean)))
        return Moving(replace(setting, blow_amplitudes=amplitudes), around.pole, setups, found)

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
class Moving:
    """Joints in motion under blows.

    Attributes:
        setting: in which motion is computed, with the mean motion of each set.
        pole: of its lines.
        setups: (sets, joints) stiffness of each joint in each set, relative to one.
        linearisation: motion and stiffness that agree.
    """

    setting: Setting
    pole: Complex
    setups: Real
    linearisation: EquivalentLinearisation


@dataclass(frozen=True, eq=False)
class GroupState:
    """A group of hammer sets at given values of all unknowns.

    Attributes:
        group: of sets.
        setting: of them, with the motion of the joints where effects follow it.
        setups: (states, joints) stiffness of each joint in each state, relative to one.
        response: of the beam rig.
        moving: the motion with its derivatives; None where no effect follows it.
    """

    group: Group
    setting: Setting
    setups: Real
    response: BeamResponse
    moving: Moving | None

    @cached_property
    def derivatives(self) -> Derivatives:
        """Of the response."""
        return Derivatives(self.response)

    def changes(self, simulation: Simulation, values: Values, moved: Mapping[int, Values], own: bool) -> list[Changes]:
        """Derivatives of the bench in some shared parameters; then, in every state at once, in the factor of each
        joint's stiffness, and in the error of each joint's amplitude.

        Args:
            simulation: of the bench.
            values: of its parameters.
            moved: by index of a parameter, values one `STEP` further in it.
            own: whether the derivatives for the states are wanted, too.
        """
        at, joints = self.response.bench, self.setups.shape[1]
        steps = STEP * np.eye(joints)
        of_states = [(values, step) for step in steps] if own else []
        every = [*((each, 0.0 * steps[0]) for each in moved.values()), *of_states]
        moving = [*("joints" in simulation.affected[place] for place in moved), *(True for _ in of_states)]
        settings = self._settings(simulation, every, moving)
        found = [
            simulation.change(setting, each, place, at, self.setups)
            for (each, _), setting, place in zip(every, settings, moved, strict=False)
        ]
        again = [(step, setting) for (_, step), setting in zip(every, settings, strict=True)][len(moved) :]
        if own and self.setting.blow_amplitudes is not None:
            amplitudes, errors = self.setting.blow_amplitudes, STEP * np.eye(2 * joints)
            moved_amplitudes = [
                replace(amplitudes, error=amplitudes.error * factors_of(error[None])) for error in errors
            ]
            again += [(0.0 * steps[0], replace(self.setting, blow_amplitudes=each)) for each in moved_amplitudes]
        for step, setting in again:
            stiffness = simulation.joints(values, setting, at.pole, self.setups + step)
            found.append({"joints": (stiffness - at.joints) / STEP})
        return found

    def _settings(
        self, simulation: Simulation, every: Sequence[tuple[Values, Real]], changes: Sequence[bool]
    ) -> list[Setting]:
        """The setting with the motion at other values, and with other factors of the joints' stiffness, `STEP` off.

        `changes` says which of them change the joints.
        """
        moving, amplitudes = self.moving, self.setting.blow_amplitudes
        if moving is None or amplitudes is None:
            return [self.setting] * len(every)
        own = moving.linearisation
        stiffness = [
            simulation.joints(values, moving.setting, moving.pole, moving.setups + step) if changed else own.stiffness
            for (values, step), changed in zip(every, changes, strict=True)
        ]
        slopes = own.change((np.array(stiffness) - own.stiffness) / STEP)
        moved = [
            replace(own.blow_amplitudes(own.motion.logarithm + STEP * slope), error=amplitudes.error)
            for slope in slopes
        ]
        return [replace(self.setting, blow_amplitudes=each) for each in moved]


@dataclass(frozen=True, eq=False)
class SimulationState:
    """Both rigs at given values of all unknowns: readings are known, derivatives are computed on demand.

    Attributes:
        simulation: of both.
        scores: (shared,).
        gains: (sets,) relative to one.
        groups: the beam rig with each group of hammer sets.
        stiffness: (points,) the tester's reading, N/m.
    """

    simulation: Simulation
    scores: Real
    gains: Real
    groups: tuple[GroupState, ...]
    stiffness: Complex

    def prediction(self, derivatives: Sequence[int] | None = None, own: bool = True) -> Prediction:
        """Readings of both rigs, with derivatives in some shared parameters, by index; in all by default.

        Derivatives come with those in the unknowns of set-ups and rows, unless these are not wanted.
        """
        return self._whole if derivatives is None else self._prediction(derivatives, own)

    @cached_property
    def _whole(self) -> Prediction:
        return self._prediction(range(self.scores.size), own=True)

    def _prediction(self, wanted: Sequence[int], own: bool) -> Prediction:
        simulation = self.simulation
        scores = self.scores.tolist()
        values = simulation.values(scores)
        moved = {place: simulation.moved(values, place, scores[place] + STEP) for place in wanted}
        offset, scales = simulation.baseline.measurement.tolerances.impact_position, simulation.baseline.scales
        accelerances, by_shared, by_blow, by_setup, by_amplitude = (
            [np.empty(0, dtype=complex)] * self.gains.size for _ in range(5)
        )
        for state in self.groups:
            group, response = state.group, state.response
            columns = state.derivatives.in_parameters(
                state.changes(simulation, values, moved, own) if len(wanted) else []
            )
            for number, rows in zip(group.numbers, group.rows, strict=True):
                gain = 1 + self.gains[number]
                accelerances[number] = gain * response.accelerance[rows]
                by_shared[number] = gain * columns[: len(wanted), rows]
                last = len(wanted) + state.setups.shape[1]
                by_setup[number] = gain * scales.setup_scatter * columns[len(wanted) : last, rows]
                by_amplitude[number] = gain * columns[last:, rows]
                if len(wanted) and own:
                    of_offset, of_lean = state.derivatives.by_blow_offset[rows], state.derivatives.by_lean[rows]
                    by_blow[number] = gain * np.array([offset * of_offset, scales.blow_lean * of_lean])
        return Prediction(
            tuple(accelerances),
            tuple(by_shared),
            tuple(by_blow),
            tuple(by_setup),
            tuple(by_amplitude),
            self.stiffness,
            self._tester_slopes(values, moved),
        )

    def _tester_slopes(self, values: Values, moved: Mapping[int, Values]) -> Complex:
        """(n, points) derivatives of the tester's reading, from values one `STEP` further in each of n parameters."""
        simulation, points = self.simulation, self.simulation.baseline.measurement.points
        slopes = np.zeros((len(moved), self.stiffness.size), dtype=complex)
        if points is None or not moved:
            return slopes
        factor_of = simulation.baseline.factor_in_tester
        share = self.stiffness / factor_of(values.baseline, points)
        for slope, (place, there) in zip(slopes, moved.items(), strict=True):
            parts = simulation.affected[place]
            if "tester" in parts:
                slope[:] = (simulation.tester(there, points) - self.stiffness) / STEP
            elif "factor" in parts:
                slope[:] = (share * factor_of(there.baseline, points) - self.stiffness) / STEP
        return slopes
