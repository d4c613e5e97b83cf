"""The beam's rig of a case: the accelerometer's reading of a blow, in plane and, a little, out of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np

from simlab.article import SimulatedArticle, SimulatedJoint, lateral_stiffness, with_kinks
from simlab.beam import FreeModes, Load, Real, free_modes
from simlab.case.blows import half_sine_spectrum
from simlab.case.campaign import HIGHEST_LINE, MEASURED, ROWS, Campaign, Row
from simlab.case.draw import Case
from simlab.case.effects.base import CylinderState, RowReading, SimulatedEffect
from simlab.coupling import Complex, CoupledBeam, block_diagonal
from simlab.elastomer import REFERENCE_TEMPERATURE, SimulatedCylinder

BOUNCE = 4.0
"""Frequency of the bounce of a beam that hangs in two soft cords, Hz."""
CORD_NODES = (2, 10)
CORD_LOSS_FACTOR = 0.1
COARSE = 2.0
"""Hz between lines where only the joints' motion is asked for."""
FIRST_AMPLITUDE, LEAST_AMPLITUDE = 3e-6, 1e-9
"""Amplitude of a cylinder, m zero to peak: start value of the iteration, and lower bound of its result."""
TURNS, SETTLED = 60, 1e-3
CORD_SIDEWAYS = 0.05
"""Stiffness of a cord along the beam and out of plane over that across the beam: cords swing."""


@dataclass(frozen=True, eq=False)
class BuiltCase:
    """Article and campaign of a case as its effects made them, and the effects for all that happens later, by rank."""

    article: SimulatedArticle
    campaign: Campaign
    effects: tuple[SimulatedEffect, ...]

    @classmethod
    def of(cls, case: Case) -> BuiltCase:
        """Let the effects of `case` touch its article and its campaign."""
        effects = tuple(sorted(case.effects, key=lambda effect: effect.rank))
        article = reduce(lambda known, effect: effect.built(known), effects, case.article)
        campaign = reduce(lambda known, effect: effect.measured(known), effects, case.campaign)
        return cls(with_kinks(article), campaign, effects)

    @property
    def follows_each_blow(self) -> bool:
        """Whether each joint depends on its own motion under each blow."""
        return self.campaign.amplitude_power > 0.0 and any(effect.felt for effect in self.effects)

    def without_window(self) -> BuiltCase:
        """The same case with the window of its records taken off."""
        return replace(self, effects=tuple(effect for effect in self.effects if not effect.window_decay))


