"""Readings of both rigs at given values of all unknowns, and their derivatives.

The bench follows from the parameters (`two_rigs`), the readings from the bench. Accelerances as a function of the
bench, with their sharp resonances, are differentiated analytically in `beam_rig_derivatives`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BlowAmplitudes, Setting
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
from analysis.gap.simulation.hammer_groups import Group
from analysis.gap.simulation.two_rigs import STEP, Simulation, Values


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


def state_of(
    simulation: Simulation, scores: Real, gains: Real, setups: Real, blows: Sequence[Real], errors: Sequence[Real]
) -> SimulationState:
    """Both rigs at given values of all unknowns.

    Args:
        simulation: of both rigs.
        scores: (shared,).
        gains: (sets,) of hammer and accelerometer together, relative to one.
        setups: (sets, joints) stiffness of each joint after each set-up, relative to one.
        blows: for each set, (2, rows) offsets of the blows from their nodes, m, and their leans, rad.
        errors: for each set, (rows, 2 joints) logarithm of `BlowAmplitudes.error`; empty where no effect follows
            motion.
    """
    groups, values = list[GroupState](), simulation.values(scores.tolist())
    for group in simulation.groups:
        own = 1 + setups[group.set_of_state]
        struck = np.concatenate([blows[number] for number in group.numbers], axis=1)
        error = np.concatenate([errors[number] for number in group.numbers])
        moving, setting = None, group.setting
        if simulation.follows_motion:
            moving = _moving(simulation, values, group, 1 + setups[list(group.numbers)], struck)
            amplitudes = moving.linearisation.blow_amplitudes(moving.linearisation.motion.logarithm)
            setting = replace(setting, blow_amplitudes=replace(amplitudes, error=factors_of(error)))
        around = simulation.surroundings(values, setting)
        at = replace(around, joints=simulation.joints(values, setting, around.pole, own))
        groups.append(GroupState(group, setting, own, group.rig.response(at, struck), moving))
    points = simulation.baseline.measurement.points
    stiffness = np.zeros(0, dtype=complex) if points is None else simulation.tester(values, points)
    return SimulationState(simulation, scores, gains, tuple(groups), stiffness)


def _moving(simulation: Simulation, values: Values, group: Group, setups: Real, blows: Real) -> Moving:
    """The joints of a group in the motion that the blows of each row make.

    `setups` (sets, joints) are factors by which the cylinders differ after each set-up.
    """
    setting, sets = group.in_motion, group.in_motion.state
    around, mounting = simulation.surroundings(values, setting), simulation.mounting(values)
    pulse = half_sine(around.pole) * setting.peak_force[sets, None]

    def stiffness_at(amplitudes: BlowAmplitudes) -> Complex:
        return simulation.joints(values, replace(setting, blow_amplitudes=amplitudes), around.pole, setups)

    def motion_of(stiffness: Complex) -> BlowMotion:
        response = group.of_sets.response(replace(around, joints=stiffness), blows)
        moved = response.joint_motion * pulse[..., None, None]
        return BlowMotion(moved, response.joint_receptance, sets, group.measured, mounting)

    found = equivalent_linearisation(stiffness_at, motion_of, setting.peak_force, len(mounting.position))
    mean = found.motion.average @ found.motion.logarithm
    amplitudes = blow_amplitudes_of(mean, np.eye(len(mean)), np.arange(len(mean)))
    return Moving(replace(setting, blow_amplitudes=amplitudes), around.pole, setups, found)
