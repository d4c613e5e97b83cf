"""The beam's rig of a case: the accelerometer's reading of a blow, in plane and, a little, out of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np

from simlab.article import SimulatedArticle, SimulatedJoint, lateral_stiffness
from simlab.beam import FreeModes, Load, Real, free_modes
from simlab.case.campaign import MEASURED, ROWS, Campaign, Row
from simlab.case.draw import Case
from simlab.case.effects.base import CylinderState, RowReading, SimulatedEffect
from simlab.coupling import Complex, CoupledBeam, block_diagonal
from simlab.elastomer import REFERENCE_TEMPERATURE

BOUNCE = 4.0
"""Frequency of the bounce of a beam that hangs in two soft cords, Hz."""
CORD_NODES = (2, 10)
CORD_LOSS_FACTOR = 0.1
CORD_SIDEWAYS = 0.05
"""Stiffness of a cord along the beam and out of plane over that across the beam: cords swing."""


@dataclass(frozen=True, eq=False)
class BuiltCase:
    """Article and campaign of a case as its effects made them, and the effects for all that happens later."""

    article: SimulatedArticle
    campaign: Campaign
    effects: tuple[SimulatedEffect, ...]

    @classmethod
    def of(cls, case: Case) -> BuiltCase:
        """Let the effects of `case` touch its article and its campaign."""
        article = reduce(lambda known, effect: effect.built(known), case.effects, case.article)
        campaign = reduce(lambda known, effect: effect.measured(known), case.effects, case.campaign)
        return cls(article, campaign, case.effects)


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

    def read(self, number: int) -> tuple[Complex, Complex]:
        """(rows, lines) accelerance of set `number` (from 0) and its slope with a blow's place along the beam."""
        campaign = self.built.campaign
        setup = campaign.setups[number]
        loads = [self._load(row, number, campaign.straight(row)) for row in ROWS]
        shapes = np.array([[load.in_plane(self.modes), _slope(self.modes, load)] for load in loads])
        if any(effect.roving for effect in self.built.effects):
            clean = np.array(
                [
                    self._accelerance(pair, self.support_stiffness(number, _order(row), setup.peak_force))
                    for row, pair in zip(ROWS, shapes, strict=True)
                ]
            )
        else:
            held = self.support_stiffness(number, 0.0, setup.peak_force)
            clean = self._accelerance(shapes.reshape(2 * len(ROWS), -1), held).reshape(len(ROWS), 2, -1)
        read: Complex = np.array(
            [
                [setup.gain * self._chain(each, row, number) for each in pair]
                for row, pair in zip(ROWS, clean, strict=True)
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
        cylinders = self._cylinders(number, _order(row), peak_force, temperature)
        clean = self._accelerance(load.in_plane(self.modes)[None], self._joints(cylinders))[0]
        if self.built.article.cross_axis and (load.z or load.s):
            clean = clean + self.built.article.cross_axis * self._sideways(load, cylinders)
        return self.built.campaign.setups[number].gain * self._chain(clean, row, number)

    def support_stiffness(self, number: int, order: float, peak_force: float) -> Complex:
        """(lines, 6, 6) dynamic stiffness of both supports in x, y and rotation, in N/m, N and N m.

        The joints are those under a blow of `peak_force` N in set `number`, after the fraction `order` of it.
        """
        return self._joints(self._cylinders(number, order, peak_force, REFERENCE_TEMPERATURE))

    def _cylinders(self, number: int, order: float, peak_force: float, temperature: float) -> list[Complex]:
        """For each joint (2, lines, 3): its lower and its upper cylinder in shear, compression and rotation."""
        deformation = self.built.campaign.deformation(peak_force, self.frequency)
        return [
            cylinders_of(
                joint,
                CylinderState(
                    in_tester=False,
                    joint=name,
                    frequency=self.frequency,
                    deformation=deformation,
                    component=np.full(self.frequency.size, np.sqrt(0.5)),
                    order=np.full(self.frequency.size, order),
                    temperature=temperature,
                    setup=number,
                ),
                self.built.effects,
            )
            for name, joint in self.built.article.joints.items()
        ]

    def _joints(self, cylinders: list[Complex]) -> Complex:
        article = self.built.article
        if self.suspended:
            return self._cords((CORD_SIDEWAYS, 1.0, 0.0))
        held = [joint.matrix(own) for joint, own in zip(article.joints.values(), cylinders, strict=True)]
        return reduce(
            lambda known, effect: effect.joints(known, article, self._omega),
            self.built.effects,
            block_diagonal(held, self.frequency.size),
        )

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
        offset = self.built.campaign.setups[number].offsets[MEASURED.index(row)] if row in MEASURED else 0.0
        length = self.built.article.beam.length
        return replace(load, position=length - abs(length - abs(load.position + offset)))

    def _chain(self, accelerance: Complex, row: Row, number: int) -> Complex:
        position = self.built.campaign.straight(row).position
        reading = RowReading(row, number, position, _order(row), self.frequency, self.built.article)
        return reduce(lambda known, effect: effect.read(known, reading), self.built.effects, accelerance)


def cylinders_of(joint: SimulatedJoint, state: CylinderState, effects: tuple[SimulatedEffect, ...]) -> Complex:
    """(2, n, 3) the lower and the upper cylinder of a joint with the effects."""
    found = {
        own: reduce(
            lambda known, effect: effect.cylinder(known, state),
            effects,
            own.dynamic_stiffness(state.deformation, state.frequency, state.temperature),
        )
        for own in set(joint.cylinders)
    }
    return np.array([found[own] for own in joint.cylinders])


def _order(row: Row) -> float:
    """Fraction of a set that is over when a row is struck; rows that nobody strikes belong to its middle."""
    return MEASURED.index(row) / (len(MEASURED) - 1) if row in MEASURED else 0.5


def _slope(modes: FreeModes, load: Load) -> Real:
    """(modes,) change of a load's shape as its place moves along the beam; the end faces are struck where they are."""
    return load.y * modes.slope("y", load.position)
