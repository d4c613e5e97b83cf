"""Which cases a trial has: singles over every effect, pairs, none, and effects outside the catalogue."""

from dataclasses import dataclass

import numpy as np

from simlab.case.draw import EFFECTS, NOVELTIES, Case, CaseKind, draw_case

CYCLE = tuple(map(CaseKind, ("single", "single", "none", "single", "pair", "single", "novel", "single")))


@dataclass(frozen=True)
class Planned:
    """One case of a trial.

    Attributes:
        number: in the trial, from 1.
        seed, kind, effects: what it is drawn from; a pair draws its own effects.
        without_truth: whether it is diagnosed once more with the true effect missing from the catalogue.
    """

    number: int
    seed: int
    kind: CaseKind
    effects: tuple[str, ...]
    without_truth: bool = False

    @property
    def name(self) -> str:
        """Of its files."""
        return f"{self.number:04d}"

    def draw(self) -> Case:
        """The case; its sizes follow from the seed."""
        return draw_case(self.seed, self.kind, self.effects)


def plan(cases: int, seed: int, honesty: int = 4) -> tuple[Planned, ...]:
    """The first `cases` of a trial; every effect comes before any comes twice.

    Args:
        cases: how many.
        seed: of the trial.
        honesty: of so many singles one is diagnosed once more without its true effect; 0 for none.
    """
    chance = np.random.default_rng([seed, 11])
    names = {CaseKind.SINGLE: list(EFFECTS), CaseKind.NOVEL: list(NOVELTIES)}
    queues = dict[CaseKind, list[str]]()
    planned, singles = list[Planned](), 0
    for number in range(1, cases + 1):
        kind = CYCLE[(number - 1) % len(CYCLE)]
        effects: tuple[str, ...] = ()
        if kind in names:
            if not queues.get(kind):
                queues[kind] = [str(name) for name in chance.permutation(names[kind])]
            effects = (queues[kind].pop(),)
        single = kind is CaseKind.SINGLE
        again = single and honesty > 0 and singles % honesty == 0
        singles += single
        own = int(np.random.SeedSequence([seed, number]).generate_state(1)[0])
        planned.append(Planned(number, own, kind, effects, again))
    return tuple(planned)
