"""Sealed benches whose first verdict is wrong, doubtful or unknown: how many are right after at most three experiments?

    python -m tests.bench.bench_investigate --first 1 --benches 2 --folder FOLDER

Drawn as a trial draws them. Benches whose first verdict is right and clear are left out; of the others the rig time is
that of the experiments made, over that of a fixed list: the five further measurements and all checks, without advice.
An interrupted benchmark goes on when the same command is given again.
"""

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path

from analysis.gap.experiments.catalogue import CHANGES_THE_BENCH, EXPERIMENTS, SizeCheck
from jointlab.diagnosis.investigation import Answer, Asked, Budget, Investigation
from jointlab.diagnosis.investigation_folder import investigate, stored
from jointlab.diagnosis.load import Subject, subject_of_bundle
from jointlab.diagnosis.rig_time import rig_time
from jointlab.trials.plan import plan
from simlab.case.bundle import write_case
from simlab.case.draw import Case, CaseKind
from store.exchange.bundle import read_bundle
from tests.bench.sealed_bench import SealedBench

CLEAR = 0.9
"""Probability of a verdict that is not doubtful."""
SEED = 20


def load(source: str) -> Subject:
    """A bundle."""
    return subject_of_bundle(read_bundle(Path(source)))


def truth(case: Case) -> tuple[str, ...]:
    """What is to be named."""
    return ("unknown",) if case.kind is CaseKind.NOVEL else tuple(sorted(each.name for each in case.effects))


def fixed_minutes(source: str) -> float:
    """Of the whole list of experiments on a bench."""
    first, total = load(source).measurement, 0.0
    for each in EXPERIMENTS:
        if isinstance(each, SizeCheck):
            total += each.minutes
        elif each.id not in CHANGES_THE_BENCH and (further := each.planned(first)) is not None:
            total += rig_time().minutes(further, each.rigs)
    return total


def main() -> None:
    """Carry out the benchmark, one bench after the other, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--benches", type=int, default=1)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no further diagnosis after these")
    given = parser.parse_args()
    ends = time.monotonic() + given.seconds
    for planned in plan(given.first + given.benches - 1, SEED)[given.first - 1 :]:
        case, folder = planned.draw(), given.folder / planned.name
        first = folder / "first"
        if not first.exists():
            write_case(case, first)
        state = stored(folder)
        while time.monotonic() < ends and not (state and state.steps and state.steps[-1].ended):
            state = one_step(case, folder, state)
            if len(state.steps) == 1 and state.steps[0].effects == truth(case) and state.steps[0].probability > CLEAR:
                break
        if state is not None:
            print(json.dumps(line(planned.name, case, state)), flush=True)


@dataclass
class AnswersSome:
    """A bench that answers some requests and leaves the next one open."""

    bench: SealedBench
    left: int

    def carry_out(self, asked: Asked) -> Answer | None:
        """The answer, as long as there are any left."""
        self.left -= 1
        return self.bench.carry_out(asked) if self.left >= 0 else None


def one_step(case: Case, folder: Path, state: Investigation | None) -> Investigation:
    """The next diagnosis, after the answer to the open request."""
    bench = AnswersSome(SealedBench(case, folder), 0 if state is None else 1)
    return investigate(folder, str(folder / "first"), bench, load, Budget(), workers=1)


def line(name: str, case: Case, state: Investigation) -> dict[str, object]:
    """What a bench says."""
    first, last = state.steps[0], state.steps[-1]
    return {
        "bench": name,
        "truth": truth(case),
        "first": [*first.effects, round(first.probability, 3)],
        "asked": [each.asked.experiment.id.value for each in state.steps if each.asked],
        "last": [*last.effects, round(last.probability, 3)],
        "ended": last.ended,
        "right_first": first.effects == truth(case),
        "right": last.effects == truth(case),
        "minutes": round(state.minutes, 1),
        "fixed": round(fixed_minutes(state.target), 1),
    }


if __name__ == "__main__":
    main()
