"""What both rigs would read of a case without noise: accelerances and dynamic stiffnesses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from simlab.assembly import Complex
from simlab.beam import FreeModes, Real
from simlab.case.article import JOINT_NAMES, Article, joint_matrix
from simlab.case.campaign import CONFIGURATIONS, MEASURED, ROWS, Campaign, Points, Row
from simlab.case.coupling import Attachment, CoupledBar
from simlab.case.draw import Case
from simlab.case.effects.base import Effect, Seen, Strike
from simlab.case.effects.structure import cached_modes
from simlab.supported_beam import Load


@dataclass(frozen=True, eq=False)
class Simulated:
    """What a case reads without noise.

    Attributes:
        frequency: (lines,) Hz, from the first line above zero.
        rows: what was struck, first those measured, then those asked for, which are struck where the drawing says.
        accelerance: (sets, rows, lines) of 3y in (m/s^2)/N, with each set's gain and misplaced marks.
        slope: the same per metre that a blow is off along the bar, (m/s^2)/N/m.
        stiffness: (points,) k + ih in N/m at the tester's points in their order, with its gain.
        distortion: (points,) total harmonic distortion of the force, percent.
        campaign: as the effects made it.
    """

    frequency: Real
    rows: tuple[Row, ...]
    accelerance: Complex
    slope: Complex
    stiffness: Complex
    distortion: Real
    campaign: Campaign


def stand_of(case: Case, frequency: Real) -> Stand:
    """The beam's rig of a case with its effects, at `frequency` (lines,) Hz, above zero."""
    article = reduce(lambda known, effect: effect.built(known), case.effects, case.article)
    campaign = reduce(lambda known, effect: effect.measured(known), case.effects, case.campaign)
    return Stand(article, campaign, case.effects, frequency)


def simulate(case: Case, *, without_effects: bool = False, frequency: Real | None = None) -> Simulated:
    """Both rigs' noiseless readings, the stand's at `frequency` (lines,) Hz above zero or at the campaign's lines.

    `without_effects` gives those of the paper's model of the same article.
    """
    lines = case.campaign.frequency if frequency is None else frequency
    stand = stand_of(replace(case, effects=()) if without_effects else case, lines)
    article, campaign, effects = stand.article, stand.campaign, stand.effects
    sets = [stand.read(number) for number in range(len(campaign.setups))]
    stiffness = direct_stiffness(article, campaign, effects)
    return Simulated(
        frequency=stand.frequency,
        rows=ROWS,
        accelerance=np.array([accelerance for accelerance, _ in sets]),
        slope=np.array([slopes for _, slopes in sets]),
        stiffness=stiffness,
        distortion=_distortion(article, campaign, effects, stiffness),
        campaign=campaign,
    )


