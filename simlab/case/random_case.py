"""Draw a case whose laws are random functions, on one of several benches, with every nuisance of a real one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simlab.case.campaign import CONFIGURATIONS, MEASURED, Campaign, draw_campaign, draw_setup
from simlab.case.draw import COUNTS, SMALLEST, Case, CaseKind, draw_article, random_stream
from simlab.case.drawing import DRAWINGS
from simlab.case.nuisances import Nuisances
from simlab.case.random_laws import OUTSIDE, RANDOM_LAWS

SIZES = {CaseKind.TRIPLE: (0.25, 0.8), CaseKind.FIVE: (0.1, 0.3)}
"""Range of sizes, as fractions of a plausible range; for other kinds it is from `SMALLEST` to 1."""

ALIKE = ({"amplitude_dependence", "cubic_stiffness", "coulomb_friction"}, {"youngs_modulus", "density"})
"""Groups of effects that no method could distinguish if two of them were there."""


def draw_random_case(seed: int, kind: CaseKind, effects: Sequence[str] = ()) -> Case:
    """The case of a seed and a kind; bench, campaign, article and nuisances depend on the seed alone.

    A campaign of one hammer set is repeated where an effect tells sets apart, as it would not be there otherwise.

    Args:
        effects: names in place of drawn ones, as many as the kind has.

    Raises:
        ValueError: an effect does not exist, or their number does not suit the kind.
    """
    known = OUTSIDE if kind is CaseKind.NOVEL else RANDOM_LAWS
    if effects and (len(set(effects)) != COUNTS[kind] or not set(effects) <= set(known)):
        raise ValueError(f"a {kind} case has {COUNTS[kind]} of {', '.join(known)}; not {', '.join(effects)}")
    rng = random_stream(seed, 21)
    drawing = list(DRAWINGS.values())[int(rng.integers(len(DRAWINGS)))]
    rng = random_stream(seed, 25)
    names = effects or _drawn_together([str(name) for name in rng.permutation(list(known))], COUNTS[kind])
    campaign = draw_campaign(random_stream(seed, 22), drawing)
    article = draw_article(random_stream(seed, 23), campaign.node_positions, drawing)
    needed = max((known[name].sets for name in names), default=1)
    campaign = _with_nuisances(random_stream(seed, 24), _with_sets(random_stream(seed, 26), campaign, needed))
    sizes = rng.uniform(*SIZES.get(kind, (SMALLEST, 1.0)), len(names))
    drawn = tuple(known[name].draw(rng, float(size), article) for name, size in zip(names, sizes, strict=True))
    return Case(seed, kind, article, campaign, drawn)


def _drawn_together(names: Sequence[str], count: int) -> list[str]:
    """The first `count` of `names`, without two of one group of `ALIKE`."""
    chosen = list[str]()
    for name in names:
        if not any({name, other} <= group for group in ALIKE for other in chosen):
            chosen.append(name)
    return chosen[:count]


def _with_sets(rng: np.random.Generator, campaign: Campaign, needed: int) -> Campaign:
    last = campaign.setups[-1]
    repeats = [draw_setup(rng, last.peak_force, last.temperature) for _ in range(needed - len(campaign.setups))]
    return replace(campaign, setups=(*campaign.setups, *repeats))


def _with_nuisances(rng: np.random.Generator, campaign: Campaign) -> Campaign:
    nuisances = Nuisances.draw(rng, len(campaign.setups), len(CONFIGURATIONS), len(MEASURED))
    return replace(campaign, nuisances=nuisances, amplitude_power=float(rng.uniform(0.7, 2.0)))
