"""Draw a case: everything about it from one seed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from simlab.article import (
    INCLINATIONS_DEG,
    JOINT_NODES,
    SENSOR_NODE,
    TOLERANCES,
    SimulatedArticle,
    SimulatedJoint,
    clipped_normal,
    off_nominal,
)
from simlab.case.campaign import Campaign, draw_campaign
from simlab.case.drawing import PAPER, BenchKind
from simlab.case.effects import CATALOGUE, RECORD_EFFECTS, SimulatedEffect
from simlab.case.effects import NOVELTIES as NOVEL_KINDS
from simlab.elastomer import LinearCylinder

EFFECTS: tuple[str, ...] = tuple(CATALOGUE)
"""Every effect of the catalogue that shows in averaged data."""
NOVELTIES: tuple[str, ...] = tuple(NOVEL_KINDS)
"""Effects outside the catalogue."""

SMALLEST = 0.05
"""Smallest size, as a share of the plausible range: about what the lab's tolerances hide."""


class CaseKind(StrEnum):
    """What a case has beyond the paper's model."""

    NONE = "none"
    SINGLE = "single"
    PAIR = "pair"
    NOVEL = "novel"
    TRIPLE = "triple"
    FIVE = "five"


COUNTS = {"none": 0, "single": 1, "pair": 2, "novel": 1, "triple": 3, "five": 5}


@dataclass(frozen=True, eq=False)
class Case:
    """A case as drawn.

    Attributes:
        seed, kind: from which it was drawn; the ordinary bench has no kind.
        article: within the laboratory's tolerances, without the effects.
        campaign: how it is measured.
        effects: that the paper's model leaves out, each with size, law and values.
    """

    seed: int
    kind: CaseKind | None
    article: SimulatedArticle
    campaign: Campaign
    effects: tuple[SimulatedEffect, ...]

    def repeatable(self) -> "Case":
        """The same case without nuisances."""
        return replace(self, campaign=replace(self.campaign, nuisances=None))

    def without_error(self) -> "Case":
        """The same case without the error of accelerances that no model predicts."""
        if self.campaign.nuisances is None:
            return self
        return replace(self, campaign=replace(self.campaign, nuisances=self.campaign.nuisances.without_error()))


def draw_case(seed: int, kind: CaseKind, effects: Sequence[str] = (), size: float | None = None) -> Case:
    """The case of a seed and a kind; article and campaign depend on the seed alone.

    Args:
        effects: names in place of drawn ones, as many as the kind has (`COUNTS`); empty to draw them.
        size: fraction of every effect's plausible range, above 0 and up to 1; drawn between 0.05 and 1 by default.

    Raises:
        ValueError: an effect does not exist, their number does not suit the kind, or the size is out of range.
    """
    common = NOVEL_KINDS if kind is CaseKind.NOVEL else CATALOGUE
    known = common if kind is CaseKind.NOVEL else CATALOGUE | RECORD_EFFECTS
    if effects and len(effects) != COUNTS[kind]:
        raise ValueError(f"a {kind} case has {COUNTS[kind]} effects, not {len(effects)}: {', '.join(effects)}")
    if len(set(effects)) != len(effects):
        raise ValueError(f"an effect can be in a case once, not in {', '.join(effects)}")
    for name in effects:
        if name not in known:
            raise ValueError(f"no effect {name!r} for a {kind} case; there are {', '.join(known)}")
    if size is not None and not 0.0 < size <= 1.0:
        raise ValueError(f"a size of {size}; it is a fraction of the plausible range, above 0 and up to 1")
    campaign = draw_campaign(random_stream(seed, 1))
    article = draw_article(random_stream(seed, 2), campaign.node_positions)
    rng = random_stream(seed, 3)
    chosen = [str(name) for name in rng.permutation(list(common))[: COUNTS[kind]]]
    drawn = []
    for name in effects or chosen:
        drawn_size = float(rng.uniform(SMALLEST, 1.0))
        drawn.append(known[name].draw(rng, drawn_size if size is None else size, article))
    return Case(seed, kind, article, campaign, tuple(drawn))


def draw_article(rng: np.random.Generator, nodes: tuple[float, ...], drawing: BenchKind = PAPER) -> SimulatedArticle:
    """An article on the drawing's `nodes` (11,), off it by the tolerances; both cylinders of a joint are alike."""
    beam = off_nominal(rng, nominal=drawing.beam)
    joints = {}
    for name, node in JOINT_NODES.items():
        shear, compression = (typical * rng.uniform(0.82, 1.18) for typical in drawing.joints[name])
        shear_loss, compression_loss = rng.uniform(0.08, 0.155), rng.uniform(0.06, 0.135)
        position = nodes[node - 1] + float(clipped_normal(rng, TOLERANCES["node_position"]))
        cylinder = LinearCylinder(
            shear=complex(shear * (1 + 1j * shear_loss)),
            compression=complex(compression * (1 + 1j * compression_loss)),
            rotation=complex(rng.uniform(6.0, 30.0) * (1 + 1j * compression_loss)),
        )
        lean = float(clipped_normal(rng, TOLERANCES["inclination_deg"]))
        joints[name] = SimulatedJoint(position, (cylinder, cylinder), INCLINATIONS_DEG[name], lean_deg=lean)
    sensor = nodes[SENSOR_NODE - 1] + float(clipped_normal(rng, TOLERANCES["node_position"]))
    return SimulatedArticle(beam, joints, sensor)


def random_stream(seed: int, stream: int) -> np.random.Generator:
    """One of the independent streams of chance of a case."""
    return np.random.default_rng([seed, 7, stream])
