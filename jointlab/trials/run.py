"""A whole trial: seal, diagnose, open, judge, score. A trial that was killed continues where it was."""

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pydantic import ValidationError

from jointlab.diagnosis.load import subject_of_bundle
from jointlab.diagnosis.process_pool import one_thread_each
from jointlab.errors import JointlabError
from jointlab.report.trial_figures import confusion, reliability
from jointlab.trials.detectability import Detectability
from jointlab.trials.folder import TrialFolder, read, write
from jointlab.trials.instruments import measure
from jointlab.trials.judge import judged
from jointlab.trials.marks import MARK, Mark
from jointlab.trials.plan import Planned, plan
from jointlab.trials.summary import markdown, summary
from jointlab.trials.worker import answer_packed, packed
from simlab.case.bundle import write_case
from store.exchange.bundle import read_bundle
from store.progress import Progress, silent

FORMAT = "jointlab-trial/3"
Begun = tuple[Future[dict[str, Any]], Callable[[dict[str, Any]], None]]
"""Work that is running, and the function that handles its result."""
AHEAD = 4
"""Number of judgements that run at once."""


@dataclass(frozen=True)
class TrialSettings:
    """The settings of a trial.

    Attributes:
        cases, seed: of the plan.
        folder: where seals, answers and scores go.
        workers: processes that diagnose.
        plain: laws of the catalogue on the paper's bench, without nuisances, instead of random ones on several.
        through_instruments: measure every case over the wires, a minute or two each, in place of files.

    Raises:
        JointlabError: only plain cases can be measured over the wires.
    """

    cases: int
    seed: int
    folder: Path
    workers: int = 2
    plain: bool = False
    through_instruments: bool = False

    def __post_init__(self) -> None:
        if self.through_instruments and not self.plain:
            raise JointlabError("only cases by the laws of the catalogue can be measured over the wires; add --plain")

    @property
    def settings(self) -> dict[str, Any]:
        """Settings that identify a trial: others make another trial."""
        return {
            "format": FORMAT,
            "cases": self.cases,
            "seed": self.seed,
            "plain": self.plain,
            "through_instruments": self.through_instruments,
        }


def carry_out(
    trial: TrialSettings, progress: Progress = silent, *, stop: bool = False, pool: Executor | None = None
) -> dict[str, Any]:
    """Carry out a trial, or what is left of it, and return its scores, which are in its folder too.

    Args:
        trial: what is tried.
        progress: shows how far the work is.
        stop: diagnose no further cases, and judge those that have been answered.
        pool: of as many workers as the trial has, maybe on other computers; None for processes of its own.

    Raises:
        JointlabError: the folder holds another trial, or a seal was tampered with.
    """
    folder, cases = TrialFolder(trial.folder), plan(trial.cases, trial.seed, plain=trial.plain)
    folder.begin(trial.settings)
    seal_all(folder, cases, progress)
    with _pool(trial.workers) if pool is None else nullcontext(pool) as pool:
        if stop:
            cases = tuple(case for case in cases if folder.answer_file(case).exists())
        else:
            answer_all(trial, folder, cases, pool, progress)
        found = judge_all(folder, cases, pool, progress)
    result = summary(found)
    write(trial.folder / "scores.json", result)
    (trial.folder / "scores.md").write_text(markdown(result), encoding="utf-8")
    pictures = {"reliability": reliability(result), "confusion": confusion(result["confusion"])}
    for name, picture in pictures.items():
        (trial.folder / f"{name}.svg").write_text(picture, encoding="utf-8")
    return result


def seal_all(folder: TrialFolder, cases: Sequence[Planned], progress: Progress = silent) -> None:
    """Commit to every truth, once and before any diagnosis."""
    if folder.commitments:
        return
    commitments = dict[str, str]()
    with progress("seals", len(cases)) as advance:
        for case in cases:
            commitments[case.name] = folder.seal(case)
            advance(1)
    folder.commit(commitments)


def answer_all(
    trial: TrialSettings, folder: TrialFolder, cases: Sequence[Planned], pool: Executor, progress: Progress
) -> None:
    """Diagnose the cases without an answer; a bundle is deleted after its diagnosis."""
    left = [case for case in cases if not folder.answer_file(case).exists()]

    def begin(case: Planned) -> Begun:
        with TemporaryDirectory() as scratch:
            (measure if trial.through_instruments else write_case)(case.draw(), Path(scratch))
            return pool.submit(answer_packed, packed(Path(scratch))), partial(folder.keep, case)

    with progress("diagnoses", len(left)) as advance:
        # one more than there are workers, so that none waits for a case to be written
        for _ in _in_turn((partial(begin, case) for case in left), trial.workers + 1):
            advance(1)


def judge_all(folder: TrialFolder, cases: Sequence[Planned], pool: Executor, progress: Progress) -> list[Mark]:
    """Open every seal and judge every answer, except those that have been judged."""
    left = [case for case in cases if not folder.judgement_file(case).exists()]

    def begin(case: Planned) -> Begun:
        given = folder.answer(case)
        assert given is not None, "a seal opens only on an answer"
        future = pool.submit(judge, case, folder.open(case), given)
        return future, lambda found: write(folder.judgement_file(case), found)

    with progress("judgements", len(left)) as advance:
        for _ in _in_turn((partial(begin, case) for case in left), AHEAD):
            advance(1)
    return [_mark(folder.judgement_file(case)) for case in cases]


def judge(planned: Planned, truth: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
    """Judge the answer to one case by its truth, in a worker's process."""
    case = planned.draw()
    with TemporaryDirectory() as scratch:
        write_case(case, Path(scratch))
        measurement = subject_of_bundle(read_bundle(Path(scratch))).measurement
    found: dict[str, Any] = MARK.dump_python(judged(truth, given, Detectability(case, measurement)), mode="json")
    return found


def _mark(file: Path) -> Mark:
    try:
        return MARK.validate_python(read(file))
    except ValidationError as error:
        raise JointlabError(
            f"{file} was written by another version of Jointlab: remove the folder {file.parent} and give the command "
            "of the trial again, which judges all answers again"
        ) from error


def _in_turn(starts: Iterator[Callable[[], Begun]], at_once: int) -> Iterator[None]:
    """Begin `at_once` pieces of work, keep each result, and yield once for each."""
    running = dict[Future[dict[str, Any]], Callable[[dict[str, Any]], None]]()
    for start in starts:
        future, keep = start()
        running[future] = keep
        if len(running) >= at_once:
            yield from _kept(running)
    while running:
        yield from _kept(running)


def _kept(running: dict[Future[dict[str, Any]], Callable[[dict[str, Any]], None]]) -> Iterator[None]:
    done, _ = wait(running, return_when=FIRST_COMPLETED)
    for future in done:
        running.pop(future)(future.result())
        yield


def _pool(workers: int) -> Executor:
    """Processes that inherit nothing, so that the truths known to this process are not in their memory.

    A job of the service may have no processes of its own; it has a thread, which gets no truth either.
    """
    if multiprocessing.current_process().daemon:
        return ThreadPoolExecutor(1)
    one_thread_each()
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))