class Stand:
    """The beam's rig as the effects made it, at `frequency` (lines,) Hz, above zero."""

    def __init__(self, article: Article, campaign: Campaign, effects: tuple[Effect, ...], frequency: Real) -> None:
        self.article = article
        self.campaign = campaign
        self.effects = effects
        self.frequency = frequency
        self.modes = cached_modes(article.bar)
        decay = sum(effect.window_decay for effect in effects)
        omega: Complex = np.asarray(2 * np.pi * frequency - 1j * decay, dtype=np.complex128)
        self.bar = CoupledBar(self.modes, article, omega)
        sensor = self.modes.shape("y", article.sensor_position)
        self.output = reduce(lambda shape, effect: effect.sensed(shape, self.modes, article), effects, sensor)
        self.places = np.array(
            [self.modes.shape(d, article.joints[name].position) for name in JOINT_NAMES for d in "xyr"]
        )
        self.carried = [a for effect in effects for a in effect.attachments(self.modes, article, omega)]

    def read(self, number: int) -> tuple[Complex, Complex]:
        """(rows, lines) accelerance of set `number` (from 0) and its slope with a blow's place along the bar."""
        setup = self.campaign.setups[number]
        loads = [self._load(row, number) for row in ROWS]
        shapes = np.array([_shape(self.modes, load) for load in loads])
        slopes = np.array([_slope(self.modes, load) for load in loads])
        count = len(ROWS)
        if any(effect.roving for effect in self.effects):
            orders = [_order(row) for row in ROWS]
            both = np.stack([shapes, slopes], axis=1)
            joints = [self.joints(number, order, setup.peak_force) for order in orders]
            parts = [self._accelerance(rows, held) for rows, held in zip(both, joints, strict=True)]
            clean = np.concatenate([[part[0] for part in parts], [part[1] for part in parts]])
        else:
            clean = self._accelerance(np.concatenate([shapes, slopes]), self.joints(number, 0.0, setup.peak_force))
        read = [setup.gain * self._chain(clean[i], ROWS[i % count], number) for i in range(2 * count)]
        return np.array(read[:count]), np.array(read[count:])

    def blow(self, row: Row, number: int, peak_force: float, place: float) -> Complex:
        """(lines,) accelerance read of one blow of `peak_force` N in set `number`, `place` m beside its row's mark."""
        load = _shape(self.modes, self._load(row, number, place))
        clean = self._accelerance(load[None], self.joints(number, _order(row), peak_force))[0]
        return self.campaign.setups[number].gain * self._chain(clean, row, number)

    def _accelerance(self, loads: Real, joints: Attachment) -> Complex:
        """(loads, lines) of the bar on its joints, with what else it carries."""
        return self.bar.accelerance(self.output, loads, [joints, *self.carried])

    def joints(self, number: int, order: float, peak_force: float) -> Attachment:
        """Both joints under a blow of `peak_force` N in set `number`, after the fraction `order` of it."""
        frequency = self.frequency
        deformation = self.campaign.deformation(peak_force, frequency)
        joints = np.zeros((frequency.size, 6, 6), dtype=np.complex128)
        for i, name in enumerate(JOINT_NAMES):
            seen = Seen(
                in_tester=False,
                joint=name,
                frequency=frequency,
                deformation=deformation,
                component=np.full(frequency.size, np.sqrt(0.5)),
                order=np.full(frequency.size, order),
                setup=number,
            )
            cylinder = _cylinder(self.article, name, seen, self.effects)
            joints[:, 3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = joint_matrix(name, self.article.joints[name], cylinder)
        for effect in self.effects:
            joints = effect.joints(joints, self.article, self.bar.omega)
        return Attachment(self.places, joints)

    def _load(self, row: Row, number: int, place: float = 0.0) -> Load:
        """Where a row is really struck, `place` m beside its mark; what would be off the end is as far inside it."""
        position = self._position(row)
        load = Load(position, **{row.direction: 1.0})
        load = reduce(lambda known, effect: effect.struck(known, row), self.effects, load)
        if row in MEASURED:
            place += self.campaign.setups[number].offsets[MEASURED.index(row)]
        if row.direction == "y":
            load = replace(load, position=load.position + place)
        length = self.article.bar.length
        return replace(load, position=length - abs(length - abs(load.position)))

    def _chain(self, accelerance: Complex, row: Row, number: int) -> Complex:
        strike = Strike(row, number, self._position(row), _order(row), self.frequency, self.article)
        return reduce(lambda known, effect: effect.read(known, strike), self.effects, accelerance)

    def _position(self, row: Row) -> float:
        return self.campaign.node_positions[row.node - 1]


def direct_stiffness(
    article: Article, campaign: Campaign, effects: tuple[Effect, ...], stretch: float = 1.0
) -> Complex:
    """(points,) dynamic stiffness as the tester gives it, N/m, at `stretch` times each point's amplitude."""
    stiffness = specimen_stiffness(article, campaign.points, effects, stretch)
    for effect in effects:
        stiffness = effect.tested(stiffness, campaign.points)
    return campaign.tester_gain * stiffness


def specimen_stiffness(article: Article, points: Points, effects: tuple[Effect, ...], stretch: float = 1.0) -> Complex:
    """(points,) dynamic stiffness of the specimens themselves, N/m, at `stretch` times each point's amplitude.

    Compression is one cylinder, b; shear a pair, 2 a; angled a pair, each bringing half of a + b + (b - a) sin 2 lean,
    as k22 in the stand, and deformed by cos 45 of the whole in each direction.
    """
    stiffness = np.zeros(points.order.size, dtype=np.complex128)
    angled = points.configuration == CONFIGURATIONS.index("angled")
    for i, name in enumerate(JOINT_NAMES):
        seen = Seen(
            in_tester=True,
            joint=name,
            frequency=points.frequency,
            deformation=points.amplitude * stretch,
            component=np.where(angled, np.sqrt(0.5), 1.0),
            order=points.order,
        )
        shear, compression, _ = _cylinder(article, name, seen, effects).T
        leaning = np.sin(2 * np.radians(article.joints[name].lean_deg))
        ways = [compression, 2 * shear, shear + compression + leaning * (compression - shear)]
        stiffness = np.where(points.specimen == i, np.choose(points.configuration, ways), stiffness)
    return stiffness


def _cylinder(article: Article, name: str, seen: Seen, effects: tuple[Effect, ...]) -> Complex:
    linear = np.broadcast_to(article.joints[name].cylinder, (seen.frequency.size, 3))
    return reduce(lambda known, effect: effect.cylinder(known, seen), effects, linear)


def _distortion(article: Article, campaign: Campaign, effects: tuple[Effect, ...], stiffness: Complex) -> Real:
    """(points,) percent: 0.15 of a good tester, and what a stiffness that changes with amplitude adds.

    For a law k(x) smooth in x the third harmonic is of the order of a tenth of d ln k / d ln x.
    """
    step = 0.05
    change = direct_stiffness(article, campaign, effects, 1.0 + step) / stiffness - 1.0
    return 0.15 + 100.0 * 0.05 * np.abs(change) / step


def _order(row: Row) -> float:
    """Fraction of a set that is over when a row is struck; rows that nobody strikes belong to its middle."""
    return MEASURED.index(row) / (len(MEASURED) - 1) if row in MEASURED else 0.5


def _shape(modes: FreeModes, load: Load) -> Real:
    return load.x * modes.shape("x", load.position) + load.y * modes.shape("y", load.position)


def _slope(modes: FreeModes, load: Load) -> Real:
    """(modes,) change of a load's shape as its place moves along the bar; the end faces are struck where they are."""
    return load.y * modes.slope("y", load.position)
