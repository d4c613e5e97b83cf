"""The diagnosis on labelled bundles of a simulator that shares no author with it (``../shared/benches``, or others).

    python -m tests.bench.bench_foreign --part seen --workers 2 --json FILE

Each case runs in a process of its own with a time limit. Answers are kept by the state of the code, so that a run that
was interrupted goes on. A third of the cases is unseen until a design is finished; it asks for ``--judge-unseen``.
"""

import argparse
import hashlib
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from jointlab.trials.folder import ARRAYS, read, write
from jointlab.trials.marks import MARK, Mark, Truth, marked
from jointlab.trials.summary import markdown, summary
from jointlab.trials.worker import answer
from tests.recordings import SHARED

ROOT = Path(__file__).resolve().parents[2]
CODE = ("analysis", "jointlab", "store")
"""What an answer depends on."""
ONE = "import sys; from tests.bench.bench_foreign import answer_one; answer_one(*sys.argv[1:])"
MARKS = TypeAdapter(list[Mark])


def names(benches: Path, part: str) -> list[str]:
    """Cases of a part, seen, unseen or all; every third by name is unseen."""
    every = sorted(each.name for each in benches.iterdir() if (each / "setup.json").exists())
    return [name for number, name in enumerate(every) if part == "all" or (number % 3 == 2) == (part == "unseen")]


def answer_one(benches: str, name: str, file: str) -> None:
    """Diagnose one case on one core and write the answer; predictions become their true gap, with the floor."""
    found = answer(Path(benches) / name)
    predicted, _ = (found.pop(each, None) for each in ARRAYS)
    found["unseen"] = None if predicted is None else _unseen(Path(benches) / "truth" / name, predicted)
    write(Path(file), found)


def answered(benches: Path, name: str, folder: Path, limit: float) -> Mark:
    """The mark of one case, from what is kept or from a new diagnosis of at most `limit` s."""
    file = folder / f"{name}.json"
    if not file.exists():
        try:
            done = subprocess.run(
                [sys.executable, "-c", ONE, str(benches), name, str(file)],
                cwd=ROOT,
                timeout=limit,
                capture_output=True,
                text=True,
            )
            if done.returncode:
                write(file, {"error": done.stderr.strip().splitlines()[-1][:300], "seconds": 0.0})
        except subprocess.TimeoutExpired:
            write(file, {"error": f"no answer in {limit:.0f} s", "seconds": limit})
    found = read(file)
    truth = TypeAdapter(Truth).validate_python(read(benches / "truth" / f"{name}.json"))
    return marked(truth, found, found.get("unseen"))


def state_of_code() -> str:
    """Names the code that answers: of its commit's trees, and of what is not committed."""
    trees = _git("rev-parse", *(f"HEAD:{each}" for each in CODE))
    return hashlib.sha256((trees + _git("diff", "HEAD", "--", *CODE)).encode()).hexdigest()[:12]


def table(marks: Sequence[Mark], before: dict[str, Mark]) -> str:
    """A line for each case, beside what another run said."""
    lines = []
    for mark in marks:
        truth, other = mark.truth, before.get(mark.truth.case)
        sign = "ok" if mark.right else "mechanism" if mark.mechanism_right else "-"
        gap = "" if mark.before is None else f"{mark.before:.1f} > {mark.after:.1f} ({truth.floor_percent:.1f})"
        lines.append(
            f"{truth.case:<12}{truth.kind:<8}{' + '.join((*truth.effects, *truth.novel)) or '-'}\n"
            f"    {sign:<10}{_said(mark)}  gap {gap} %  {mark.seconds:.0f} s"
            + (f"\n    before: {'ok' if other.right else '-'} {_said(other)}" if other else "")
        )
    return "\n".join(lines)


def main(arguments: Sequence[str] = ()) -> None:
    """Diagnose, score and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.bench_foreign", description=__doc__)
    parser.add_argument("--benches", type=Path, default=SHARED / "benches", help="folder of bundles with truth/")
    parser.add_argument("--part", choices=("seen", "unseen", "all"), default="seen")
    parser.add_argument("--judge-unseen", action="store_true", help="the design is finished: open the unseen third")
    parser.add_argument("--names", nargs="*", help="only these cases of the part")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds a case")
    parser.add_argument("--json", type=Path, help="write marks and figures here")
    parser.add_argument("--publish", type=Path, help="add the verdicts to the record that a trial published here")
    parser.add_argument("--against", type=Path, help="the --json of another run, shown beside")
    parser.add_argument("--cache", type=Path, default=Path(gettempdir()) / "jointlab-foreign")
    given = parser.parse_args(arguments)
    if given.part != "seen" and not given.judge_unseen:
        parser.error("every third case is unseen until the design is finished; say --judge-unseen then")
    if not given.benches.is_dir():
        parser.exit(0, f"skipped: there are no labelled bundles in {given.benches}\n")
    benches = given.benches.resolve()
    folder = given.cache / state_of_code()
    folder.mkdir(parents=True, exist_ok=True)
    chosen = [name for name in names(benches, given.part) if not given.names or name in given.names]
    marks = []
    with ThreadPoolExecutor(given.workers) as pool:
        before = MARKS.validate_python(read(given.against)["marks"]) if given.against else []
        others = {each.truth.case: each for each in before}
        for mark in pool.map(lambda name: answered(benches, name, folder, given.limit), chosen):
            print(table([mark], others), flush=True)
            marks.append(mark)
    figures = summary(marks)
    print(markdown(figures))
    if given.publish:
        record = read(given.publish)
        verdicts = [*record["verdicts"], *figures["verdicts"]]
        versions = sorted({*record["versions"], *figures["versions"]})
        write(given.publish, record | {"cases": len(verdicts), "verdicts": verdicts, "versions": versions})
    if given.json:
        document = {"commit": _git("describe", "--always", "--dirty").strip(), "part": given.part, "summary": figures}
        write(given.json, document | {"marks": [MARK.dump_python(each, mode="json") for each in marks]})


def _unseen(truth: Path, predicted: dict[str, Any]) -> float | None:
    """Gap in percent of what was predicted after the diagnosis to the noiseless truth, with the floor, in squares."""
    file = truth.with_suffix(".npz")
    if not file.exists():
        return None
    with np.load(file) as archive:
        frequency, true, rows = archive["f"], archive["H"], [str(each) for each in archive["rows"]]
    asked = np.round(np.asarray(predicted["frequency"]), 3)
    common, ours, theirs = np.intersect1d(asked, np.round(frequency, 3), return_indices=True)
    assert common.size > asked.size // 3, f"{file.name} has other lines than the bundle"
    wanted = true[:, theirs]
    found = np.asarray(predicted["after"])[[predicted["input"].index(row) for row in rows]][:, ours]
    floor = read(truth.with_suffix(".json"))["floor_percent"]
    gap = 100.0 * np.sqrt(np.sum(np.abs(found - wanted) ** 2) / np.sum(np.abs(wanted) ** 2))
    return float(np.hypot(gap, floor))


def _said(mark: Mark) -> str:
    if mark.error:
        return mark.error
    inclusion = ", ".join(f"{effect} {sure:.2f}" for effect, sure in sorted(mark.included.items()) if sure >= 0.05)
    return f"{mark.status}: {' + '.join(mark.named) or '-'} ({mark.probability:.3f}) [{inclusion}]"


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, check=True, capture_output=True, text=True).stdout


if __name__ == "__main__":
    main(sys.argv[1:])
