"""Readings of both rigs without noise: accelerances and dynamic stiffnesses."""

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from simlab.beam import Real
from simlab.case.campaign import CONFIGURATIONS, ROWS, Campaign, Points, Row
from simlab.case.draw import Case
from simlab.case.effects.base import CylinderState
from simlab.coupling import Complex
from simlab.stand import BuiltCase, Stand, cylinders_of

ITERATIONS = 12
"""For the motion of a specimen on a frame that gives; each is nearer by a factor of three or more."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """The readings of a case without noise.

    Attributes:
        frequency: (lines,) Hz, from the first line above zero.
        rows: rows struck: first those measured, then those asked for, which are struck at their drawn places.
        accelerance: (sets, rows, lines) of 3y in (m/s^2)/N, with each set's gain and misplaced marks.
        slope: derivative of `accelerance` in the place of the blow along the beam, (m/s^2)/N/m.
        stiffness: (points,) k + ih in N/m at the tester's points in their order, with its gain.
        distortion: (points,) total harmonic distortion of the force, percent.
        campaign: as the effects changed it.
    """

    frequency: Real
    rows: tuple[Row, ...]
    accelerance: Complex
    slope: Complex
    stiffness: Complex
    distortion: Real
    campaign: Campaign


def simulate(case: Case, *, without_effects: bool = False, frequency: Real | None = None) -> Simulated:
    """Noiseless readings of both rigs, the stand's at `frequency` (lines,) Hz above zero or at the campaign's lines.

    `without_effects` gives the readings of the same article without its effects.
    """
    built = BuiltCase.of(replace(case, effects=()) if without_effects else case)
    stand = Stand(built, case.campaign.frequency if frequency is None else frequency)
    sets = [stand.read(number) for number in range(len(built.campaign.setups))]
    stiffness = direct_stiffness(built)
    return Simulated(
        frequency=stand.frequency,
        rows=ROWS,
        accelerance=np.array([accelerance for accelerance, _ in sets]),
        slope=np.array([slopes for _, slopes in sets]),
        stiffness=stiffness,
        distortion=_distortion(built, stiffness),
        campaign=built.campaign,
    )


def direct_stiffness(built: BuiltCase, stretch: float = 1.0) -> Complex:
    """(points,) dynamic stiffness as the tester gives it, N/m, at `stretch` times each point's amplitude."""
    points = built.campaign.points
    return as_tested(built, moved_specimen(built, points, stretch), points)


def as_tested(built: BuiltCase, stiffness: Complex, points: Points) -> Complex:
    """(points,) the specimens' `stiffness` (points,) as the tester gives it, N/m."""
    found = reduce(lambda known, effect: effect.tested(known, points), built.effects, stiffness)
    gains = 1.0 if built.campaign.nuisances is None else built.campaign.nuisances.gains[points.configuration]
    return np.asarray(built.campaign.tester_gain * gains * found)


def moved_specimen(built: BuiltCase, points: Points, stretch: float = 1.0) -> Complex:
    """(points,) as `specimen_stiffness`, where the machine moves by that: a frame that gives takes its part of it."""
    own = specimen_stiffness(built, points, stretch)
    for _ in range(ITERATIONS if any(effect.reduces_motion for effect in built.effects) else 0):
        own = specimen_stiffness(built, points, stretch * _specimen_share(built, own, points))
    return own


def _specimen_share(built: BuiltCase, own: Complex, points: Points) -> Real:
    """(points,) part of the machine's amplitude that a specimen of stiffness `own` sees."""
    share, known = np.ones(own.size), own
    for effect in built.effects:
        found = effect.tested(known, points)
        if effect.reduces_motion:
            share = share * np.abs(found / known)
        known = found
    return np.asarray(share)


def specimen_stiffness(built: BuiltCase, points: Points, stretch: float | Real = 1.0) -> Complex:
    """(points,) dynamic stiffness of the specimens themselves, N/m, at `stretch` times each point's amplitude.

    Compression is the lower cylinder, b; shear both, a + a; angled both, each bringing half of
    a + b + (b - a) sin 2 lean, as k22 in the stand, and deformed by cos 45 of the whole in each direction.
    """
    stiffness = np.zeros(points.order.size, dtype=np.complex128)
    angled = points.configuration == CONFIGURATIONS.index("angled")
    for i, (name, joint) in enumerate(built.article.joints.items()):
        state = CylinderState(
            in_tester=True,
            joint=name,
            frequency=points.frequency,
            deformation=points.amplitude * stretch,
            component=np.where(angled, np.sqrt(0.5), 1.0),
            order=points.order,
            temperature=points.temperature,
            configuration=points.configuration,
        )
        lower, upper = _scale(built, i) * cylinders_of(joint, (state, state), built.effects)
        shear, compression = 0.5 * (lower + upper)[:, :2].T
        leaning = np.mean(np.sin(2 * np.radians(joint.lean_deg + joint.splay_deg * np.array([0.0, 1.0]))))
        ways = [lower[:, 1], 2 * shear, shear + compression + leaning * (compression - shear)]
        stiffness = np.where(points.specimen == i, np.choose(points.configuration, ways), stiffness)
    return stiffness


def _scale(built: BuiltCase, joint: int) -> float:
    """Factor on the cylinders of a joint as they are mounted in the tester."""
    nuisances = built.campaign.nuisances
    return 1.0 if nuisances is None else float(nuisances.stiffness[-1, joint])


def _distortion(built: BuiltCase, stiffness: Complex) -> Real:
    """(points,) percent: 0.15 of a good tester, and what a stiffness that changes with amplitude adds.

    A twentieth of d ln k / d ln x is taken for the third harmonic, as filled rubber has little of it: a law without
    memory has a sixth (k grows with x^2) to a quarter (with a power of x).
    """
    step = 0.05
    change = direct_stiffness(built, 1.0 + step) / stiffness - 1.0
    return 0.15 + 100.0 * 0.05 * np.abs(change) / step
