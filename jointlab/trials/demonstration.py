"""One sealed bench, for the demo: measured over the wires, diagnosed, and only then opened."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

from jointlab.diagnosis.load import subject_of_run
from jointlab.diagnosis.pipeline import Diagnosed, diagnosed
from jointlab.diagnosis.save import save_diagnosis
from jointlab.diagnosis.wording import named
from jointlab.errors import JointlabError
from jointlab.report.gap import gap_sections
from jointlab.report.section import Notice, Section, Table
from jointlab.trials.instruments import measured_at, sequence_of
from jointlab.trials.simulated_laboratory import simulated_laboratory
from rig.control import RunControl
from rig.events import Observer
from rig.sequences.sequence import Sequence
from simlab.case.bundle import commitment
from store.catalogue import Catalogue
from store.progress import Progress

BLOWS, FREQUENCY_STEP = 6, 15.0
"""Blows at each point and Hz between sine points: coarser than in a laboratory, as a demo is short."""
Observing = Callable[[Sequence, RunControl], AbstractContextManager[Observer]]


@dataclass(frozen=True, eq=False)
class Demonstration:
    """A sealed bench that was diagnosed.

    Attributes:
        run: number of its run.
        commitment: SHA-256 of the truth, shown before anything was measured.
        diagnosed: the diagnosis, made without the truth.
        truth: from the opened seal.
    """

    run: int
    commitment: str
    diagnosed: Diagnosed
    truth: Mapping[str, Any]

    @property
    def sentence(self) -> str:
        """The truth in the seal, as a sentence."""
        parts = [f"{name} at {size:.2f} of its range" for name, size in self.truth["size"].items()]
        parameters = "; ".join(
            f"{name} = {value:.4g}" if isinstance(value, float) else f"{name}: {value}"
            for own in self.truth["parameters"].values()
            for name, value in own.items()
        )
        return f"the seal held {' and '.join(parts) or 'no effect'} ({parameters})"

    @property
    def right(self) -> bool:
        """Whether the diagnosis named the true effects."""
        return set(self.diagnosed.document["verdict"]["effects"]) == set(self.truth["effects"])

    @property
    def document(self) -> dict[str, Any]:
        """All results, ready for JSON."""
        seal = {"commitment": self.commitment, "truth": dict(self.truth), "right": self.right}
        return {"run": self.run, "diagnosis": self.diagnosed.document, "seal": seal}


def demonstrate(
    seed: int, speed: float, catalogue: Catalogue, observing: Observing, progress: Progress
) -> Demonstration:
    """Measure and diagnose a bench with one effect that its own process drew, then open its seal.

    Args:
        seed: of the bench.
        speed: bench time over wall time.
        catalogue: where its run is stored.
        observing: makes the observer of a sequence that is carried out, and may stop it by its control.
        progress: shows how far the evaluation is.

    Raises:
        JointlabError: the bench did not start, or opens another truth than it committed to.
        DaqError, RigError: an instrument failed, or the run was stopped.
    """
    with simulated_laboratory(seed, speed, kind="single") as laboratory:
        operator = laboratory.operator
        committed: str = operator.do("commitment")
        sequence = sequence_of(operator.do("drawing"), BLOWS, FREQUENCY_STEP)
        control = RunControl()
        with observing(sequence, control) as observer:
            run = measured_at(laboratory.addresses, operator, catalogue, sequence, observer, control)
        found = diagnosed(subject_of_run(catalogue, run, progress), progress=progress)
        with catalogue.writing() as session:
            save_diagnosis(session, run, found.document)
        seal = operator.do("open_seal")
    if commitment(seal) != committed:
        raise JointlabError("the bench revealed another truth than the one of its seal")
    return Demonstration(run, committed, found, seal["truth"])


def sealed_bench_sections(shown: Demonstration) -> tuple[Section, ...]:
    """The diagnosis of the sealed bench and its seal, for the end of a report on another bench; titles say so."""
    own = (*gap_sections(shown.diagnosed.document), seal_section(shown))
    notice = Notice("From here on it is the second, sealed bench; nothing of it is of the bench above.")
    first, *others = (replace(each, title=f"The second, sealed bench: {each.title}") for each in own)
    return replace(first, content=(notice, *first.content)), *others


def seal_section(shown: Demonstration) -> Section:
    """The report's section on the opened seal."""
    verdict = shown.diagnosed.document["verdict"]
    effects = named(verdict["effects"], shown.diagnosed.document["titles"])
    rows = (("diagnosis", effects or verdict["status"]), ("truth", shown.sentence), ("SHA-256", shown.commitment))
    return Section(
        "The seal, opened",
        (
            "The bench committed to its truth by a SHA-256 before it was measured, and opened it after the diagnosis "
            "was stored; the hash is that of what it opened.",
            Table("Diagnosis and truth", ("", ""), rows),
        ),
    )
