"""Direct against inverse on benches without any effect: how often do the two differ, where 5 % should?

    python -m tests.bench.bench_compare --benches 200 --seconds 100    # again and again, until all are done

Cases are those of `draw_case` without effects: bundles of both experiments, with all stated tolerances drawn. Verdicts
are kept in a file, bench by bench, so that a run in pieces goes on.
"""

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir

from analysis.comparison import Agreement
from jointlab.identification.load import measurement_of_bundle
from jointlab.identification.pipeline import identify
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case
from store.exchange.bundle import read_bundle

FIRST = 100


def verdicts(seed: int) -> dict[str, str]:
    """Of each element compared, and `passed`: yes where the fit passed its checks."""
    with TemporaryDirectory() as folder:
        write_case(draw_case(seed, CaseKind.NONE), Path(folder))
        found = identify(measurement_of_bundle(read_bundle(Path(folder))))
    assert found.inverse is not None
    passed = all(check.passed for check in found.inverse.fit.all_checks)
    return {f"{each.joint} {each.element}": each.verdict.value for each in found.comparison} | {
        "passed": "yes" if passed else "no"
    }


def main(arguments: Sequence[str] = ()) -> None:
    """Compare on benches that are not in the file yet, as long as is allowed, and print the shares of all that are."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.bench_compare", description=__doc__)
    parser.add_argument("--benches", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="after which no further bench begins")
    parser.add_argument("--cache", type=Path, default=Path(gettempdir()) / "jointlab-compare.jsonl")
    given = parser.parse_args(arguments)
    ends = time.monotonic() + given.seconds
    lines = given.cache.read_text(encoding="utf-8").splitlines() if given.cache.exists() else []
    found = {int(seed): told for seed, told in map(json.loads, lines)}
    for seed in range(FIRST, FIRST + given.benches):
        if seed not in found and time.monotonic() < ends:
            found[seed] = verdicts(seed)
            with given.cache.open("a", encoding="utf-8") as file:
                file.write(json.dumps([seed, found[seed]]) + "\n")
    for passed in ("yes", "no"):
        chosen = [told for told in found.values() if told["passed"] == passed]
        counts = Counter(
            (place, verdict) for told in chosen for place, verdict in told.items() if verdict in set(Agreement)
        )
        print(f"{len(chosen)} benches, fit passed: {passed}")
        for place in sorted({place for place, _ in counts}):
            differ, agree = (counts[place, verdict] for verdict in (Agreement.DIFFER, Agreement.AGREE))
            print(f"  {place:<16} differ in {differ} of {differ + agree}")
        differ = sum(number for (_, verdict), number in counts.items() if verdict == Agreement.DIFFER)
        compared = sum(number for (_, verdict), number in counts.items() if verdict != Agreement.NOT_COMPARABLE)
        print(f"  all              differ in {differ} of {compared}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
