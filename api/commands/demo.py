"""`jointlab demo`: measure, identify and report on simulated instruments."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from api.commands.gap import show as show_diagnosis
from api.commands.identification import show
from api.commands.interrupts import INTERRUPTED, steering_by_keys
from api.commands.sequences import named_sequence
from api.commands.terminal import open_catalogue, out, progress_bar, progress_console, write_json
from api.commands.terminal_operator import SequenceProgress
from jointlab.errors import JointlabError
from jointlab.identification.document import identification_document, plain
from jointlab.identification.inverse import METHODS
from jointlab.identification.pipeline import Identification
from jointlab.identification.run import identify_and_save
from jointlab.instruments import instruments_of
from jointlab.report.gap import write_gap_report
from jointlab.report.identification import write_report
from jointlab.report.run_record import read_run_record
from jointlab.runs.carry_out import run_sequence
from jointlab.sequences import BUILT_IN, SUSPENDED
from jointlab.trials.demonstration import demonstrate, seal_section, sealed_bench_sections
from jointlab.trials.simulated_laboratory import simulated_laboratory, simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from jointlab.trials.simulated_truth import (
    SineTruth,
    by_amplitude,
    joint_errors,
    sine_truths,
    truth_document,
    truth_section,
)
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import Observer, notify_all
from rig.sequences.sequence import Sequence
from simlab.operator_server import OperatorClient
from store.catalogue import Catalogue

FASTEST = 100.0  # at higher speeds the wires take the time, not the bench


@dataclass
class Stopwatch:
    """Seconds of each stage."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what happens in the context."""
        started = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - started, 2)


def demo(
    folder: Annotated[Path, typer.Option(help="Where database, report and summary go.")] = Path("demo"),
    sequence: Annotated[
        str, typer.Option(help=f"A sequence (YAML), or one of ours: {BUILT_IN}, {SUSPENDED}.")
    ] = BUILT_IN,
    seed: Annotated[int, typer.Option(min=0, help="Which bench is drawn.")] = 1,
    speed: Annotated[float, typer.Option(min=1, max=1000, help="Bench time over wall time.")] = FASTEST,
) -> None:
    """Run the paper's two experiments on simulated instruments, identify both ways, compare and report.

    Everything goes through the wires that real instruments have. What the bench really is stays in its own process
    until the results are stored; then it is asked for and set beside them. Then a second bench is measured, with one
    effect that it has drawn and sealed: the gap between simulation and measurement is diagnosed, and the seal opened.
    """
    document = named_sequence(sequence)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise JointlabError(f"{folder} cannot be made: {error.strerror or error}") from error
    watch = Stopwatch()
    started = time.perf_counter()
    with watch.stage("start"):
        laboratory = simulated_laboratory(seed, speed)
    with laboratory:
        settings = simulated_settings(laboratory.addresses, database_url=f"sqlite:///{folder / 'jointlab.db'}")
        with open_catalogue(settings) as catalogue:
            control = RunControl()
            with watch.stage("measure"), _progress_and_keys(document, control) as progress:
                operator = SimulatedOperator(laboratory.operator)
                observer = notify_all(progress, operator.observe)
                run = run_sequence(document, instruments_of(settings), catalogue, operator, observer, control)
            with watch.stage("identify"):
                found = identify_and_save(catalogue, run, progress=progress_bar)
                record = read_run_record(catalogue, run)
        truth, sines = reveal(laboratory.operator, found)
    with watch.stage("sealed bench"), Catalogue.open(f"sqlite:///{folder / 'sealed.db'}") as catalogue:
        sealed = demonstrate(seed, speed, catalogue, _progress_and_keys, progress_bar)
    with watch.stage("report"):
        truths = (truth_section(found, truth, sines),)
        write_report(found, folder / "report.html", record=record, more=truths, last=sealed_bench_sections(sealed))
        write_gap_report(sealed.diagnosed.document, folder / "gap.html", more=(seal_section(sealed),))
    watch.seconds["total"] = round(time.perf_counter() - started, 2)
    summary = identification_document(found) | {
        "run": run,
        "truth": plain(truth_document(truth, sines)),
        "gap": sealed.document,
        "seconds": watch.seconds,
    }
    write_json(summary, folder / "summary.json")
    show(found)
    show_errors(found, truth, sines)
    out.print(f"\nA second bench has one effect that the paper's model leaves out, sealed as {sealed.commitment}")
    show_diagnosis(sealed.diagnosed.document)
    out.print(f"{sealed.sentence}; the SHA-256 of what was opened is that of the seal\n", style="bold")
    stages = ", ".join(f"{name} {seconds:.1f}" for name, seconds in watch.seconds.items())
    out.print(f"seconds: {stages}")
    files = ", ".join(str(folder / name) for name in ("report.html", "gap.html", "summary.json", "jointlab.db"))
    out.print(f"{files} (run {run}), {folder / 'sealed.db'} (run {sealed.run})")


@contextmanager
def _progress_and_keys(document: Sequence, control: RunControl) -> Iterator[Observer]:
    """Show the progress of a run, and let keys pause and stop it; Ctrl-C ends the demo once the run is stored."""
    try:
        with SequenceProgress(document, progress_console) as progress, steering_by_keys(control, progress_console):
            yield progress
    except RunStoppedError:
        raise typer.Exit(INTERRUPTED) from None


def reveal(operator: OperatorClient, found: Identification) -> tuple[dict[str, Any], tuple[SineTruth, ...]]:
    """Ask the bench what it really is, now that everything is identified.

    Raises:
        JointlabError: the bench is gone, or its log and the measurement do not fit together.
    """
    try:
        truth, dwells = operator.do("truth"), operator.do("dwells")
    except OSError as error:
        raise JointlabError(f"the simulated laboratory does not answer: {error}") from error
    return truth, sine_truths(found.measurement.points, dwells)


def show_errors(found: Identification, truth: dict[str, Any], sines: tuple[SineTruth, ...]) -> None:
    """How far off the results are, in short."""
    if found.inverse is not None:
        for result in found.inverse.results:
            joints, method = result.joints, METHODS[result.method]
            for name, errors in joint_errors(joints, truth["inverse"]).items():
                terms = ", ".join(
                    f"k{p + 1}{q + 1} {100 * errors[p, q]:+.2f} %"
                    for p, q in ((0, 0), (0, 1), (1, 1))
                    if joints[name].observable[p, q]
                )
                out.print(f"joint {name} against the truth at blow amplitude, {method}: {terms}")
    for amplitude, errors, covered in by_amplitude(sines):
        worst, share = 100 * abs(errors).max(axis=0), 100 * covered.mean(axis=0)
        out.print(
            f"sine points at {amplitude:g} mm: k within {worst[0]:.2f} %, gamma within {worst[1]:.2f} % of the truth; "
            f"95 % intervals hold {share[0]:.0f} % and {share[1]:.0f} % of {len(errors)}"
        )
