"""The cases of a trial: singles over every effect, several at once, none, and effects outside the catalogue."""

from dataclasses import dataclass

import numpy as np

from simlab.case.draw import EFFECTS, NOVELTIES, Case, CaseKind, draw_case
from simlab.case.random_case import draw_random_case
from simlab.case.random_laws import OUTSIDE, RANDOM_LAWS

PLAIN_CYCLE = tuple(map(CaseKind, ("single", "single", "none", "single", "pair", "single", "novel", "single")))
FIRST = ("single", "triple", "none", "single", "pair", "single", "novel", "single")
SECOND = ("single", "five", "none", "single", "pair", "single", "novel", "single")
CYCLE = tuple(map(CaseKind, (*FIRST, *SECOND)))


@dataclass(frozen=True)
class Planned:
    """One case of a trial.

    Attributes:
        number: in the trial, from 1.
        seed, kind, effects: what it is drawn from; several effects are drawn by the seed.
        plain: drawn by the laws of the catalogue on the paper's bench, without nuisances.
    """

    number: int
    seed: int
    kind: CaseKind
    effects: tuple[str, ...]
    plain: bool = False

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.number:04d}"

    def draw(self) -> Case:
        """The case; its sizes follow from the seed."""
        return (draw_case if self.plain else draw_random_case)(self.seed, self.kind, self.effects)


def plan(cases: int, seed: int, *, plain: bool = False) -> tuple[Planned, ...]:
    """The first `cases` of a trial; every effect comes before any comes twice.

    Args:
        cases: how many.
        seed: of the trial.
        plain: by the laws of the catalogue on the paper's bench, without nuisances, triples and fives.
    """
    chance = np.random.default_rng([seed, 11])
    known = (EFFECTS, NOVELTIES) if plain else (tuple(RANDOM_LAWS), tuple(OUTSIDE))
    names = dict(zip((CaseKind.SINGLE, CaseKind.NOVEL), known, strict=True))
    cycle = PLAIN_CYCLE if plain else CYCLE
    queues = dict[CaseKind, list[str]]()
    planned = list[Planned]()
    for number in range(1, cases + 1):
        kind = cycle[(number - 1) % len(cycle)]
        effects: tuple[str, ...] = ()
        if kind in names:
            if not queues.get(kind):
                queues[kind] = [str(name) for name in chance.permutation(names[kind])]
            effects = (queues[kind].pop(),)
        own = int(np.random.SeedSequence([seed, number]).generate_state(1)[0])
        planned.append(Planned(number, own, kind, effects, plain))
    return tuple(planned)