class Stand:
    """The beam's rig at `frequency` (lines,) Hz, above zero: on its joints, or `suspended` in two cords.

    Raises:
        ValueError: a line is not above zero.
    """

    def __init__(self, built: BuiltCase, frequency: Real, *, suspended: bool = False) -> None:
        self.built, self.frequency, self.suspended = built, frequency, suspended
        article, effects = built.article, built.effects
        self.modes = free_modes(article.beam)
        decay = sum(effect.window_decay for effect in effects)
        self._omega: Complex = np.asarray(2 * np.pi * frequency - 1j * decay, dtype=np.complex128)
        sensor = self.modes.shape("y", article.sensor_position)
        self._output = reduce(lambda shape, effect: effect.sensed(shape, self.modes, article), effects, sensor)
        self.supports = self._support_shapes(self.modes, "xyr")
        carried = [a for effect in effects for a in effect.attachments(self.modes, article, self._omega)]
        self._carried = [attachment.stiffness for attachment in carried]
        places = np.concatenate([self.supports, *(attachment.shapes for attachment in carried)])
        self._beam = self._coupled(self.modes, places)

    def read(self, number: int, rows: tuple[Row, ...] = ROWS) -> tuple[Complex, Complex]:
        """(rows, lines) accelerance of set `number` (from 0) and its slope with a blow's place along the beam."""
        campaign = self.built.campaign
        setup = campaign.setups[number]
        loads = [self._load(row, number, campaign.straight(row)) for row in rows]
        shapes = np.array(
            [[load.in_plane(self.modes), _slope(self.modes, row, load)] for row, load in zip(rows, loads, strict=True)]
        )
        force = setup.peak_force
        if any(effect.roving or effect.felt for effect in self.built.effects):
            cylinders = [
                self._cylinders(number, _order(row), force, REFERENCE_TEMPERATURE, felt)
                for row, felt in zip(rows, self._felt(number, rows, shapes[:, 0], force), strict=True)
            ]
            held = [self._joints(own) for own in cylinders]
            clean = np.array([self._accelerance(pair, own) for pair, own in zip(shapes, held, strict=True)])
        else:
            alike = self._cylinders(number, 0.0, force, REFERENCE_TEMPERATURE)
            cylinders = [alike] * len(rows)
            clean = self._accelerance(shapes.reshape(2 * len(rows), -1), self._joints(alike))
            clean = clean.reshape(len(rows), 2, -1)
        if self.built.article.cross_axis and any(load.z or load.s for load in loads):
            sideways = [self._sideways(load, own) for load, own in zip(loads, cylinders, strict=True)]
            clean[:, 0] += self.built.article.cross_axis * np.array(sideways)
        read: Complex = np.array(
            [
                [setup.gain * self._chain(each, row, number) for each in pair]
                for row, pair in zip(rows, clean, strict=True)
            ]
        )
        return read[:, 0], read[:, 1]

    def blow(
        self,
        row: Row,
        number: int,
        peak_force: float,
        load: Load | None = None,
        temperature: float = REFERENCE_TEMPERATURE,
    ) -> Complex:
        """(lines,) accelerance that the accelerometer reads of one blow, (m/s^2)/N.

        Args:
            row, number: what is struck, in which set (from 0).
            peak_force: N.
            load: the blow as the operator strikes; without it, straight on the mark.
            temperature: of the cylinders, deg C.
        """
        load = self._load(row, number, self.built.campaign.straight(row) if load is None else load)
        shape = load.in_plane(self.modes)[None]
        (felt,) = self._felt(number, (row,), shape, peak_force)
        cylinders = self._cylinders(number, _order(row), peak_force, temperature, felt)
        clean = self._accelerance(shape, self._joints(cylinders))[0]
        if self.built.article.cross_axis and (load.z or load.s):
            clean = clean + self.built.article.cross_axis * self._sideways(load, cylinders)
        return self.built.campaign.setups[number].gain * self._chain(clean, row, number)

    def support_stiffness(self, number: int, order: float, peak_force: float, felt: Real | None = None) -> Complex:
        """(lines, 6, 6) dynamic stiffness of both supports in x, y and rotation, in N/m, N and N m.

        The joints are those under a blow of `peak_force` N in set `number`, after the fraction `order` of it; `felt`
        (joints, 2, 2) is the amplitude in m of each cylinder, lower and upper, in shear and in compression.
        """
        return self._joints(self._cylinders(number, order, peak_force, REFERENCE_TEMPERATURE, felt))

    def usual_stiffness(self, number: int) -> Complex:
        """(lines, 6, 6) as `support_stiffness` in the middle of set `number`, its mean over what is struck there."""
        peak_force, straight = self.built.campaign.setups[number].peak_force, self.built.campaign.straight
        loads = np.array([self._load(row, number, straight(row)).in_plane(self.modes) for row in MEASURED])
        felt = self._felt(number, MEASURED, loads, peak_force) if self.built.follows_each_blow else [None]
        return np.asarray(np.mean([self.support_stiffness(number, 0.5, peak_force, own) for own in felt], axis=0))

    def _cylinders(
        self, number: int, order: float, peak_force: float, temperature: float, felt: Real | None = None
    ) -> list[Complex]:
        """For each joint (2, lines, 3): its lower and its upper cylinder in shear, compression and rotation."""
        lines = self.frequency.size
        nuisances = self.built.campaign.nuisances
        found = []
        for i, (name, joint) in enumerate(self.built.article.joints.items()):
            state = CylinderState(
                in_tester=False,
                joint=name,
                frequency=self.frequency,
                deformation=self.built.campaign.deformation(peak_force, self.frequency),
                component=np.full(lines, np.sqrt(0.5)),
                order=np.full(lines, order),
                temperature=temperature,
                setup=number,
            )
            lower, upper = (
                (state, state)
                if felt is None
                else (replace(state, felt=np.broadcast_to(own, (lines, 2))) for own in felt[i])
            )
            scale = 1.0 if nuisances is None else float(nuisances.stiffness[number, i])
            found.append(scale * cylinders_of(joint, (lower, upper), self.built.effects))
        return found

    def _felt(self, number: int, rows: tuple[Row, ...], loads: Real, peak_force: float) -> list[Real] | list[None]:
        """For each load of `loads` (rows, modes) how a blow of `peak_force` N moves both joints' cylinders, m.

        They are (joints, 2, 2) as for `support_stiffness`, or None where nothing depends on them. Equivalent
        linearisation: the stiffness of the joints is that at the amplitude which the blow causes at this stiffness. One
        amplitude counts for a whole blow: the mean over its record by `amplitude_power`.
        """
        if self.suspended or not self.built.follows_each_blow:
            return [None] * len(loads)
        return [self._coarse.settled(number, row, load, peak_force) for row, load in zip(rows, loads, strict=True)]

    def settled(self, number: int, row: Row, load: Real, peak_force: float) -> Real:
        """(joints, 2, 2) amplitudes in m that the blow causes in joints with the stiffness at these amplitudes.

        Raises:
            RuntimeError: they do not settle.
        """
        pulse = half_sine_spectrum(self.frequency, peak_force, self.built.campaign.pulse_width)
        felt = np.full((2, 2, 2), FIRST_AMPLITUDE)
        for _ in range(TURNS):
            cylinders = self._cylinders(number, _order(row), peak_force, REFERENCE_TEMPERATURE, felt)
            held = self._joints(cylinders)
            if self._carried:
                held = block_diagonal([held, *self._carried], self.frequency.size)
            motion = self._deformation(cylinders, self._beam.motion(load, held)[:, :6])
            found = self._amplitudes(motion * pulse[:, None])
            step = np.log(found / felt)
            felt = np.asarray(felt * np.exp(0.7 * step))
            if np.max(np.abs(step)) < SETTLED:
                return felt
        raise RuntimeError(f"the amplitudes of a blow on {row.name} do not settle")

    def _amplitudes(self, motion: Complex) -> Real:
        """(joints, 2, 2) mean amplitude of each cylinder in shear and compression, of a `motion` (lines, 6) in m s."""
        power, found = self.built.campaign.amplitude_power, []
        whole = np.concatenate([motion[:1].real, motion])
        samples = 2 * (len(whole) - 1)
        over_time = np.fft.irfft(whole, samples, axis=0) * samples * (self.frequency[1] - self.frequency[0])
        turn = np.abs(np.cos(np.linspace(0.0, np.pi, 181)))
        of_a_sine = (np.mean(turn ** (2 + power)) / np.mean(turn**2)) ** (1 / power)
        for i, joint in enumerate(self.built.article.joints.values()):
            moved = np.abs(np.einsum("cij,tj->tci", joint.local()[:, :2], over_time[:, 3 * i : 3 * i + 3]))
            mean = (np.sum(moved ** (2 + power), axis=0) / np.sum(moved**2, axis=0)) ** (1 / power)
            found.append(mean / of_a_sine)
        return np.asarray(np.maximum(np.array(found), LEAST_AMPLITUDE))

    @cached_property
    def _coarse(self) -> Stand:
        """The same stand at lines of its own, for the motion of joints, which dies out in half a second.

        That motion is the same whatever is read of it: at which lines, and under which window.
        """
        lines: Real = np.asarray(np.arange(1, round(HIGHEST_LINE / COARSE) + 1) * COARSE, dtype=np.float64)
        return Stand(self.built.without_window(), lines, suspended=self.suspended)

    def _joints(self, cylinders: list[Complex]) -> Complex:
        article = self.built.article
        if self.suspended:
            return self._cords((CORD_SIDEWAYS, 1.0, 0.0))
        return reduce(
            lambda known, effect: effect.joints(known, article, self._omega),
            self.built.effects,
            self._standing(cylinders),
        )

    def _standing(self, cylinders: list[Complex]) -> Complex:
        """(lines, 6, 6) of both joints by their cylinders alone."""
        joints = self.built.article.joints.values()
        held = [joint.matrix(own) for joint, own in zip(joints, cylinders, strict=True)]
        return block_diagonal(held, self.frequency.size)

    def _deformation(self, cylinders: list[Complex], motion: Complex) -> Complex:
        """(lines, 6) of the joints where the beam has a `motion` (lines, 6): less what they stand on follows of it."""
        known = self._standing(cylinders)
        for effect in self.built.effects:
            motion = effect.deformed(motion, known, self._omega)
            known = effect.joints(known, self.built.article, self._omega)
        return motion

    def _cords(self, directions: tuple[float, ...]) -> Complex:
        """(lines, N, N) both cords: stiffness across the beam times `directions`."""
        across = self.built.article.beam.mass * (2 * np.pi * BOUNCE) ** 2 / len(CORD_NODES)
        cord = across * (1 + 1j * CORD_LOSS_FACTOR) * np.diag(directions)
        return block_diagonal([cord] * len(CORD_NODES), self.frequency.size)

    def _support_shapes(self, modes: FreeModes, directions: str) -> Real:
        nodes, joints = self.built.campaign.node_positions, self.built.article.joints.values()
        places = [nodes[node - 1] for node in CORD_NODES] if self.suspended else [joint.position for joint in joints]
        return np.array([modes.shape(direction, place) for place in places for direction in directions])

    def _coupled(self, modes: FreeModes, places: Real) -> CoupledBeam:
        article = self.built.article
        return CoupledBeam(modes, places, self._omega, article.loss_factor, article.damping_scale)

    def _accelerance(self, loads: Real, held: Complex) -> Complex:
        """(loads, lines) of the beam on its supports, with what else it carries."""
        stiffness = block_diagonal([held, *self._carried], self.frequency.size) if self._carried else held
        return self._beam.accelerance(self._output, loads, stiffness)

    @cached_property
    def _beam_on_edge(self) -> CoupledBeam:
        modes = free_modes(self.built.article.beam.on_edge())
        return self._coupled(modes, self._support_shapes(modes, "yr"))

    def _sideways(self, load: Load, cylinders: list[Complex]) -> Complex:
        """(lines,) accelerance out of plane at the accelerometer."""
        beam = self._beam_on_edge
        sensor = beam.modes.shape("y", self.built.article.sensor_position)
        if self.suspended:
            held = self._cords((CORD_SIDEWAYS, 0.0))
        else:
            held = block_diagonal([lateral_stiffness(own) for own in cylinders], self.frequency.size)
        return np.asarray(beam.accelerance(sensor, load.out_of_plane(beam.modes)[None], held)[0])

    def _load(self, row: Row, number: int, load: Load) -> Load:
        """How a blow meets the beam in set `number`; what would be off the end is as far inside it."""
        load = reduce(lambda known, effect: effect.struck(known, row), self.built.effects, load)
        if self.built.campaign.nuisances is not None:
            load = self.built.campaign.nuisances.struck(load, ROWS.index(row), number)
        offset = self.built.campaign.setups[number].offsets[MEASURED.index(row)] if row in MEASURED else 0.0
        length = self.built.article.beam.length
        return replace(load, position=length - abs(length - abs(load.position + offset)))

    def _chain(self, accelerance: Complex, row: Row, number: int) -> Complex:
        position = self.built.campaign.straight(row).position
        reading = RowReading(row, number, position, _order(row), self.frequency, self.built.article, self._omega)
        nuisances = self.built.campaign.nuisances
        if nuisances is not None:
            accelerance = accelerance * nuisances.error(ROWS.index(row), number, self.frequency)
        return reduce(lambda known, effect: effect.read(known, reading), self.built.effects, accelerance)


def cylinders_of(
    joint: SimulatedJoint, states: tuple[CylinderState, CylinderState], effects: tuple[SimulatedEffect, ...]
) -> Complex:
    """(2, n, 3) the lower and the upper cylinder of a joint with the effects, each in its own of the `states`."""

    def found(own: SimulatedCylinder, state: CylinderState) -> Complex:
        stiffness = own.dynamic_stiffness(state.deformation, state.frequency, state.temperature)
        return reduce(lambda known, effect: effect.cylinder(known, state), effects, stiffness)

    (lower, upper), (below, above) = joint.cylinders, states
    first = found(lower, below)
    return np.array([first, first if (upper, above) == (lower, below) else found(upper, above)])


def _order(row: Row) -> float:
    """Fraction of a set that is over when a row is struck; rows that nobody strikes belong to its middle."""
    return MEASURED.index(row) / (len(MEASURED) - 1) if row in MEASURED else 0.5


def _slope(modes: FreeModes, row: Row, load: Load) -> Real:
    """(modes,) change of a load's shape as its place moves along the beam; the end faces are struck where they are."""
    across = load.y if row.direction == "y" else 0.0
    return across * modes.slope("y", load.position)
