"""An examination of planted faults and of healthy benches: is each fault found by its check, and nothing else said?

Each fault is planted on benches of `FAULTY` seeds; `HEALTHY` benches have none. Every bench is examined at rest, with
trips, on a calibrator and on a suspended mass. A healthy bench counts as one false alarm where any check fails.
"""

import time
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from rig.checks.check import Place
from simlab.laboratory import Laboratory
from simlab.ordinary import BenchConditions
from tests.rig.conftest import CHANNELS
from tests.rig.planted_faults import PLANTED, Planted, examined, failures

HEALTHY, FAULTY = range(50), range(3)
AT_ONCE = 6  # benches; most of the time an examination waits, for a watchdog say
SPEED = 200.0


@dataclass(frozen=True)
class Outcome:
    """What failed at one bench, and how long its examination took."""

    failed: frozenset[tuple[str, str]]
    seconds: float


def outcome(seed: int, planted: Planted | None = None) -> Outcome:
    """Examine the bench of `seed` at every place."""
    table = CHANNELS if planted is None else planted.change(CHANNELS)
    with Laboratory(seed, SPEED, BenchConditions()) as laboratory:
        if planted is not None:
            planted.plant(laboratory)
        began, failed = time.monotonic(), set[tuple[str, str]]()
        for place in Place:
            try:
                failed |= failures(examined(laboratory, table, place))
            except Exception as error:  # noqa: BLE001 - shown as what failed: the fault is in another instrument
                failed.add((type(error).__name__, place))
        return Outcome(frozenset(failed), time.monotonic() - began)


def main() -> None:
    """Print a line for each fault, then the healthy benches."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        tasks = [(planted, pool.submit(outcome, seed, planted)) for planted in PLANTED for seed in FAULTY]
        found = Counter(planted.name for planted, task in tasks if planted.shows in task.result().failed)
        for planted in PLANTED:
            beside = [task.result().failed - {planted.shows} for other, task in tasks if other is planted]
            print(f"{planted.name:<36} {found[planted.name]} of {len(FAULTY)}   beside it: {_text(beside)}", flush=True)
        whole = sum(found[planted.name] == len(FAULTY) for planted in PLANTED)
        print(f"found on every bench: {whole} of {len(PLANTED)} faults")
        healthy = list(pool.map(outcome, HEALTHY))
    false = [each.failed for each in healthy if each.failed]
    longest = max(each.seconds for each in healthy)
    print(f"healthy benches with a false alarm: {len(false)} of {len(healthy)} ({_text(false)})")
    print(f"an examination at three places took {longest:.1f} s at most")


def _text(failed: Iterable[frozenset[tuple[str, str]]]) -> str:
    counted = Counter(each for bench in failed for each in bench)
    return ", ".join(f"{id_} {subject} {count}" for (id_, subject), count in sorted(counted.items())) or "none"


if __name__ == "__main__":
    main()
