"""The simulated bench of both rigs as a function of parameters: the paper's model, and effects on top of it.

Parameters are scores (see `analysis.gap.parameter`): first the baseline's, then each effect's, then for each hammer set
its gain, the stiffness of its joints, and the offsets and leans of its blows. The bench is a smooth function of the
parameters, and differences give its derivatives to five digits. Readings follow from it in `simulation_state`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BeamBench, Mounting, Setting, joint_matrices
from analysis.gap.effect import Effect, Given, acts_on
from analysis.gap.measurement import Indices, Measurement, TesterPoints
from analysis.gap.parameter import Parameter
from analysis.gap.simulation.baseline import Baseline, changed_by
from analysis.gap.simulation.beam_rig_derivatives import Changes
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
